"""Reads and checks the tables `segments` and `taper`: the properties of each segment, link
by link.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from serpentail_scene.keys import (
    INERTIAS,
    LENGTHS,
    MASSES,
    OF_ARCS,
    OF_LINKS,
    RATIOS,
    SEGMENT,
    TAPER,
)

from .checks import MOST_LINKS
from .cone import LinkValues, links_of_cone, single_links, volume
from .problems import Problem
from .segment_tables import Numbers, count_of, kind_of, numbers_of, table_of

RADIUS = 0.0029  # m, of links whose inertia no key gives: the radius of the tail in Table 1


@dataclass(frozen=True)
class SegmentsDescription:
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


def have_values(keys: Mapping[str, Any]) -> bool:
    """Tell if the tables `segments` and `taper` give more than the numbers of links."""
    segments: Any = keys.get("segments")
    if "taper" in keys or not are_tables(segments):
        return "taper" in keys
    return not all(set(table) <= {"kind", "links", "ratios"} for table in segments)


def describe_segments(
    kind: str, segments: Any, pieces: Mapping[str, Any], taper: Any, named: Collection[str] = ()
) -> SegmentsDescription:
    """Return what the keys `segments`, `links`, `samples` and `taper` of a scene describe.

    segments: a count, or a table for each segment.
    pieces: numbers of links and of samples of a segment whose table gives none, by kind.
    named: parameters that the scene gives besides.
    """
    problems: list[Problem] = []
    tables = list(segments) if are_tables(segments) else [{} for _ in range(segments)]
    rows = [(f"segments[{k}]", table) for k, table in enumerate(tables)]
    kinds = tuple(kind_of(*row, kind, problems) for row in rows)
    each = list(zip(rows, kinds, strict=True))
    written = [table_of(*row, its_kind, problems) for row, its_kind in each]
    counts = tuple(count_of(*row, its_kind, pieces, problems) for row, its_kind in each)
    if sum(counts) > MOST_LINKS:
        remedy = f"more than {MOST_LINKS} links or samples in all; choose fewer"
        problems.append(Problem("segments", sum(counts), remedy))
    if kind == "mixed" and len(set(kinds)) == 1:
        remedy = f'all segments are of one kind: set kind = "{kinds[0]}" above the tables'
        problems.append(Problem("kind", kind, remedy))
    cone = None if taper is None else numbers_of("taper", taper, TAPER, 1, problems)
    ratios = _ratios(rows, written, counts, kind, problems)
    if problems:
        return SegmentsDescription(counts, kinds, problems=tuple(problems))

    # pieces are equal unless a key describes them; those of a mixed tail never are
    equal = kind != "mixed" or {*OF_LINKS, *OF_ARCS} & set(named)
    if cone is None and not any(written) and equal:
        return SegmentsDescription(counts, kinds, ratios)
    sizes = [n if k == "articulated" else 1 for n, k in zip(counts, kinds, strict=True)]
    places = [place for place, _ in rows]
    values = [
        numbers_of(place, table, SEGMENT, n, problems)
        for place, table, n in zip(places, written, sizes, strict=True)
    ]
    if problems:
        return SegmentsDescription(counts, kinds, problems=tuple(problems))
    if cone is not None:
        problems += _taper_problems(places, values, cone)
        values, cone = _with_shared_length(values, cone) if kind == "mixed" else (values, cone)
    else:
        for place, segment in zip(places, values, strict=True):
            problems += _key_problems(place, segment)
    try:
        if not problems:
            links = _all_links(values, sizes, cone)
            owners = [its_kind for its_kind, n in zip(kinds, sizes, strict=True) for _ in range(n)]
            return SegmentsDescription(counts, kinds, {**_parameters(links, owners), **ratios})
    except (ZeroDivisionError, OverflowError):
        remedy = "gives no finite masses and inertias: use kg and m"
        problems.append(Problem("segments" if cone is None else "taper", segments, remedy))
    return SegmentsDescription(counts, kinds, problems=tuple(problems))


def _ratios(
    rows: list[tuple[str, Any]],
    written: list[dict[str, Any]],
    counts: tuple[int, ...],
    kind: str,
    problems: list[Problem],
) -> Numbers:
    """Take the ratios out of what is written; return those of all joints, 1 where none are, or
    nothing if there are none at all.
    """
    taken = [{"ratios": own.pop("ratios")} if "ratios" in own else {} for own in written]
    found: list[float] = []
    if any(taken) and kind == "mixed":
        problems.append(Problem("segments", kind, "a mixed tail has no ratios: remove them"))
    for (place, _), own, n in zip(rows, taken, counts, strict=True):
        found += numbers_of(place, own, RATIOS, n, problems).get("ratios", (1.0,) * n)
    return {"joint_ratios": tuple(found)} if any(taken) else {}


def _all_links(values: list[Numbers], pieces: list[int], cone: Numbers | None) -> LinkValues:
    """Return the links, or arcs, of all segments."""
    if cone is not None:
        return _links_of_taper(values, pieces, cone)
    links = [_links(segment, n) for segment, n in zip(values, pieces, strict=True)]
    return sum(links[1:], links[0])


def _parameters(pieces: LinkValues, kinds: list[str]) -> dict[str, tuple[float, ...]]:
    """Return the values of all pieces, of these kinds, by the names of parameters."""
    links = [k for k, kind in enumerate(kinds) if kind == "articulated"]
    arcs = [k for k, kind in enumerate(kinds) if kind == "continuum"]
    parameters: dict[str, tuple[float, ...]] = {}
    if links:
        inertias = (pieces.inertias[3 * k : 3 * k + 3] for k in links)
        parameters = {
            "link_masses": tuple(pieces.masses[k] for k in links),
            "link_lengths": tuple(pieces.lengths[k] for k in links),
            "link_centers": tuple(pieces.centers[k] for k in links),
            "link_inertias": tuple(x for moments in inertias for x in moments),
        }
    if arcs:
        parameters["arc_masses"] = tuple(pieces.masses[k] for k in arcs)
        parameters["arc_lengths"] = tuple(pieces.lengths[k] for k in arcs)
    return parameters


# ---- combinations of keys ------------------------------------------------------------------------


def _key_problems(place: str, segment: Mapping[str, Any]) -> list[Problem]:
    """Return problems for the keys that a segment lacks, and for those that say the same twice."""
    problems = []
    for group, needed in ((LENGTHS, "length"), (MASSES, "mass"), (INERTIAS, "")):
        names = [name for name in group if name in segment]
        if not names and needed:
            remedy = f"needs a value, as the segments have values of their own: give {needed}"
            problems.append(Problem(f"{place}.{needed}", None, remedy))
        for name in names[1:]:
            remedy = f"given together with {names[0]}; remove one of the two"
            problems.append(Problem(f"{place}.{name}", segment[name], remedy))
    if "density" in segment and "radii" not in segment:
        remedy = "needs the radii at both ends, such as radii = [0.004, 0.003]"
        problems.append(Problem(f"{place}.density", segment["density"][0], remedy))
    for name in ("link_masses", "link_centers"):
        if "radii" in segment and name in segment:
            remedy = "follows from radii and the mass or density of the segment; remove it"
            problems.append(Problem(f"{place}.{name}", segment[name], remedy))
    return problems


def _taper_problems(places: list[str], values: list[Numbers], taper: Numbers) -> list[Problem]:
    """Return problems for the keys that a taper lacks, and for those that segments may not have
    beside it.
    """
    problems = []
    for place, segment in zip(places, values, strict=True):
        for name in [name for name in segment if name not in LENGTHS]:
            problems.append(
                Problem(f"{place}.{name}", segment[name], "follows from taper; remove it")
            )
    if "radii" not in taper:
        remedy = "needs the radii of root and tip, such as [0.004, 0.001]"
        problems.append(Problem("taper.radii", None, remedy))
    if ("density" in taper) == ("mass" in taper):
        remedy = "needs either a density or the mass of the whole tail"
        problems.append(Problem("taper.density", taper.get("density"), remedy))
    if any("length" in segment and "link_lengths" in segment for segment in values):
        problems.append(Problem("segments", None, "give length or link_lengths of each, not both"))
    with_length = sum(any(name in segment for name in LENGTHS) for segment in values)
    if "length" in taper and with_length:
        remedy = "the segments have lengths of their own; remove it"
        problems.append(Problem("taper.length", taper["length"][0], remedy))
    if "length" not in taper and with_length < len(values):
        remedy = "needs the length of the whole tail, or one of every segment"
        problems.append(Problem("taper.length", None, remedy))
    return problems


# ---- links ---------------------------------------------------------------------------------------


def _lengths(segment: Numbers, pieces: int) -> tuple[float, ...]:
    """Return the lengths of a segment's links."""
    if "link_lengths" in segment:
        return segment["link_lengths"]
    return (segment["length"][0] / pieces,) * pieces


def _links(segment: Numbers, pieces: int) -> LinkValues:
    """Return the links of one segment."""
    lengths = _lengths(segment, pieces)
    if "radii" in segment:
        return _cone(lengths, segment)
    masses = segment.get("link_masses") or (segment["mass"][0] / pieces,) * pieces
    centers = segment.get("link_centers") or tuple(length / 2 for length in lengths)
    inertias = segment.get("link_inertias") or segment.get("link_inertia", ()) * pieces
    radius = segment.get("link_radius", (RADIUS,))[0]
    return single_links(masses, lengths, centers, inertias, radius)


def _cone(lengths: tuple[float, ...], segment: Numbers) -> LinkValues:
    """Return the links of a cone of given density or mass."""
    radii = segment["radii"]
    density = segment.get("density") or (segment["mass"][0] / volume(radii, sum(lengths)),)
    return links_of_cone(lengths, radii, density[0])


def _with_shared_length(values: list[Numbers], taper: Numbers) -> tuple[list[Numbers], Numbers]:
    """Return segments that share a length of the whole tail equally, and the taper without it.

    Otherwise an arc, which is one piece, would get the length of one link.
    """
    if "length" not in taper:
        return values, taper
    rest = {name: numbers for name, numbers in taper.items() if name != "length"}
    return [{"length": (taper["length"][0] / len(values),)} for _ in values], rest


def _links_of_taper(
    values: list[Numbers],
    pieces: list[int],
    taper: Numbers,
) -> LinkValues:
    """Return the links of a whole tail that is one cone; by default links share its length
    equally.
    """
    total = sum(pieces)
    if "length" in taper:
        return _cone((taper["length"][0] / total,) * total, taper)
    lengths = [_lengths(segment, n) for segment, n in zip(values, pieces, strict=True)]
    return _cone(sum(lengths[1:], lengths[0]), taper)
