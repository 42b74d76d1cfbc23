"""Reads and checks the tables `segments` and `taper`: the properties of each segment, link
by link.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from serpentail_scene.keys import INERTIAS, LENGTHS, MASSES, OF_ARCS, OF_LINKS, SEGMENT, TAPER

from .checks import MOST_LINKS
from .cone import Links, cut, single, volume
from .problems import Problem
from .segment_tables import Numbers, count_of, kind_of, numbers_of, table_of

RADIUS = 0.0029  # m, of links whose inertia no key gives: the radius of the tail in Table 1


@dataclass(frozen=True)
class Described:
    """What tables describe: the kind of each segment and its number of links or samples, values of
    all links or arcs by the names of parameters, and problems.
    """

    counts: tuple[int, ...]
    kinds: tuple[str, ...]
    parameters: Numbers = field(default_factory=dict)
    problems: tuple[Problem, ...] = ()


def are_tables(segments: Any) -> bool:
    """Tell if segments are described one by one instead of counted."""
    return isinstance(segments, list | tuple)


def tell_values(written: Mapping[str, Any]) -> bool:
    """Tell if the tables `segments` and `taper` give more than the numbers of links."""
    segments: Any = written.get("segments")
    counted = not are_tables(segments)
    return "taper" in written or not (counted or all(set(t) <= {"kind", "links"} for t in segments))


def described(
    kind: str, segments: Any, pieces: Mapping[str, Any], taper: Any, named: Collection[str] = ()
) -> Described:
    """Return what the keys `segments`, `links`, `samples` and `taper` of a scene describe.

    segments: a count, or a table for each segment.
    pieces: numbers of links and of samples of a segment whose table gives none, by kind.
    named: parameters that the scene gives besides.
    """
    problems: list[Problem] = []
    tables = list(segments) if are_tables(segments) else [{} for _ in range(segments)]
    places = [f"segments[{k}]" for k in range(len(tables))]
    each = list(zip(places, tables, strict=True))
    kinds = tuple(kind_of(*entry, kind, problems) for entry in each)
    read = [table_of(*entry, own, problems) for entry, own in zip(each, kinds, strict=True)]
    counts = tuple(
        count_of(*entry, own, pieces, problems) for entry, own in zip(each, kinds, strict=True)
    )
    if sum(counts) > MOST_LINKS:
        remedy = f"more than {MOST_LINKS} links or samples in all; choose fewer"
        problems.append(Problem("segments", sum(counts), remedy))
    if kind == "mixed" and len(set(kinds)) == 1:
        remedy = f'all segments are of one kind: set kind = "{kinds[0]}" above the tables'
        problems.append(Problem("kind", kind, remedy))
    whole = {} if taper is None else numbers_of("taper", taper, TAPER, 1, problems)
    if problems:
        return Described(counts, kinds, problems=tuple(problems))

    # pieces are equal unless a key describes them; those of a mixed tail never are
    if taper is None and not any(read) and (kind != "mixed" or {*OF_LINKS, *OF_ARCS} & set(named)):
        return Described(counts, kinds)
    sizes = [n if own == "articulated" else 1 for n, own in zip(counts, kinds, strict=True)]
    values = [
        numbers_of(place, table, SEGMENT, n, problems)
        for place, table, n in zip(places, read, sizes, strict=True)
    ]
    if problems:
        return Described(counts, kinds, problems=tuple(problems))
    if taper is None:
        for place, given in zip(places, values, strict=True):
            problems += _lacking(place, given)
    else:
        problems += _beside_taper(places, values, whole)
        values, whole = _shared(values, whole) if kind == "mixed" else (values, whole)
    try:
        if not problems:
            made = _all_links(values, sizes, None if taper is None else whole)
            owners = [own for own, n in zip(kinds, sizes, strict=True) for _ in range(n)]
            return Described(counts, kinds, _parameters(made, owners))
    except (ZeroDivisionError, OverflowError):
        remedy = "gives no finite masses and inertias: use kg and m"
        problems.append(Problem("segments" if taper is None else "taper", segments, remedy))
    return Described(counts, kinds, problems=tuple(problems))


def _all_links(values: list[Numbers], pieces: list[int], taper: Numbers | None) -> Links:
    """Return the links, or arcs, of all segments."""
    if taper is not None:
        return _tapered(values, pieces, taper)
    found = [_links(given, n) for given, n in zip(values, pieces, strict=True)]
    return sum(found[1:], found[0])


def _parameters(made: Links, kinds: list[str]) -> dict[str, tuple[float, ...]]:
    """Return the values of all pieces, of these kinds, by the names of parameters."""
    links = [k for k, kind in enumerate(kinds) if kind == "articulated"]
    arcs = [k for k, kind in enumerate(kinds) if kind == "continuum"]
    found: dict[str, tuple[float, ...]] = {}
    if links:
        inertias = (made.inertias[3 * k : 3 * k + 3] for k in links)
        found = {
            "link_masses": tuple(made.masses[k] for k in links),
            "link_lengths": tuple(made.lengths[k] for k in links),
            "link_centers": tuple(made.centers[k] for k in links),
            "link_inertias": tuple(x for moments in inertias for x in moments),
        }
    if arcs:
        found["arc_masses"] = tuple(made.masses[k] for k in arcs)
        found["arc_lengths"] = tuple(made.lengths[k] for k in arcs)
    return found


# ---- combinations of keys ------------------------------------------------------------------------


def _lacking(place: str, given: Mapping[str, Any]) -> list[Problem]:
    """Return problems for the keys that a segment lacks, and for those that say the same twice."""
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
    """Return problems for the keys that a taper lacks, and for those that segments may not have
    beside it.
    """
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
    """Return the links of a cone of given density or mass."""
    density = given.get("density") or (given["mass"][0] / volume(given["radii"], sum(lengths)),)
    return cut(lengths, given["radii"], density[0])


def _shared(values: list[Numbers], taper: Numbers) -> tuple[list[Numbers], Numbers]:
    """Return segments that share a length of the whole tail equally, and the taper without it.

    Otherwise an arc, which is one piece, would get the length of one link.
    """
    if "length" not in taper:
        return values, taper
    rest = {name: given for name, given in taper.items() if name != "length"}
    return [{"length": (taper["length"][0] / len(values),)} for _ in values], rest


def _tapered(
    values: list[Numbers],
    pieces: list[int],
    taper: Numbers,
) -> Links:
    """Return the links of a whole tail that is one cone; by default links share its length
    equally.
    """
    total = sum(pieces)
    if "length" in taper:
        return _cone((taper["length"][0] / total,) * total, taper)
    each = [_lengths(given, n) for given, n in zip(values, pieces, strict=True)]
    return _cone(sum(each[1:], each[0]), taper)
