"""A scene file or table goes in (what to model, with which numbers); a frozen, checked Scene comes out."""

import math
import re
import sys
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from .parameters import ANY, PARAMETERS, SINGLE, Parameter, Parameters, Rule, Value
from .problems import Problem, SceneError, suggest

# fmt: off
KINDS = ("articulated", "continuum")
FUNCTIONS = (
    "mass_matrix", "bias_force", "inverse_dynamics", "forward_dynamics", "forward_dynamics_external",
    "energy", "momentum", "tail_points", "tail_point_jacobians",
    "mass_matrix_world", "bias_force_world", "rollout", "forward_dynamics_derivatives",
)
EXACT = (
    "inverse_dynamics_derivatives", "inverse_dynamics_parameter_derivatives", "forward_dynamics_parameter_derivatives",
    "inverse_dynamics_vjp", "forward_dynamics_jvp", "forward_dynamics_vjp", "inverse_dynamics_hessian",
    "energy_derivatives", "momentum_derivatives",
)
DERIVATIVES = (*EXACT, "forward_dynamics_derivatives")
ON_DEMAND = (*EXACT, "pfl", "implicit")  # emitted where a scene names them
TOUCHING = ("contact_points", "contact_dynamics")  # of scenes with contacts
ALL = (*FUNCTIONS, *ON_DEMAND, *TOUCHING)
GROUPS = ("feet", "tail", "torso")  # of contact points, in their order
FRICTION = ("cone", "box", "smooth", "paper")
# fmt: on
C_HEADERS = frozenset(
    [
        "assert",
        "complex",
        "ctype",
        "errno",
        "features",
        "fenv",
        "float",
        "inttypes",
        "iso646",
        "limits",
        "locale",
        "math",
        "setjmp",
        "signal",
        "stdarg",
        "stdbool",
        "stddef",
        "stdint",
        "stdio",
        "stdlib",
        "string",
        "tgmath",
        "time",
        "wchar",
        "wctype",
    ]
)  # a model of such a name would hide the system's header
MOST_LINKS = 100_000  # segments * links: beyond it a slip, not a tail


def _one_of(names: Sequence[str], remark: str = "") -> Rule:
    """Return the rule that a value is one of these names."""
    text = " or ".join(f'"{name}"' for name in names)
    return Rule(text + remark, lambda x: isinstance(x, str) and x in names)


def _is_whole(x: object) -> bool:
    """Tell if x is an integer; true and false are none."""
    return isinstance(x, int) and not isinstance(x, bool)


FLAG = Rule("true or false, without quotes", lambda x: isinstance(x, bool))
COUNT = Rule("a whole number, 1 or above", lambda x: _is_whole(x) and x >= 1)
TEXT = Rule('a text, in "quotes"', lambda x: isinstance(x, str))
NAME = Rule(
    'a text of a-z, 0-9 and _, a letter first, that names no C header: rename the file, or set name = "..." in it',
    lambda x: isinstance(x, str) and re.fullmatch("[a-z][a-z0-9_]*", x) is not None and x not in C_HEADERS,
)
BEND = Rule(
    "a number of radians above 0 and up to 100",
    lambda x: not isinstance(x, bool) and isinstance(x, int | float) and 0 < x <= 100,
)


CONTACTS = Rule(
    'an array of different names out of "feet", "tail" and "torso", such as ["feet"]',
    lambda x: isinstance(x, list | tuple) and all(n in GROUPS and x.count(n) == 1 for n in x),
)


def _table(name: str) -> Rule:
    """Return the rule that a value is a table."""
    return Rule(f"a table, under a line [{name}]", lambda x: isinstance(x, Mapping))


@dataclass(frozen=True)
class Scene:
    """What to generate: a tail of `segments` x `links`, its parameters, the functions, and in which form."""

    name: str  # prefix of every C symbol and generated file
    kind: str
    segments: int  # m
    links: int  # n, in each segment; 1 for a continuum
    functions: tuple[str, ...]  # in the order of FUNCTIONS
    parameters: Parameters
    coordinates: str = "joint"  # of q_t: joint angles alpha_i, beta_i; "bend": a_i, b_i; "polar": phi_i, theta_i
    samples: int = 5  # tail points in each segment of a continuum
    bend_range: float = 2 * math.pi  # rad, largest bend of a continuum segment
    baked: bool = False  # parameters folded into the code, behind the same ABI
    real: str = "double"
    emission: str = "auto"
    profile: str = "fast"  # or the same bits on every machine
    contacts: tuple[str, ...] = ()  # groups of points that can touch the ground, in the order of GROUPS
    friction: str = "cone"


# The keys of a scene file: default (None: required) and rule; ANY where a function of its own checks.
KEYS: dict[str, tuple[Any, Rule]] = {
    "name": (None, NAME),
    "description": ("", TEXT),
    "kind": (None, _one_of(KINDS)),
    "segments": (None, COUNT),
    "links": (1, COUNT),
    "samples": (Scene.samples, COUNT),
    "bend_range": (Scene.bend_range, BEND),
    "functions": (FUNCTIONS, ANY),
    "parameters": ({}, ANY),
    "coordinates": (Scene.coordinates, ANY),
    "baked": (Scene.baked, FLAG),
    "real": (Scene.real, _one_of(["double", "float"])),
    "emission": (Scene.emission, _one_of(["auto", "straight", "loops", "lanes", "segments"])),
    "profile": (Scene.profile, _one_of(["fast", "reproducible"])),
    "contacts": ((), CONTACTS),
    "friction": (Scene.friction, _one_of(FRICTION)),
    "plan": ({}, _table("plan")),  # a motion to plan, and one to simulate: for the runtime, which checks them
    "simulate": ({}, _table("simulate")),
}
NAMES = tuple(parameter.name for parameter in PARAMETERS)


@dataclass(frozen=True)
class Only:
    """What only one kind of tail has: keys, parameters, and its coordinates, the default first."""

    keys: tuple[str, ...]
    required: tuple[str, ...]
    parameters: tuple[str, ...]
    coordinates: tuple[str, ...]


ONLY = {
    "articulated": Only(("links",), ("links",), ("link_radius", "link_inertia"), ("joint",)),
    "continuum": Only(("samples", "bend_range"), (), (), ("bend", "polar")),
}


def load_scene(path: str | Path) -> Scene:
    """Read a scene file, named by its stem unless it has a `name`; raises SceneError."""
    path = Path(path)
    try:
        table = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        remedy = f"{error.strerror}; give the path of a scene file (.toml)"
    except UnicodeDecodeError as error:
        remedy = f"not UTF-8 from byte {error.start} on; save it as UTF-8 text"
    except (ValueError, RecursionError) as error:  # all that the TOML parser raises, or a NUL in the path
        remedy = f"cannot be read as TOML: {error}"
    else:
        return parse_scene(table, path.stem)
    raise SceneError([Problem("scene file", str(path), remedy)])


def scene_for(tail: str, segments: int, links: int | None = None, **overrides: object) -> Scene:
    """Return the scene of `make model TAIL= M= N=` (no N for a continuum), with more keys; raises SceneError."""
    size = f"_n{links}" if links is not None else ""
    table = {"kind": tail, "segments": segments} | ({"links": links} if size else {}) | overrides
    return parse_scene(table, re.sub("[^a-z0-9_]", "_", f"{tail}_m{segments}{size}".lower()))


def parse_scene(table: Mapping[str, Any], name: str) -> Scene:
    """Return the Scene of a scene file's table, called `name` unless it has a name; raises SceneError."""
    kind = table["kind"] if isinstance(table.get("kind"), str) and table["kind"] in ONLY else "articulated"
    own = ONLY[kind]
    values = {key: default for key, (default, _) in KEYS.items()} | {"name": name, "coordinates": own.coordinates[0]}
    values |= dict.fromkeys(own.required) | dict(table)
    contacts = tuple(values["contacts"]) if CONTACTS.holds(values["contacts"]) else ()
    values["functions"] = _usual_functions(values, contacts, "functions" in table)
    problems = _unknown_keys(table, "", KEYS) + _key_problems(values) + _kind_problems(table, own)
    problems += _function_problems(values["functions"]) + _contact_problems(table, values, contacts)
    values["contacts"] = tuple(group for group in GROUPS if group in contacts)
    try:
        links = min(_tail_links(values), MOST_LINKS)
        values["parameters"] = resolve_parameters(values["parameters"], links, kind, contacts)
    except SceneError as error:
        problems += error.problems
    if not problems and values["real"] == "float":
        problems += _single_problems(values["parameters"])
    if problems:
        raise SceneError(problems)
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
    usual = (*touching, "pfl", "implicit") if contacts else ()  # what simulations on the ground call
    return (*(name for name in FUNCTIONS if not (polar and name in DERIVATIVES)), *usual)


def parameters_of(kind: str, contacts: Collection[str] = ()) -> tuple[Parameter, ...]:
    """Return the parameters that a kind of tail has, with those of its contacts."""
    foreign = {name for other, only in ONLY.items() if other != kind for name in only.parameters}
    present = {"", *contacts, *(["contacts"] if contacts else [])}
    return tuple(p for p in PARAMETERS if p.name not in foreign and p.needs in present)


def resolve_parameters(
    given: Mapping[str, Any], tail_links: int, kind: str = "articulated", contacts: Collection[str] = ()
) -> Parameters:
    """Check the given parameters and fill in the others, for N = m n links; raises SceneError."""
    if not isinstance(given, Mapping):
        raise SceneError([Problem("parameters", given, "needs to be a table, under a line [parameters]")])
    unused = "link_radius" if "link_inertia" in given else "link_inertia"
    values = {p.name: p.default for p in parameters_of(kind, contacts) if p.name != unused} | dict(given)
    problems = _unknown_keys(given, "parameters.", NAMES)
    if "link_inertia" in given and "link_radius" in given:
        remedy = "given together with link_radius, which it overrides; remove one of the two"
        problems.append(Problem("parameters.link_inertia", given["link_inertia"], remedy))
    wrong = [p for p in PARAMETERS if p.name in given and not _fits(p, given[p.name])]
    problems += [_number_problem(p, given[p.name]) for p in wrong]
    if problems:
        raise SceneError(problems)
    resolved = {name: _floats(value) for name, value in values.items()}
    if "link_radius" in resolved:
        resolved["link_inertia"] = _ellipsoid_inertia(resolved, tail_links)
    return Parameters(tuple((name, resolved[name]) for name in NAMES if name in resolved))


def scene_to_dict(scene: Scene) -> dict[str, Any]:
    """Return the table that parse_scene turns into this scene again: ordered, JSON-ready, floats exact."""
    computed = "link_inertia" if "link_radius" in scene.parameters else ""
    given = {name: value for name, value in scene.parameters.items() if name != computed}
    foreign = {key for kind, only in ONLY.items() if kind != scene.kind for key in only.keys}
    foreign |= set() if scene.contacts else {"contacts", "friction"}
    table = {field.name: getattr(scene, field.name) for field in fields(Scene) if field.name not in foreign}
    table |= {key: list(table[key]) for key in ("functions", "contacts") if key in table}
    table["parameters"] = {name: _plain(value) for name, value in given.items()}
    return table


def _ellipsoid_inertia(parameters: Mapping[str, Any], tail_links: int) -> tuple[float, ...]:
    """I = m/5 [L^2/4 + r^2, 2 r^2, L^2/4 + r^2]: uniform ellipsoid of semi-axes (r, L/2, r), long in y."""
    m, L = parameters["tail_mass"] / tail_links, parameters["tail_length"] / tail_links
    r = parameters["link_radius"]
    across, along = m / 5 * (L * L / 4 + r * r), m / 5 * (2 * r * r)
    if not math.isfinite(across + along):
        remedy = "computed from tail_mass, tail_length and link_radius, but not finite; use kg and m"
        raise SceneError([Problem("parameters.link_inertia", [across, along, across], remedy)])
    return (across, along, across)


def _floats(value: Any) -> Value:
    """Return checked numbers as floats; + 0.0 turns -0.0 into 0.0."""
    return tuple(float(x) + 0.0 for x in value) if isinstance(value, list | tuple) else float(value) + 0.0


def _plain(value: Value) -> float | list[float]:
    """Return a value as TOML and JSON have it."""
    return list(value) if isinstance(value, tuple) else value


def _fits(parameter: Parameter, value: Any) -> bool:
    """Tell if a value has the parameter's size, is made of finite numbers, and keeps the parameter's rule."""
    if (parameter.size > 1) != isinstance(value, list | tuple):
        return False
    numbers = value if parameter.size > 1 else [value]
    return len(numbers) == parameter.size and all(map(_is_finite, numbers)) and parameter.check.holds(numbers)


def _is_finite(x: Any) -> bool:
    """Tell if x is a number that a float can hold."""
    return (_is_whole(x) or isinstance(x, float)) and abs(x) <= sys.float_info.max


def _number_problem(parameter: Parameter, value: object) -> Problem:
    """Say what the parameter needs: size, rule, unit and default."""
    shape = "a finite number" if parameter.size == 1 else f"an array of {parameter.size} finite numbers"
    default = "computed" if parameter.default is None else _plain(parameter.default)
    remedy = f"needs {shape}{parameter.check.text}, in {parameter.unit} (default: {default})"
    return Problem(f"parameters.{parameter.name}", value, remedy)


def _key_problems(values: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each key whose rule is broken, and for a tail of too many links."""
    broken = [(key, rule) for key, (_, rule) in KEYS.items() if not rule.holds(values[key])]
    problems = [Problem(key, values[key], f"needs {rule.text}") for key, rule in broken]
    if _tail_links(values) > MOST_LINKS:
        remedy = f"more than {MOST_LINKS} links in all; choose fewer segments or links"
        problems.append(Problem("segments * links", _tail_links(values), remedy))
    return problems


def _kind_problems(table: Mapping[str, Any], own: Only) -> list[Problem]:
    """Return a problem for all that the tail's kind does not have."""
    problems, given = [], table.get("parameters", {})
    for only in (only for only in ONLY.values() if only is not own):
        remedy = "this kind of tail has none; remove it, or choose another kind"
        problems += [Problem(key, table[key], remedy) for key in only.keys if key in table]
        wrong = [key for key in only.parameters if isinstance(given, Mapping) and key in given]
        problems += [Problem(f"parameters.{key}", given[key], remedy) for key in wrong]
    if table.get("coordinates", own.coordinates[0]) not in own.coordinates:
        choices = " or ".join(f'"{name}"' for name in own.coordinates)
        remedy = f"needs {choices}; polar angles are singular at theta = 0, convert states"
        problems.append(Problem("coordinates", table["coordinates"], remedy))
    elif table.get("coordinates") == "polar" and (wanted := _derivatives_in(table.get("functions"))):
        remedy = f'has no derivatives, such as {wanted[0]}: use "bend", which has'
        problems.append(Problem("coordinates", "polar", remedy))
    return problems


def _contact_problems(table: Mapping[str, Any], values: Mapping[str, Any], contacts: Collection[str]) -> list[Problem]:
    """Return a problem for all that needs contacts which the scene does not have."""
    problems, given = [], table.get("parameters", {})
    needs = {p.name: p.needs for p in PARAMETERS if p.needs and p.needs not in contacts}
    needs = {name: group for name, group in needs.items() if group != "contacts" or not contacts}
    for name in [name for name in needs if isinstance(given, Mapping) and name in given]:
        group = "feet" if needs[name] == "contacts" else needs[name]
        remedy = f'nothing touches the ground by it; add "{group}" to `contacts`, or remove it'
        problems.append(Problem(f"parameters.{name}", given[name], remedy))
    if contacts and values["coordinates"] == "polar":
        remedy = 'polar coordinates have no contacts: use "bend"'
        problems.append(Problem("contacts", list(contacts), remedy))
    if contacts:
        return problems
    remedy = 'needs points that touch the ground: add contacts = ["feet"]'
    if "friction" in table:
        problems.append(Problem("friction", table["friction"], remedy))
    wanted = values["functions"] if isinstance(values["functions"], list | tuple) else ()
    return problems + [Problem("functions", name, remedy) for name in wanted if name in TOUCHING]


def _derivatives_in(wanted: Any) -> list[str]:
    """Return the derivatives among wanted functions."""
    names = ALL if wanted == "all" else wanted if isinstance(wanted, list | tuple) else ()
    return [name for name in names if name in DERIVATIVES]


def _single_problems(parameters: Mapping[str, Value]) -> list[Problem]:
    """Return a problem for each parameter that single precision cannot hold."""
    flat = {name: value if isinstance(value, tuple) else (value,) for name, value in parameters.items()}
    wrong = [n for n, xs in flat.items() if any(x and not SINGLE[0] <= abs(x) <= SINGLE[1] for x in xs)]
    remedy = 'beyond single precision, 1.2e-38 to 3.4e38; set real = "double"'
    return [Problem(f"parameters.{name}", _plain(parameters[name]), remedy) for name in wrong]


def _tail_links(values: Mapping[str, Any]) -> int:
    """N = m n, or 1 where m or n is wrong."""
    m, n = values["segments"], values["links"]
    return m * n if COUNT.holds(m) and COUNT.holds(n) else 1


def _function_problems(wanted: Any) -> list[Problem]:
    """Return a problem for each entry that is unknown or listed before, or one for what is no array."""
    if not isinstance(wanted, list | tuple) or not wanted:
        remedy = 'needs an array of names, such as ["mass_matrix"]; leave it out for the usual ones, or "all"'
        return [Problem("functions", wanted, remedy)]
    problems = []
    for i, name in enumerate(wanted):
        if name not in ALL:
            problems.append(Problem(f"functions[{i}]", name, f"unknown; {suggest(name, ALL)}"))
        elif name in wanted[:i]:
            problems.append(Problem(f"functions[{i}]", name, "listed before; remove one of the two"))
    return problems


def _unknown_keys(table: Mapping[str, Any], prefix: str, known: Collection[str]) -> list[Problem]:
    """Return a problem for each key that is not known, with its likely place or spelling."""
    elsewhere, place = (KEYS, "above") if prefix else (NAMES, "below")
    problems = []
    for key in [key for key in table if key not in known]:
        hint = f"belongs {place} the line [parameters]" if key in elsewhere else suggest(key, known)
        problems.append(Problem(f"{prefix}{key}", table[key], f"unknown here; {hint}"))
    return problems
