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
from .segments import SegmentsDescription, are_tables, describe_segments
from .variant import Shape

PIECES = {p.name: p.tail for p in PARAMETERS if p.of_pieces}


@dataclass(frozen=True)
class TailDescription:
    """Values of the scene that follow from the description, with the shape, and problems."""

    values: Mapping[str, Any]
    problems: tuple[Problem, ...] = ()


def tail_description(kind: str, values: Mapping[str, Any]) -> TailDescription:
    """Return what `segments`, `links`, `taper` and parameters of single pieces say about a tail."""
    segments, taper = values["segments"], values["taper"]
    shape = Shape(fixed=values["base"] == "fixed", weightless=values["weightless"] is True)
    pieces = {"articulated": values["links"], "continuum": values["samples"]}
    if kind == "mixed":
        del pieces["articulated"]  # each table says how many links it has
        shape = replace(shape, kinds=("articulated", "continuum"))
    undescribed = TailDescription({"shape": shape})
    if kind == "mixed" and SEGMENTS.holds(segments) and not are_tables(segments):
        remedy = "needs an array of tables, one for each segment, each with a kind"
        return replace(undescribed, problems=(Problem("segments", segments, remedy),))
    if not SEGMENTS.holds(segments):
        return undescribed  # the rule of this key reports that
    if not are_tables(segments):
        count = pieces[kind]
        if not COUNT.holds(count) or segments * count > MOST_LINKS:
            return undescribed  # a rule of sizes reports that

    named = values["parameters"] if isinstance(values["parameters"], Mapping) else {}
    tail = describe_segments(kind, segments, pieces, taper, named)
    remedy = "follows from `segments` or `taper`; remove one of the two"
    twice = [name for name in tail.parameters if name in named]
    duplicates = [Problem(f"parameters.{name}", named[name], remedy) for name in twice]
    parameters = {**named, **tail.parameters}
    follows: dict[str, Any] = {"segments": len(tail.counts)}
    follows["shape"] = _shape(kind, parameters, tail, shape)
    if kind == "articulated":
        follows["links"] = max(tail.counts)
    if isinstance(values["parameters"], Mapping):
        follows["parameters"] = parameters
    tables = {"segments": segments} if are_tables(segments) else {}
    tables |= {} if taper is None else {"taper": taper}
    problems = (*tail.problems, *duplicates)
    if tables and not problems:
        follows["tables"] = json.dumps(tables, sort_keys=True)
    return TailDescription(follows, problems)


def _shape(
    kind: str, parameters: Collection[str], tail: SegmentsDescription, shape: Shape
) -> Shape:
    """Return the shape of a tail with these parameters and these segments."""
    counts = zip(tail.counts, tail.kinds, strict=True)
    links = sum(count for count, its_kind in counts if its_kind != "continuum")
    arcs, mixed = tail.kinds.count("continuum"), kind == "mixed"
    pieces = {PIECES[name] for name in parameters if name in PIECES}
    return replace(
        shape,
        counts=tail.counts if mixed or len(set(tail.counts)) > 1 else (),
        kinds=tail.kinds if mixed else (),
        links=links if mixed or "link" in pieces else 0,
        arcs=arcs if mixed or "arc" in pieces else 0,
        ratios=links if "ratio" in pieces else 0,
        tilted="mount_angles" in parameters,
        sloped="gravity_vector" in parameters and not shape.weightless,
    )
