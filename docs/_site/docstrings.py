"""Docstrings as reStructuredText: what it would read as markup, such as |tau|, is escaped.

And the signatures above them.
"""

import re

from numpy.typing import ArrayLike
from sphinx.util.typing import stringify_annotation

LITERAL = re.compile(r"(``.+?``|`[^`\n]+`)")
# after these a full stop ends no sentence, which the tables of the reference would believe
SHORT = re.compile(r"\b(Eqs?|Sects?|Figs?)\. ")


LONG = stringify_annotation(ArrayLike, "fully-qualified-except-typing")
NAMES = {LONG: "ArrayLike", LONG.replace(" | str", "", 1): "ArrayLike"}


def shortened(app, what, name, thing, options, signature, returns):
    """Return a signature in which NumPy's union of all that can be an array has its name."""
    del app, what, name, thing, options
    for long, short in NAMES.items():
        signature = signature and signature.replace(long, short)
        returns = returns and returns.replace(long, short)
    return signature, returns


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
