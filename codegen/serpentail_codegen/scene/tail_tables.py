"""How the segments of a scene's tail differ: by tables, or by parameters of single pieces."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from serpentail_scene.keys import SEGMENTS
from serpentail_scene.parameters import PARAMETERS
from serpentail_scene.rules import COUNT

from .checks import MOST_LINKS
from .problems import Problem
from .segments import Described, are_tables, described
from .variant import EQUAL, Shape

OWN = {p.name: p.tail for p in PARAMETERS if p.of_pieces}


@dataclass(frozen=True)
class TailDescribed:
    """Values of the scene that follow from the description, its shape, and problems."""

    values: Mapping[str, Any]
    shape: Shape = EQUAL
    problems: tuple[Problem, ...] = ()


def tail_described(kind: str, values: Mapping[str, Any]) -> TailDescribed:
    """Return what `segments`, `links`, `taper` and parameters of single pieces say about a tail."""
    segments, taper = values["segments"], values["taper"]
    rest = Shape(fixed=values["base"] == "fixed", weightless=values["weightless"] is True)
    pieces = {"articulated": values["links"], "continuum": values["samples"]}
    if kind == "mixed":
        del pieces["articulated"]  # each table has its own
        rest = replace(rest, kinds=("articulated", "continuum"))
    each = pieces.get(kind)
    counted = COUNT.holds(segments) and COUNT.holds(each)
    if kind == "mixed" and SEGMENTS.holds(segments) and not are_tables(segments):
        remedy = "needs an array of tables, one for each segment, each with a kind"
        return TailDescribed({"shape": rest}, rest, (Problem("segments", segments, remedy),))
    if not SEGMENTS.holds(segments) or not (counted or are_tables(segments)):
        return TailDescribed({"shape": rest}, rest)  # the rules of these keys report that
    if not are_tables(segments) and segments * each > MOST_LINKS:
        return TailDescribed({"shape": rest}, rest)  # a rule of sizes reports that

    named = values["parameters"] if isinstance(values["parameters"], Mapping) else {}
    found = described(kind, segments, pieces, taper, named)
    problems = (*found.problems, *_given_twice(named, found))
    shape = _shape(kind, {**named, **found.parameters}, found, rest)
    follows: dict[str, Any] = {"segments": len(found.counts), "shape": shape}
    follows |= {"links": max(found.counts)} if kind == "articulated" else {}
    if isinstance(values["parameters"], Mapping):
        follows["parameters"] = {**named, **found.parameters}
    written = {"segments": segments} if are_tables(segments) else {}
    written |= {} if taper is None else {"taper": taper}
    if written and not problems:
        follows["tables"] = json.dumps(written, sort_keys=True)
    return TailDescribed(follows, shape, problems)


def _given_twice(named: Mapping[str, Any], found: Described) -> list[Problem]:
    """Return a problem for each parameter that tables give, too."""
    remedy = "follows from `segments` or `taper`; remove one of the two"
    return [
        Problem(f"parameters.{name}", named[name], remedy)
        for name in found.parameters
        if name in named
    ]


def _shape(kind: str, named: Collection[str], found: Described, rest: Shape) -> Shape:
    """Return the shape of a tail with these parameters and these segments."""
    links = sum(n for n, own in zip(found.counts, found.kinds, strict=True) if own != "continuum")
    arcs, mixed = found.kinds.count("continuum"), kind == "mixed"
    tails = {OWN[name] for name in named if name in OWN}
    return replace(
        rest,
        counts=found.counts if mixed or len(set(found.counts)) > 1 else (),
        kinds=found.kinds if mixed else (),
        links=links if mixed or "link" in tails else 0,
        arcs=arcs if mixed or "arc" in tails else 0,
        tilted="mount_angles" in named,
    )
