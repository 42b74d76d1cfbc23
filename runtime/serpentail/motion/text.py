"""Motions and reports as text: what a REPL shows, aligned columns with units, Markdown tables."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from serpentail_scene.messages import one_line

if TYPE_CHECKING:
    from .trajectory import Trajectory

SI = "SI: s, m, rad, kg, N"
WIDTH = 96  # characters of a line in a REPL
DECIMALS = 12  # smaller numbers are rounding
WIDEST = 32  # the column of values: long texts, such as reasons, make it no wider
NONE: Mapping[str, Any] = MappingProxyType({})
Row = tuple[str, ...]  # name, value, error, unit


def as_text(
    report: Mapping[str, Any], units: Mapping[str, str] = NONE, errors: Mapping[str, Any] = NONE
) -> str:
    """Return a report as lines of name, value, estimated error and unit; one line for each part."""
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


def short_text(motion: "Trajectory") -> str:
    """Return what a REPL shows of a trajectory: at most six lines."""
    first, last = motion.t[[0, -1]]
    moved = motion.model.tail_words() if motion.model else "without its model"
    name = motion.info.get("model", "a tail")
    lines = [
        f"Trajectory of {name}, {moved}: {len(motion.t)} samples, {first:.6g} to {last:.6g} s",
        arrays_of(motion),
        _touched(motion),
        how_made(motion.info),
    ]
    return framed(lines + _ended(motion))


def arrays_of(motion: Any) -> str:
    """Return the shapes of q, v and tau, and the units."""
    shapes = [f"{name} {getattr(motion, name).shape}" for name in ("q", "v", "tau")]
    return f"{', '.join(shapes)}; {SI}"


def how_made(info: dict[str, Any]) -> str:
    """Return how a motion was made, as far as its info says so."""
    if "method" not in info:
        return "planned" if info.get("kind") == "plan" else "by an unknown method"
    counts = [f"{info[name]} {name}" for name in ("steps", "rejected") if name in info]
    return f"by {info['method']}: {', '.join(counts)}"


def framed(lines: list[str]) -> str:
    """Return lines as the text of one object, each cut to the width."""
    return "<" + "\n  ".join(one_line(line, WIDTH) for line in lines) + ">"


def _touched(motion: "Trajectory") -> str:
    """What touches the ground, and how often that changes."""
    if motion.contact is None:
        return "on a fixed base" if motion.layout.fixed else "in flight"
    points = [f"{count} of the {group}" for group, count in motion.contact.groups.items()]
    count = len(motion.info.get("events", []))
    return f"on the ground by points: {', '.join(points)}; {count} events"


def _ended(motion: "Trajectory") -> list[str]:
    """What went wrong."""
    if "failure" in motion.info:
        return [f"failed: {motion.info['failure']}"]
    warnings = motion.info.get("warnings", [])
    return [f"warnings of the run: {len(warnings)}, the first: {warnings[0]}"] if warnings else []
