"""Plain docstrings as reStructuredText.

Docstrings are plain text: a line "duration: s, at most." describes an argument, and |tau| is a
magnitude. What reStructuredText would read as markup is escaped, and arguments become a list.
Docstrings with sections of numpydoc are left to numpydoc, but for what is escaped.
"""

import re

LITERAL = re.compile(r"(``.+?``|`[^`\n]+`)")
NAME = r"(?:\\\*){0,2}[a-z][\w.]*(?: \([^()]*\))?"
ARGUMENT = re.compile(rf"({NAME}(?:, {NAME})*): (.*)")
UNDERLINE = re.compile(r"^\s*-{3,}\s*$")
# after these a full stop ends no sentence, which the tables of the reference would believe
SHORT = re.compile(r"\b(Eqs?|Sects?|Figs?)\. ")
HEADING = 30  # letters of the longest line that heads a list of arguments


def escaped(app, what, name, thing, options, lines: list[str]) -> None:
    """Change the lines of a docstring in place."""
    del app, what, name, thing, options
    text = [_without_markup(line) for line in lines]
    if not any(UNDERLINE.match(line) for line in lines):
        text = [line for part in _paragraphs(text) for line in [*_paragraph(part), ""]]
    lines[:] = text


def _without_markup(line: str) -> str:
    """Escape what is markup outside of literals."""
    parts = LITERAL.split(line)
    for k in range(0, len(parts), 2):
        parts[k] = re.sub(r"(?<!\\)([|*])", r"\\\1", parts[k])
        parts[k] = re.sub(r"(\w)_(?=\W|$)", r"\1\\_", parts[k])
        parts[k] = SHORT.sub("\\1.\\\\ \N{NO-BREAK SPACE}", parts[k])
    return "".join(parts)


def _paragraphs(lines: list[str]) -> list[list[str]]:
    """Split a text at its empty lines."""
    found: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            found[-1].append(line)
        else:
            found.append([])
    return [paragraph for paragraph in found if paragraph]


def _paragraph(lines: list[str]) -> list[str]:
    """Return a paragraph as it is, one that is indented literally, or a list of arguments."""
    if any(line.startswith(" ") for line in lines):
        return ["::", "", *(f"   {line}" for line in lines)]
    begins = [k for k in range(len(lines)) if _begins(lines, k)]
    if len(begins) < 2 and begins != [1]:
        return lines
    above = lines[: begins[0]]
    if len(above) == 1 and len(above[0]) < HEADING:
        above = [f"**{above[0]}**"]
    items = [_item(lines[a:b]) for a, b in zip(begins, [*begins[1:], None], strict=True)]
    return [*above, "", *(line for item in items for line in item)]


def _begins(lines: list[str], k: int) -> bool:
    """Tell whether a line begins the description of an argument."""
    if not ARGUMENT.match(lines[k]):
        return False
    before = lines[k - 1] if k else "."
    return before.endswith((".", ";", ")")) or (k == 1 and len(before) < HEADING)


def _item(lines: list[str]) -> list[str]:
    """Return the description of an argument as an item of a list."""
    names, rest = ARGUMENT.match(lines[0]).groups()
    return [f"- **{names}**: {rest}", *(f"  {line}" for line in lines[1:])]
