"""Reads the tables `[tendon.NAME]` of a scene: where tendons run, and how strongly they pull."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import cos, pi, sin
from typing import Any

from serpentail_scene.keys import NAME, TENDON, TENDON_COUNTS, names_of_tendons
from serpentail_scene.rules import COUNT

from .checks import MOST_SEGMENTS, parameters_in, segments_in
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
    tables, shape, m = values["tendon"], values["shape"], segments_in(values)
    if not isinstance(tables, Mapping) or not tables:
        return TailDescription({})
    links, problems = kind == "articulated", _refused(values, kind)
    unnamed = "needs a name of a-z, 0-9 and _"
    problems += [Problem(f"tendon.{n}", n, unnamed) for n in tables if not NAME.holds(n)]
    wrong = {n: t for n, t in tables.items() if not isinstance(t, Mapping)}
    problems += [Problem(f"tendon.{n}", t, EXAMPLE) for n, t in wrong.items()]
    tables = {n: t for n, t in tables.items() if n not in wrong}
    found: dict[str, Numbers] = {}
    for name, table in tables.items():
        numbers = {key: value for key, value in table.items() if key not in TENDON_COUNTS}
        found[name] = numbers_of(f"tendon.{name}", numbers, TENDON, 1, problems)
    differ = shape.own or shape.counts or any({*GUIDES[1:]} & {*own} for own in found.values())
    guided = bool(links and differ)
    for name, table in tables.items():
        problems += _problems(f"tendon.{name}", table, found[name], links, guided, m)
    if problems or not isinstance(values["parameters"], Mapping):
        return TailDescription({}, tuple(problems))
    names = names_of_tendons(tables)
    if len({*names}) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        remedy = f"{twice} would be two tendons: give one another name"
        return TailDescription({}, (Problem("tendon", names, remedy),))

    # each tendon of a ring by itself
    each = [one for name, table in tables.items() for one in _ring(table, found[name], m)]
    keys = {"tendon_offsets": "offset", "tendon_limits": "tension"}
    keys |= {"tendon_guides": "guides"} if links else {}
    keys |= {"tendon_ends": "end_offset", "tendon_roots": "root"} if guided else {}
    given = {name: [one[key] for one in each] for name, key in keys.items()}
    shape = replace(shape, tendons=tuple(one["to"] for one in each), guided=guided)
    return TailDescription({"shape": shape, "parameters": {**given, **values["parameters"]}})


def _problems(
    place: str, table: Mapping[str, Any], own: Numbers, links: bool, guided: bool, segments: int
) -> Iterator[Problem]:
    """Yield what is missing, wrong or too much in a table."""
    for key in [key for key in TENDON_COUNTS if not COUNT.holds(table.get(key, 1))]:
        yield Problem(f"{place}.{key}", table[key], f"needs {COUNT.text}")
    start = ("count", "radius") if {"count", "radius"} & {*table} else ("offset",)
    for key in (*start, "tension", *["root"] * guided):
        if key not in table:
            yield Problem(f"{place}.{key}", None, f"needs {NEEDED[key]}")
    for key, most in {"to": segments, "count": MOST_SEGMENTS}.items():
        if COUNT.holds(number := table.get(key, 1)) and number > most:
            yield Problem(f"{place}.{key}", number, f"needs {most} or less")
    remedies = {"offset": "radius gives it: remove one of the two"} if len(start) > 1 else {}
    if own.get("offset") == (0.0, 0.0):
        remedies["offset"] = "a tendon on the axis of the tail has no lever: give an offset"
    if not links:
        parallel = "a tendon of arcs is parallel to their centre line: remove it"
        remedies |= dict.fromkeys(GUIDES, parallel)
    for key in [key for key in remedies if key in table]:
        yield Problem(f"{place}.{key}", table[key], remedies[key])


def _ring(table: Mapping[str, Any], own: Numbers, segments: int) -> Iterator[dict[str, Any]]:
    """Yield what each tendon of a table has, those of a ring from x towards z."""
    count, usual = table.get("count", 0), {"guides": MIDDLE, "to": table.get("to", segments)}
    angles = [2 * pi * k / count for k in range(count)]
    ring = [tuple(own["radius"][0] * way for way in (cos(a), sin(a))) for a in angles]
    for offset in ring or [own["offset"]]:
        yield {"end_offset": offset, **usual, **own, "offset": offset}


def _refused(values: Mapping[str, Any], kind: str) -> list[Problem]:
    """Return a problem for each entry that a tail with tendons does not have."""
    wrong: dict[str, Any] = {"kind": kind} if kind not in ("articulated", "continuum") else {}
    wrong |= {"coordinates": "polar"} if values["coordinates"] == "polar" else {}
    wrong |= {"chain": None} if values["chain"] else {}
    named = parameters_in(values)
    wrong |= {f"parameters.{n}": named[n] for n in named if n.startswith(("motor_", "joint_"))}
    remedy = "does not go with tendons: remove one of the two"
    return [Problem(name, value, remedy) for name, value in wrong.items()]
