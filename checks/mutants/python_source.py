"""The mutations of a Python file. Only code that runs is mutated, not docstrings, types or the
words of messages.
"""

import ast
from collections.abc import Iterator

from .mutation import Mutation
from .python_changes import changes, negated

WIDEST = 70  # columns of a change in a report


def mutations(path: str, source: bytes) -> Iterator[Mutation]:
    """Yield every mutation of a file."""
    starts, lines = line_starts(source), source.decode().splitlines()
    for found in running(ast.parse(source)):
        for node, other in [*((found, change) for change in changes(found)), *conditions(found)]:
            before, after = ast.unparse(node), ast.unparse(other)
            placed = after if isinstance(node, ast.stmt) else f"({after})"
            start = starts[node.lineno - 1] + node.col_offset
            end = starts[node.end_lineno - 1] + node.end_col_offset
            change = f"{short(before)} -> {short(after)}"
            text = lines[node.lineno - 1].strip()
            yield Mutation(path, node.lineno, start, end, placed, text, change)


def conditions(node: ast.AST) -> Iterator[tuple[ast.AST, ast.AST]]:
    """Yield a condition and its opposite, unless a changed comparison in it gives the same."""
    if isinstance(node, ast.If) and not isinstance(node.test, ast.Compare | ast.UnaryOp):
        yield node.test, negated(node.test)


def running(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes whose change could change what a program does."""
    yield node
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not telling(node, name, child):
                yield from running(child)


def telling(parent: ast.AST, field: str, child: ast.AST) -> bool:
    """Tell if a part of a node is only information: types, names, decorators, words."""
    if field in {"annotation", "returns", "decorator_list", "bases", "type_params", "format_spec"}:
        return True
    if isinstance(child, ast.JoinedStr | ast.Import | ast.ImportFrom):
        return True
    if isinstance(parent, ast.Raise) or (isinstance(child, ast.Call) and is_error(child)):
        return True
    if isinstance(child, ast.If):
        return ast.unparse(child.test) in {"TYPE_CHECKING", "__name__ == '__main__'"}
    if isinstance(child, ast.keyword):
        return child.arg in {"help", "metavar", "encoding", "strict"}
    return isinstance(child, ast.FunctionDef) and child.name == "__repr__"


def is_error(call: ast.Call) -> bool:
    """Tell if a call makes an exception, whose arguments are words."""
    name = ast.unparse(call.func).split(".")[-1]
    return name.endswith("Error") or name in {"refusal", "refused", "error", "warn"}


def line_starts(source: bytes) -> list[int]:
    """Return where each line begins, in bytes."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    return starts


def short(text: str) -> str:
    """Return a text on one line; if it is long, without its middle."""
    line = " ".join(text.split())
    half = WIDEST // 2
    return line if len(line) <= WIDEST else f"{line[:half]} ... {line[-half:]}"


def with_first(source: bytes, statement: str) -> bytes:
    """Return a module that begins with a statement, on the line where its docstring ends."""
    first, *rest = ast.parse(source).body
    for node in rest:
        if isinstance(node, ast.ImportFrom) and node.module == "__future__":
            first = node
    end = line_starts(source)[first.end_lineno - 1] + first.end_col_offset
    return source[:end] + f"; {statement}".encode() + source[end:]
