"""Docstrings as reStructuredText: what it would read as markup, such as |tau|, is escaped."""

import re

LITERAL = re.compile(r"(``.+?``|`[^`\n]+`)")
# after these a full stop ends no sentence, which the tables of the reference would believe
SHORT = re.compile(r"\b(Eqs?|Sects?|Figs?)\. ")


def escaped(app, what, name, thing, options, lines: list[str]) -> None:
    """Change the lines of a docstring in place; numpydoc reads its sections afterwards."""
    del app, what, name, thing, options
    lines[:] = [_without_markup(line) for line in lines]


def _without_markup(line: str) -> str:
    """Escape what is markup outside of literals."""
    parts = LITERAL.split(line)
    for k in range(0, len(parts), 2):
        parts[k] = re.sub(r"(?<!\\)([|*])", r"\\\1", parts[k])
        parts[k] = re.sub(r"(\w)_(?=\W|$)", r"\1\\_", parts[k])
        parts[k] = SHORT.sub("\\1.\\\\ \N{NO-BREAK SPACE}", parts[k])
    return "".join(parts)
