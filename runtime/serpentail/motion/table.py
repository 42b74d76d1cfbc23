"""Reports as text: aligned columns of names, values with five digits and units; Markdown tables."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

DECIMALS = 12  # smaller numbers are rounding
WIDEST = 32  # the column of values: long texts, such as reasons, make it no wider
NO_UNITS: Mapping[str, str] = MappingProxyType({})
Row = tuple[str, str, str]  # name, value, unit


def as_text(report: Mapping[str, Any], units: Mapping[str, str] = NO_UNITS) -> str:
    """Return a report as lines of name, value and unit.

    An entry with parts has one line for each.
    """
    table = [row for name, value in report.items() for row in _rows(name, value, units)]
    widths = [max((len(row[column]) for row in table), default=0) for column in (0, 1)]
    widths[1] = min(widths[1], WIDEST)
    lines = (f"{name:<{widths[0]}}  {value:<{widths[1]}}  {unit}" for name, value, unit in table)
    return "\n".join(line.rstrip() for line in lines)


def as_markdown(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table."""
    heads = list(heads)
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def as_word(value: Any) -> str:
    """Return a value for readers: five digits, yes or no, "-" for None."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{round(value, DECIMALS) + 0.0:#.5g}".removesuffix(".")
    if isinstance(value, list | tuple):
        return "  ".join(map(as_word, value)) or "-"
    return str(value)


def _rows(name: str, value: Any, units: Mapping[str, str]) -> list[Row]:
    """Return the rows of an entry: one, or one for each part of a mapping or text of a list."""
    unit = units.get(name, "")
    if isinstance(value, Mapping) and value:
        return [(f"{name}, {part}", as_word(each), unit) for part, each in value.items()]
    if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        return [(name, each, "") for each in value]
    return [(name, as_word(value), unit if value is not None else "")]
