"""Reports as text: aligned columns of names, values with five digits and units; Markdown tables."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

DECIMALS = 12  # smaller numbers are rounding
WIDEST = 32  # the column of values: long texts, such as reasons, make it no wider
NONE: Mapping[str, Any] = MappingProxyType({})
Row = tuple[str, ...]  # name, value, error, unit


def as_text(
    report: Mapping[str, Any], units: Mapping[str, str] = NONE, errors: Mapping[str, Any] = NONE
) -> str:
    """Return a report as lines of name, value, estimated error if there is one, and unit.

    An entry with parts has one line for each.
    """
    table = []
    for name, value in report.items():
        table += _rows(name, value, units.get(name, ""), errors.get(name))
    widths = [max((len(row[column]) for row in table), default=0) for column in range(3)]
    widths[1] = min(widths[1], WIDEST)
    lines = []
    for name, value, error, unit in table:
        column = f"  {error:<{widths[2]}}" if widths[2] else ""
        lines.append(f"{name:<{widths[0]}}  {value:<{widths[1]}}{column}  {unit}".rstrip())
    return "\n".join(lines)


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


def as_error(error: Any) -> str:
    """Return an estimated error with two digits; nothing for None."""
    if error is None:
        return ""
    each = error if isinstance(error, list) else [error]
    return "+- " + "  ".join(f"{x:.2g}" if isinstance(x, float) else str(x) for x in each)


def _rows(name: str, value: Any, unit: str, error: Any) -> list[Row]:
    """Return the rows of an entry: one, or one for each part of a mapping or text of a list."""
    if isinstance(value, Mapping) and value:
        of = error if isinstance(error, Mapping) else {}
        return [
            (f"{name}, {part}", as_word(each), as_error(of.get(part)), unit)
            for part, each in value.items()
        ]
    if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        return [(name, each, "", "") for each in value]
    return [(name, as_word(value), as_error(error), unit if value is not None else "")]
