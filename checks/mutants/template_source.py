"""The mutations of a template: operators, numbers, conditions and statements of the text that it
emits, and the conditions of the template itself.
"""

import re
from collections.abc import Iterator

from .mutation import Mutation
from .python_source import short

# never mutated: comments, texts, preprocessor lines, loops and includes of the template
SKIPPED = re.compile(
    rb"\{#.*?#\}|\{%.*?%\}|/\*.*?\*/|//[^\n]*|\"\"\".*?\"\"\"|\"(?:\\.|[^\"\\\n])*\"|^[ \t]*#[^\n]*"
    rb"|^(?:from|import) [^\n]*|^ +\* [^\n]*"  # the last: a comment with branches in it
    rb"|\| *(?:batch|replace|join|map)\([^)]*\)",
    re.DOTALL | re.MULTILINE,
)
SWAPS = {
    b" < ": (b" <= ", b" >= "),
    b" <= ": (b" < ", b" > "),
    b" > ": (b" >= ", b" <= "),
    b" >= ": (b" > ", b" < "),
    b" == ": (b" != ",),
    b" != ": (b" == ",),
    b" && ": (b" || ",),
    b" || ": (b" && ",),
    b" + ": (b" - ",),
    b" - ": (b" + ",),
    b" * ": (b" / ",),
    b" / ": (b" * ",),
    b" += ": (b" -= ",),
    b" -= ": (b" += ",),
    b" *= ": (b" /= ",),
    b" & ": (b" | ",),
    b" | ": (b" & ",),
    b" << ": (b" >> ",),
    b" >> ": (b" << ",),
}
OPERATOR = re.compile(b"|".join(re.escape(op) for op in sorted(SWAPS, key=len, reverse=True)))
NUMBER = re.compile(rb"(?<![\w.])\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
NOT = re.compile(rb"!(?=[\w(])")
CONDITION = re.compile(rb"(?<=\bif \()(.+)(?=\) \{$)", re.MULTILINE)
BRANCH = re.compile(rb"(?<=\{% if )(.+?)(?= %\})")
# an assignment to a declared variable, or a call; no declaration and no return
STATEMENT = re.compile(
    rb"^[ \t]*((?:\*?[\w.\[\]>{}-][^=;\n(]*(?: [-+*/|&]?= )[^;\n]+|[\w{} ]+\([^;\n]*\));)$",
    re.MULTILINE,
)
DECLARED = re.compile(
    rb"(?:static |const |real |int |long |lanes |return |typedef |unsigned |goto )"
)
PIPE = re.compile(rb"\{\{[^{}]*\}\}")


def mutations(path: str, source: bytes) -> Iterator[Mutation]:
    """Yield every mutation of a template."""
    spans = [match.span() for match in SKIPPED.finditer(source)]
    for start, end, after in changes(source):
        if not any(a < end and start < b for a, b in spans):
            yield mutation(path, source, start, end, after)
    for match in BRANCH.finditer(source):
        yield mutation(path, source, *match.span(), b"not (" + match[1] + b")")


def changes(source: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Yield spans of bytes and their replacements."""
    filters = [match.span() for match in PIPE.finditer(source)]
    for match in OPERATOR.finditer(source):
        if not (match[0] == b" | " and any(a < match.start() < b for a, b in filters)):
            yield from ((*match.span(), other) for other in SWAPS[match[0]])
    for match in NUMBER.finditer(source):
        number = match[0].decode()
        other = str(int(number) + 1) if number.isdigit() else repr(1.5 * float(number) or 1.0)
        yield *match.span(), other.encode()
    for match in NOT.finditer(source):
        yield *match.span(), b""
    for match in CONDITION.finditer(source):
        yield *match.span(1), b"!(" + match[1] + b")"
    for match in STATEMENT.finditer(source):
        if not DECLARED.match(match[1]):
            yield *match.span(1), b";"


def mutation(path: str, source: bytes, start: int, end: int, after: bytes) -> Mutation:
    """Return a mutation with its line and its change in words."""
    line = source.count(b"\n", 0, start) + 1
    text = source.split(b"\n")[line - 1].decode().strip()
    change = f"{short(source[start:end].decode())} -> {short(after.decode()) or '(nothing)'}"
    return Mutation(path, line, start, end, after.decode(), text, change)
