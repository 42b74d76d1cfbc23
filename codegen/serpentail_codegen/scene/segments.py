"""The tables of `segments` and `taper`: what each segment is made of, checked, link by link."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from .checks import is_finite
from .cone import Links, cut, single, volume
from .parameters import ANY, NOT_NEGATIVE, POSITIVE, Rule
from .problems import Problem, suggest
from .scene import COUNT, MOST_LINKS
from .units import in_unit

Numbers = Mapping[str, tuple[float, ...]]  # of a table, by its keys, SI
RADIUS = 0.0029  # m, of links whose inertia no key tells: that of Table 1's tail


@dataclass(frozen=True)
class Key:
    """What a key of a table holds: so many numbers in a unit, or so many of each link."""

    unit: str
    rule: Rule
    size: int = 1
    of_links: bool = False


LENGTHS = {"length": Key("m", POSITIVE), "link_lengths": Key("m", POSITIVE, of_links=True)}
MASSES = {
    "mass": Key("kg", POSITIVE),
    "link_masses": Key("kg", POSITIVE, of_links=True),
    "density": Key("kg/m^3", POSITIVE),
}
INERTIAS = {
    "link_radius": Key("m", NOT_NEGATIVE),
    "link_inertia": Key("kg m^2", NOT_NEGATIVE, 3),
    "link_inertias": Key("kg m^2", NOT_NEGATIVE, 3, of_links=True),
    "radii": Key("m", POSITIVE, 2),
}
CENTERS = {"link_centers": Key("m", ANY, of_links=True)}
VALUES = LENGTHS | MASSES | INERTIAS | CENTERS
OF_LINKS = {name for name in VALUES if name.startswith("link_")}  # that no arc has
TAPER = {name: VALUES[name] for name in ("length", "radii", "density", "mass")}


@dataclass(frozen=True)
class Described:
    """What tables say: links, or samples, of each segment, values of all links or arcs by the names
    of parameters, and what is wrong.
    """

    counts: tuple[int, ...]
    parameters: Numbers = field(default_factory=dict)
    problems: tuple[Problem, ...] = ()


def are_tables(segments: Any) -> bool:
    """Tell if segments are described one by one, not counted."""
    return isinstance(segments, list | tuple)


def tell_values(written: Mapping[str, Any]) -> bool:
    """Tell if the tables `segments` and `taper` say more than how many links there are."""
    segments: Any = written.get("segments")
    counted = not are_tables(segments)
    return "taper" in written or not (counted or all(set(t) <= {"links"} for t in segments))


def described(kind: str, segments: Any, links: Any, taper: Any) -> Described:
    """Return what the keys `segments`, `links` (or samples) and `taper` of a scene say.

    segments: how many, or a table for each.
    """
    problems: list[Problem] = []
    jointed = kind == "articulated"
    tables = list(segments) if are_tables(segments) else [{} for _ in range(segments)]
    read = [_table(f"segments[{k}]", t, jointed, problems) for k, t in enumerate(tables)]
    counts = [_count(f"segments[{k}]", t, links, problems) for k, t in enumerate(tables)]
    if sum(counts) > MOST_LINKS:
        remedy = f"more than {MOST_LINKS} links or samples in all; choose fewer"
        problems.append(Problem("segments", sum(counts), remedy))
    whole = {} if taper is None else _numbers("taper", taper, TAPER, 1, problems)
    if problems:
        return Described(tuple(counts), problems=tuple(problems))

    # equal pieces, unless anything says what they are
    if taper is None and not any(read):
        return Described(tuple(counts))
    pieces = [count if jointed else 1 for count in counts]
    places = [f"segments[{k}]" for k in range(len(counts))]
    values = [
        _numbers(place, table, VALUES, n, problems)
        for place, table, n in zip(places, read, pieces, strict=True)
    ]
    if problems:
        return Described(tuple(counts), problems=tuple(problems))
    if taper is None:
        for place, given in zip(places, values, strict=True):
            problems += _lacking(place, given)
    else:
        problems += _beside_taper(places, values, whole)
    try:
        if not problems:
            made = _all_links(values, pieces, None if taper is None else whole)
            return Described(tuple(counts), _parameters(made, jointed))
    except (ZeroDivisionError, OverflowError):
        remedy = "gives no finite masses and inertias: use kg and m"
        problems.append(Problem("segments" if taper is None else "taper", segments, remedy))
    return Described(tuple(counts), problems=tuple(problems))


def _all_links(values: list[Numbers], pieces: list[int], taper: Numbers | None) -> Links:
    """Return the links, or arcs, of all segments."""
    if taper is not None:
        return _tapered(values, pieces, taper)
    found = [_links(given, n) for given, n in zip(values, pieces, strict=True)]
    return sum(found[1:], found[0])


def _parameters(links: Links, jointed: bool) -> dict[str, tuple[float, ...]]:
    """Return the values of all links, or arcs, by the names of parameters."""
    if not jointed:
        return {"arc_masses": links.masses, "arc_lengths": links.lengths}
    return {
        "link_masses": links.masses,
        "link_lengths": links.lengths,
        "link_centers": links.centers,
        "link_inertias": links.inertias,
    }


# ---- reading -------------------------------------------------------------------------------------


def _table(place: str, table: Any, jointed: bool, problems: list[Problem]) -> dict[str, Any]:
    """Return the values of one segment as they are written, without its number of links."""
    if not isinstance(table, Mapping):
        problems.append(Problem(place, table, "needs a table, such as {links = 4}"))
        return {}
    known = [*(["links"] if jointed else []), *(k for k in VALUES if jointed or k not in OF_LINKS)]
    for key in [key for key in table if key not in known]:
        problems.append(Problem(f"{place}.{key}", table[key], f"unknown; {suggest(key, known)}"))
    return {key: value for key, value in table.items() if key in VALUES}


def _count(place: str, table: Any, links: Any, problems: list[Problem]) -> int:
    """Return the number of links of a segment, by default that of the scene."""
    own = isinstance(table, Mapping) and "links" in table
    count = table["links"] if own else links
    if COUNT.holds(count):
        return int(count)
    problems.append(Problem(f"{place}.links" if own else "links", count, f"needs {COUNT.text}"))
    return 1


def _numbers(
    place: str, table: Any, keys: Mapping[str, Key], links: int, problems: list[Problem]
) -> Numbers:
    """Return the numbers of a table, SI; what cannot be becomes a problem."""
    if not isinstance(table, Mapping):
        remedy = "needs a table, such as {length = 0.2, radii = [0.004, 0.001], density = 1000}"
        problems.append(Problem(place, table, remedy))
        return {}
    found = {}
    for name, value in table.items():
        if name not in keys:
            problems.append(Problem(f"{place}.{name}", value, f"unknown; {suggest(name, keys)}"))
            continue
        key = keys[name]
        count = key.size * (links if key.of_links else 1)
        try:
            numbers = tuple(flattened(in_unit(value, key.unit)))
        except ValueError as error:
            problems.append(Problem(f"{place}.{name}", value, str(error)))
            continue
        sound = len(numbers) == count and all(map(is_finite, numbers)) and key.rule.holds(numbers)
        if sound:
            found[name] = tuple(float(x) + 0.0 for x in numbers)
            continue
        each = f", {key.size} for each of {links} links" if key.of_links else ""
        words = "a finite number" if count == 1 else f"{count} finite numbers{each}"
        problems.append(
            Problem(f"{place}.{name}", value, f"needs {words}{key.rule.text}, in {key.unit}")
        )
    return found


def flattened(value: Any) -> Iterable[Any]:
    """Yield the entries of arrays in arrays, or the value itself."""
    if isinstance(value, list | tuple):
        for entry in value:
            yield from flattened(entry)
    else:
        yield value


# ---- what belongs together -----------------------------------------------------------------------


def _lacking(place: str, given: Mapping[str, Any]) -> list[Problem]:
    """Return what a segment lacks, and what it says twice."""
    problems = []
    for group, needed in ((LENGTHS, "length"), (MASSES, "mass"), (INERTIAS, "")):
        names = [name for name in group if name in given]
        if not names and needed:
            remedy = f"needs a value, as the segments have values of their own: give {needed}"
            problems.append(Problem(f"{place}.{needed}", None, remedy))
        for name in names[1:]:
            remedy = f"given together with {names[0]}; remove one of the two"
            problems.append(Problem(f"{place}.{name}", given[name], remedy))
    if "density" in given and "radii" not in given:
        remedy = "needs the radii at both ends, such as radii = [0.004, 0.003]"
        problems.append(Problem(f"{place}.density", given["density"][0], remedy))
    for name in ("link_masses", "link_centers"):
        if "radii" in given and name in given:
            remedy = "follows from radii and the mass or density of the segment; remove it"
            problems.append(Problem(f"{place}.{name}", given[name], remedy))
    return problems


def _beside_taper(places: list[str], values: list[Numbers], taper: Numbers) -> list[Problem]:
    """Return what a taper lacks, and what segments may not say beside it."""
    problems = []
    for place, given in zip(places, values, strict=True):
        for name in [name for name in given if name not in LENGTHS]:
            problems.append(
                Problem(f"{place}.{name}", given[name], "follows from taper; remove it")
            )
    if "radii" not in taper:
        remedy = "needs the radii of root and tip, such as [0.004, 0.001]"
        problems.append(Problem("taper.radii", None, remedy))
    if ("density" in taper) == ("mass" in taper):
        remedy = "needs either a density or the mass of the whole tail"
        problems.append(Problem("taper.density", taper.get("density"), remedy))
    if any("length" in given and "link_lengths" in given for given in values):
        problems.append(Problem("segments", None, "give length or link_lengths of each, not both"))
    with_length = sum(any(name in given for name in LENGTHS) for given in values)
    if "length" in taper and with_length:
        remedy = "the segments have lengths of their own; remove it"
        problems.append(Problem("taper.length", taper["length"][0], remedy))
    if "length" not in taper and with_length < len(values):
        remedy = "needs the length of the whole tail, or one of every segment"
        problems.append(Problem("taper.length", None, remedy))
    return problems


# ---- links ---------------------------------------------------------------------------------------


def _lengths(given: Numbers, pieces: int) -> tuple[float, ...]:
    """Return the lengths of a segment's links."""
    if "link_lengths" in given:
        return given["link_lengths"]
    return (given["length"][0] / pieces,) * pieces


def _links(given: Numbers, pieces: int) -> Links:
    """Return the links of one segment."""
    lengths = _lengths(given, pieces)
    if "radii" in given:
        return _cone(lengths, given)
    masses = given.get("link_masses") or (given["mass"][0] / pieces,) * pieces
    centers = given.get("link_centers") or tuple(length / 2 for length in lengths)
    inertias = given.get("link_inertias") or given.get("link_inertia", ()) * pieces
    radius = given.get("link_radius", (RADIUS,))[0]
    return single(masses, lengths, centers, inertias, radius)


def _cone(lengths: tuple[float, ...], given: Numbers) -> Links:
    """Return the links of a cone of a density, or of a mass."""
    density = given.get("density") or (given["mass"][0] / volume(given["radii"], sum(lengths)),)
    return cut(lengths, given["radii"], density[0])


def _tapered(
    values: list[Numbers],
    pieces: list[int],
    taper: Numbers,
) -> Links:
    """Return the links of a whole tail that is one cone, its length shared equally by default."""
    total = sum(pieces)
    if "length" in taper:
        return _cone((taper["length"][0] / total,) * total, taper)
    each = [_lengths(given, n) for given, n in zip(values, pieces, strict=True)]
    return _cone(sum(each[1:], each[0]), taper)
