"""From a scene file or table to a checked, frozen Scene."""

import re
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from .checks import (
    contact_problems,
    function_problems,
    key_problems,
    kind_problems,
    plain,
    single_problems,
    tail_links,
    unknown_keys,
)
from .problems import Problem, SceneError
from .resolve import resolve_parameters
from .scene import (
    ALL,
    CONTACTS,
    DERIVATIVES,
    FUNCTIONS,
    GROUPS,
    KEYS,
    MOST_LINKS,
    ONLY,
    TARGETS,
    TOUCHING,
    Scene,
)


def load_scene(path: str | Path) -> Scene:
    """Read a scene file, named by its stem unless it has a `name`; raises SceneError."""
    path = Path(path)
    try:
        table = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        remedy = f"{error.strerror}; give the path of a scene file (.toml)"
    except UnicodeDecodeError as error:
        remedy = f"not UTF-8 from byte {error.start} on; save it as UTF-8 text"
    except (
        ValueError,
        RecursionError,
    ) as error:  # all that the TOML parser raises, or a NUL in the path
        remedy = f"cannot be read as TOML: {error}"
    else:
        return parse_scene(table, path.stem)
    raise SceneError([Problem("scene file", str(path), remedy)])


def scene_for(tail: str, segments: int, links: int | None = None, **overrides: object) -> Scene:
    """Return the scene of `make model TAIL= M= N=` (no N for a continuum), with more keys; raises
    SceneError.
    """
    size = f"_n{links}" if links is not None else ""
    table = {"kind": tail, "segments": segments} | ({"links": links} if size else {}) | overrides
    return parse_scene(table, re.sub("[^a-z0-9_]", "_", f"{tail}_m{segments}{size}".lower()))


def parse_scene(table: Mapping[str, Any], name: str) -> Scene:
    """Return the Scene of a scene file's table, called `name` unless it has a name; raises
    SceneError.
    """
    kind = (
        table["kind"]
        if isinstance(table.get("kind"), str) and table["kind"] in ONLY
        else "articulated"
    )
    own = ONLY[kind]
    values = {key: default for key, (default, _) in KEYS.items()} | {
        "name": name,
        "coordinates": own.coordinates[0],
    }
    values |= dict.fromkeys(own.required) | dict(table)
    contacts = tuple(values["contacts"]) if CONTACTS.holds(values["contacts"]) else ()
    values["functions"] = _usual_functions(values, contacts, "functions" in table)
    problems = unknown_keys(table, "", KEYS) + key_problems(values) + kind_problems(table, own)
    problems += function_problems(values["functions"]) + contact_problems(table, values, contacts)
    values["contacts"] = tuple(group for group in GROUPS if group in contacts)
    try:
        links = min(tail_links(values), MOST_LINKS)
        values["parameters"] = resolve_parameters(values["parameters"], links, kind, contacts)
    except SceneError as error:
        problems += error.problems
    if not problems and values["real"] == "float":
        problems += single_problems(values["parameters"])
    if problems:
        raise SceneError(problems)
    values["targets"] = tuple(target for target in TARGETS if target in values["targets"])
    values["functions"] = tuple(function for function in ALL if function in values["functions"])
    return Scene(**{field.name: values[field.name] for field in fields(Scene)})


def _usual_functions(values: Mapping[str, Any], contacts: Collection[str], chosen: bool) -> Any:
    """Return the functions that a scene means by "all", or by not choosing any."""
    touching = TOUCHING if contacts else ()
    if values["functions"] == "all":
        return tuple(name for name in ALL if name not in TOUCHING or contacts)
    if chosen:
        return values["functions"]
    polar = values["coordinates"] == "polar"
    usual = (
        (*touching, "pfl", "implicit") if contacts else ()
    )  # what simulations on the ground call
    return (*(name for name in FUNCTIONS if not (polar and name in DERIVATIVES)), *usual)


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """Return the table that parse_scene turns into this scene again: ordered, JSON-ready, floats
    exact.
    """
    computed = "link_inertia" if "link_radius" in scene.parameters else ""
    given = {name: value for name, value in scene.parameters.items() if name != computed}
    foreign = {key for kind, only in ONLY.items() if kind != scene.kind for key in only.keys}
    foreign |= set() if scene.contacts else {"contacts", "friction"}
    table = {
        field.name: getattr(scene, field.name)
        for field in fields(Scene)
        if field.name not in foreign
    }
    table |= {key: list(table[key]) for key in ("functions", "contacts", "targets") if key in table}
    table["parameters"] = {name: plain(value) for name, value in given.items()}
    return table
