"""In what the segments of a scene's tail differ: by tables, or by parameters of single pieces."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from .parameters import PARAMETERS
from .problems import Problem
from .scene import COUNT, MOST_LINKS, SEGMENTS
from .segments import Described, are_tables, described
from .shape import EQUAL, Shape

OWN = {p.name: p.tail for p in PARAMETERS if p.tail in ("link", "arc")}


@dataclass(frozen=True)
class TailDescribed:
    """Values of the scene that follow, its shape, and what is wrong."""

    values: Mapping[str, Any]
    shape: Shape = EQUAL
    problems: tuple[Problem, ...] = ()


def tail_described(kind: str, values: Mapping[str, Any]) -> TailDescribed:
    """Return what `segments`, `links`, `taper` and parameters of single pieces say of a tail."""
    segments, taper = values["segments"], values["taper"]
    rest = Shape(fixed=values["base"] == "fixed", weightless=values["weightless"] is True)
    each = values["links" if kind == "articulated" else "samples"]
    counted = COUNT.holds(segments) and COUNT.holds(each)
    if not SEGMENTS.holds(segments) or not (counted or are_tables(segments)):
        return TailDescribed({"shape": rest}, rest)  # the rules of these keys tell
    if not are_tables(segments) and segments * each > MOST_LINKS:
        return TailDescribed({"shape": rest}, rest)  # a rule of sizes tells

    found = described(kind, segments, each, taper)
    named = values["parameters"] if isinstance(values["parameters"], Mapping) else {}
    problems = (*found.problems, *_given_twice(named, found))
    shape = _shape(kind, {**named, **found.parameters}, found.counts, rest)
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
    """Return a problem for each parameter that tables tell, too."""
    remedy = "follows from `segments` or `taper`; remove one of the two"
    return [
        Problem(f"parameters.{name}", named[name], remedy)
        for name in found.parameters
        if name in named
    ]


def _shape(kind: str, named: Collection[str], counts: tuple[int, ...], rest: Shape) -> Shape:
    """Return the shape of a tail with these parameters, and as many links or samples."""
    jointed = kind == "articulated"
    own = any(OWN.get(name) == ("link" if jointed else "arc") for name in named)
    return replace(
        rest,
        counts=counts if len(set(counts)) > 1 else (),
        links=sum(counts) if own and jointed else 0,
        arcs=len(counts) if own and not jointed else 0,
        tilted="mount_angles" in named,
    )
