"""Reads the tables `[tendon.NAME]` of a scene: where tendons run, and how strongly they pull."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import cos, pi, sin
from typing import Any

from serpentail_scene.keys import NAME, TENDON, TENDON_COUNTS
from serpentail_scene.rules import COUNT
from serpentail_scene.tendons import names_of_tendons

from .checks import parameters_in, segments_in
from .problems import Problem
from .segment_tables import Numbers, numbers_of
from .tail_tables import TailDescription

EXAMPLE = 'needs a table, such as {offset = "4, 0 mm", tension = "5 N"}'
GUIDES = ("guides", "end_offset", "root")  # keys that only links have
NEEDED = {
    "offset": "2 numbers, x and z of its guides, in m",
    "radius": "a number, in m",
    "count": "a whole number, of the tendons in the ring",
    "tension": "a number, its largest tension, in N",
    "root": "a number, in m, because links or guides differ: of its guide before the mount",
}
MIDDLE = (0.5,)  # of a link: where its guide is


def tendons_of(kind: str, values: Mapping[str, Any]) -> TailDescription:
    """Return what the tables say; parameters that the scene names replace theirs."""
    tables, shape = values["tendon"], values["shape"]
    if not isinstance(tables, Mapping) or not tables:
        return TailDescription({})
    problems = _refused(values, kind)
    found = [(name, _numbers(f"tendon.{name}", name, t, problems)) for name, t in tables.items()]
    guided = bool(shape.own or shape.counts or any({*GUIDES[1:]} & {*own} for _, own in found))
    guided = guided and kind == "articulated"
    for name, own in found:
        problems += _each_problem(f"tendon.{name}", tables[name], own, kind, guided)
        problems += _end_problem(f"tendon.{name}", tables[name], segments_in(values))
    if problems or not isinstance(values["parameters"], Mapping):
        return TailDescription({}, tuple(problems))
    names = names_of_tendons(tables)
    if len({*names}) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        remedy = f"{twice} would be two tendons: give one another name"
        return TailDescription({}, (Problem("tendon", names, remedy),))

    # each tendon of a ring by itself
    each = [one for name, own in found for one in _ring(tables[name], own)]
    m, counts = segments_in(values), [table.get("count", 1) for table in tables.values()]
    ends = [table.get("to", m) for table in tables.values()]
    to = [end for end, count in zip(ends, counts, strict=True) for _ in range(count)]
    given = {
        "tendon_offsets": [own["offset"] for own in each],
        "tendon_limits": [own["tension"] for own in each],
    }
    if kind == "articulated":
        given["tendon_guides"] = [own.get("guides", MIDDLE) for own in each]
    if guided:
        given["tendon_ends"] = [own.get("end_offset", own["offset"]) for own in each]
        given["tendon_roots"] = [own["root"] for own in each]
    shape = replace(shape, tendons=tuple(to), guided=guided)
    return TailDescription({"shape": shape, "parameters": {**given, **values["parameters"]}})


def _numbers(place: str, name: str, table: Any, problems: list[Problem]) -> Numbers:
    """Return the numbers of a table."""
    if not NAME.holds(name):
        problems.append(Problem(place, name, "needs a name of a-z, 0-9 and _"))
    if not isinstance(table, Mapping):
        problems.append(Problem(place, table, EXAMPLE))
        return {}
    wrong = {k: table[k] for k in TENDON_COUNTS if k in table and not COUNT.holds(table[k])}
    problems += [Problem(f"{place}.{k}", x, f"needs {COUNT.text}") for k, x in wrong.items()]
    numbers = {key: value for key, value in table.items() if key not in TENDON_COUNTS}
    return numbers_of(place, numbers, TENDON, 1, problems)


def _each_problem(
    place: str, table: Any, own: Numbers, kind: str, guided: bool
) -> Iterator[Problem]:
    """Yield what is missing or too much in a table."""
    if not isinstance(table, Mapping):
        return
    start = ("count", "radius") if {"count", "radius"} & {*table} else ("offset",)
    for key in (*start, "tension", *(["root"] if guided else [])):
        if key not in table:
            yield Problem(f"{place}.{key}", None, f"needs {NEEDED[key]}")
    if len(start) > 1 and "offset" in table:
        yield Problem(f"{place}.offset", table["offset"], "radius gives it: remove one of the two")
    if own.get("offset") == (0.0, 0.0):
        remedy = "a tendon on the axis of the tail has no lever: give an offset"
        yield Problem(f"{place}.offset", table["offset"], remedy)
    for key in GUIDES if kind == "continuum" else ():
        if key in table:
            remedy = "a tendon of arcs is parallel to their centre line: remove it"
            yield Problem(f"{place}.{key}", table[key], remedy)


def _end_problem(place: str, table: Any, segments: int) -> list[Problem]:
    """Return a problem if a tendon ends beyond the tail."""
    to = table.get("to", 1) if isinstance(table, Mapping) else 1
    if not COUNT.holds(to) or to <= segments:
        return []
    return [Problem(f"{place}.to", to, f"the tail has {segments} segments")]


def _ring(table: Mapping[str, Any], own: Numbers) -> list[Mapping[str, tuple[float, ...]]]:
    """Return the tendons of a table, those of a ring from x towards z."""
    count = table.get("count", 0)
    angles = [2 * pi * k / count for k in range(count)]
    ring = [tuple(own["radius"][0] * way for way in (cos(a), sin(a))) for a in angles]
    return [{**own, "offset": offset} for offset in ring] or [own]


def _refused(values: Mapping[str, Any], kind: str) -> list[Problem]:
    """Return a problem for each entry that a tail with tendons does not have."""
    wrong: dict[str, Any] = {"kind": kind} if kind not in ("articulated", "continuum") else {}
    wrong |= {"coordinates": "polar"} if values["coordinates"] == "polar" else {}
    wrong |= {"chain": None} if values["chain"] else {}
    named = parameters_in(values)
    wrong |= {f"parameters.{n}": named[n] for n in named if n.startswith("motor_")}
    remedy = "does not go with tendons: remove one of the two"
    return [Problem(name, value, remedy) for name, value in wrong.items()]
