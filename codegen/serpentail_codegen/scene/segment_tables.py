"""Reads the tables `segments` and `taper` of a scene: keys, counts, numbers with units."""

from collections.abc import Iterable, Mapping
from typing import Any

from serpentail_scene.keys import SEGMENT, Key
from serpentail_scene.rules import COUNT
from serpentail_scene.units import in_unit, words_of

from .checks import MOST_LINKS
from .problems import Problem, suggest

Numbers = Mapping[str, tuple[float, ...]]  # the numbers of a table by key, in SI units
PIECES = {"articulated": "links", "continuum": "samples"}


OF_LINKS = {
    "links",
    "ratios",
    *(name for name in SEGMENT if name.startswith("link_")),
}  # arcs have none


def table_of(place: str, table: Any, kind: str, problems: list[Problem]) -> dict[str, Any]:
    """Return the values of one segment as written, without its kind and its number of links."""
    if not isinstance(table, Mapping):
        problems.append(Problem(place, table, "needs a table, such as {links = 4}"))
        return {}
    jointed = kind == "articulated"
    known = [key for key in ("kind", "links", *SEGMENT) if jointed or key not in OF_LINKS]
    for key in [key for key in table if key not in known]:
        remedy = f"unknown; {suggest(key, known)}"
        if key in OF_LINKS:
            remedy = "an arc has no links: remove it, or choose another kind"
        problems.append(Problem(f"{place}.{key}", table[key], remedy))
    return {key: value for key, value in table.items() if key in SEGMENT}


def kind_of(place: str, table: Any, kind: str, problems: list[Problem]) -> str:
    """Return the kind of one segment: that of the scene, or its own in a mixed tail."""
    segment_kind = table.get("kind") if isinstance(table, Mapping) else None
    if kind == "mixed":
        if segment_kind in ("articulated", "continuum"):
            return str(segment_kind)
        remedy = 'needs "articulated" or "continuum", as the tail is mixed'
        problems.append(Problem(f"{place}.kind", segment_kind, remedy))
        return "articulated"
    if segment_kind is not None and segment_kind != kind:
        remedy = f'this scene is "{kind}": remove it, or set kind = "mixed" above the tables'
        problems.append(Problem(f"{place}.kind", segment_kind, remedy))
    return kind


def count_of(
    place: str, table: Any, kind: str, pieces: Mapping[str, Any], problems: list[Problem]
) -> int:
    """Return the number of links or samples of a segment; the scene's is the default, but not for
    links of a mixed tail.
    """
    has_links = isinstance(table, Mapping) and "links" in table and kind == "articulated"
    count: Any = table["links"] if has_links else pieces.get(kind)
    if COUNT.holds(count) and count <= MOST_LINKS:
        return int(count)
    field = f"{place}.links" if has_links or kind not in pieces else PIECES[kind]
    problems.append(Problem(field, count, f"needs {COUNT.text}, up to {MOST_LINKS}"))
    return 1


def numbers_of(
    place: str, table: Any, keys: Mapping[str, Key], links: int, problems: list[Problem]
) -> Numbers:
    """Return the numbers of a table in SI units; a wrong value becomes a problem."""
    if not isinstance(table, Mapping):
        remedy = "needs a table, such as {length = 0.2, radii = [0.004, 0.001], density = 1000}"
        problems.append(Problem(place, table, remedy))
        return {}
    numbers_by_name = {}
    for name, value in table.items():
        if name not in keys:
            problems.append(Problem(f"{place}.{name}", value, f"unknown; {suggest(name, keys)}"))
            continue
        key = keys[name]
        count = key.size * (links if key.each_link else 1)
        try:
            numbers = tuple(flattened(in_unit(value, key.unit)))
        except ValueError as error:
            problems.append(Problem(f"{place}.{name}", value, str(error)))
            continue
        if len(numbers) == count and key.rule.holds(numbers):
            numbers_by_name[name] = tuple(float(x) + 0.0 for x in numbers)
            continue
        each = f", {key.size} for each of {links} links" if key.each_link else ""
        words = "a finite number" if count == 1 else f"{count} finite numbers{each}"
        words += f", {key.rule.words}" if key.rule.words else ""
        problems.append(Problem(f"{place}.{name}", value, f"needs {words}{words_of(key.unit)}"))
    return numbers_by_name


def flattened(value: Any) -> Iterable[Any]:
    """Yield the entries of arrays in arrays, or the value itself."""
    if isinstance(value, list | tuple):
        for entry in value:
            yield from flattened(entry)
    else:
        yield value
