"""Reads scene files and tables, checks them and returns a frozen Scene."""

import json
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

from serpentail_scene.keys import CONTACTS, KEYS, KINDS, ONLY, TARGETS, Only, foreign_to
from serpentail_scene.parameters import PARAMETERS, name_in
from serpentail_scene.purposes import functions_of
from serpentail_scene.signatures.table import ALL
from serpentail_scene.source import tables_of
from serpentail_scene.units import in_unit

from .body import OF_TORSO, body_table, scaled_parameters
from .chains import all_parameters, chains_of
from .checks import (
    MOST_LINKS,
    contact_problems,
    contacts_in_order,
    fixed_problems,
    function_problems,
    key_problems,
    kind_problems,
    plain,
    polar_problems,
    segments_in,
    single_problems,
    tail_pieces,
    unknown_keys,
)
from .problems import Problem, SceneError
from .resolve import resolve_parameters
from .scene import Scene
from .segments import are_tables, have_values
from .slope import with_slope
from .tail_tables import tail_description
from .tendons import tendons_of
from .variant import EQUAL

JSON = ("body", "chain", "tendon")  # keys that a Scene has as text


def load_scene(path: str | Path) -> Scene:
    """Read a scene file, named by its stem unless it has a `name`; raises SceneError."""
    path = Path(path)
    try:
        table = tables_of(path)
    except ValueError as error:
        raise SceneError([Problem("scene file", str(path), str(error))]) from error
    return parse_scene(table, path.stem)


def scene_for(tail: str, segments: int, links: int | None = None, **overrides: object) -> Scene:
    """Return the scene of `make model TAIL= M= N=`, with more keys; raises SceneError."""
    table: dict[str, object] = {"kind": tail, "segments": segments}
    size = ""
    if links is not None:  # a continuum has none
        table["links"], size = links, f"_n{links}"
    table |= overrides
    return parse_scene(table, re.sub("[^a-z0-9_]", "_", f"{tail}_m{segments}{size}".lower()))


def parse_scene(table: Mapping[str, Any], name: str) -> Scene:
    """Return the Scene of a table, called `name` unless it has a name; raises SceneError."""
    table, problems = with_slope(table)
    kind = _kind(table)
    rules = ONLY[kind]
    values = _with_defaults(table, name, rules)
    contacts = tuple(values["contacts"]) if CONTACTS.holds(values["contacts"]) else ()
    values["functions"] = functions_of({**table, "contacts": contacts})
    with suppress(ValueError):  # the rule for the key refuses a text
        values["bend_range"] = in_unit(values["bend_range"], "rad")

    # everything that is wrong with keys and functions
    problems += unknown_keys(table, "", KEYS)
    chains = chains_of(values, parse_scene)
    problems += chains.problems
    values |= {"chains": chains.chains, "parameters": chains.parameters}
    ordered, unknown = contacts_in_order(contacts, values["chain"])
    for describe in (tail_description, tendons_of):
        found = describe(kind, values)
        values |= found.values
        problems += found.problems
    problems += [*key_problems(values), *kind_problems(table, kind)]
    problems += function_problems(values["functions"]) + contact_problems(table, values, contacts)
    problems += polar_problems(table, kind, contacts, values["functions"])
    problems += fixed_problems(values, contacts) + unknown

    # the kind and the contacts determine which parameters there are
    links = min(sum(values["shape"].counts) or tail_pieces(values), MOST_LINKS)
    body = body_table(values["body"], values["parameters"])
    named = body.with_torso(values["parameters"], contacts)
    problems += body.problems
    for key in JSON:
        values[key] = json.dumps(values[key], default=str) if values[key] else ""
    try:
        values["parameters"] = resolve_parameters(
            named, links, kind, contacts, values["shape"], segments_in(values)
        )
    except SceneError as error:
        problems += error.problems
    if not problems:
        values["parameters"] = all_parameters(values["parameters"], chains.chains)
        values |= scaled_parameters(body, values["parameters"], chains.chains)
    if not problems and values["real"] == "float":
        problems += single_problems(values["parameters"])
    if problems:
        raise SceneError(problems)

    # one order of names, so that equal scenes are equal
    values["contacts"] = ordered
    values["targets"] = tuple(target for target in TARGETS if target in values["targets"])
    values["functions"] = tuple(function for function in ALL if function in values["functions"])
    return Scene(**{field.name: values[field.name] for field in fields(Scene)})


def _kind(table: Mapping[str, Any]) -> str:
    """Return the kind of tail; a table with a wrong kind is checked as an articulated tail."""
    kind = table.get("kind")
    return kind if isinstance(kind, str) and kind in KINDS else "articulated"


def _with_defaults(table: Mapping[str, Any], name: str, rules: Only) -> dict[str, Any]:
    """Return a table with defaults for missing keys, None for a missing key that is required."""
    values = {name: key.default for name, key in KEYS.items()}
    values |= {"name": name, "coordinates": rules.coordinates[0]}
    values |= dict.fromkeys(rules.required) | {"shape": EQUAL, "tables": ""}
    values |= {"unscaled": None, "size": Scene.size}
    return values | dict(table)


def _computed(scene: Scene) -> set[str]:
    """Return the parameters that follow from other values: an inertia from link_radius, values of
    single pieces from tables.
    """
    tables = json.loads(scene.tables or "{}")
    computed = {"link_inertia"} if "link_radius" in scene.parameters else set()
    if tables and have_values(tables):
        computed |= {p.name for p in PARAMETERS if p.of_pieces and p.tail != "ratio"}
    if any("ratios" in table for table in tables.get("segments", ())):
        computed.add("joint_ratios")
    return computed


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """Return the table from which parse_scene makes this scene again: ready for JSON, floats
    exact.
    """
    # keys that this kind of tail, or a flight, does not have
    foreign = {*foreign_to(scene.kind)[0]}
    foreign |= set() if scene.contacts else {"contacts", "friction"}
    foreign |= {"shape", "tables", "unscaled", "size", "chains", *JSON}  # these follow
    usual = {name: KEYS[name].default for name in ("base", "weightless")}
    foreign |= {name for name, value in usual.items() if getattr(scene, name) == value}
    names = [field.name for field in fields(Scene) if field.name not in foreign]
    table = {name: getattr(scene, name) for name in names}
    tables = json.loads(scene.tables or "{}")
    table |= tables | {key: json.loads(text) for key in JSON if (text := getattr(scene, key))}
    if are_tables(table["segments"]):
        table.pop("links", None)
    table |= {key: list(table[key]) for key in ("functions", "contacts", "targets") if key in table}

    computed = {
        name_in(owner, name) for owner, part in scene.parts.items() for name in _computed(part)
    }
    if "torso" in table.get("body", {}):
        computed |= set(OF_TORSO)
    unscaled = scene.unscaled or scene.parameters
    parameters = {n: plain(value) for n, value in unscaled.items() if n not in computed}
    return table | {"parameters": parameters}
