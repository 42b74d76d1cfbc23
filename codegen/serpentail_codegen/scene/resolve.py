"""From the parameters that a scene names to a value for each that its model has."""

import math
from collections.abc import Collection, Mapping
from typing import Any

from .checks import fits, number_problem, unknown_keys
from .parameters import PARAMETERS, Parameter, Parameters, Value
from .problems import Problem, SceneError
from .scene import NAMES, ONLY
from .units import in_unit


def parameters_of(kind: str, contacts: Collection[str] = ()) -> tuple[Parameter, ...]:
    """Return the parameters that a kind of tail has, with those of its contacts."""
    foreign = {name for other, only in ONLY.items() if other != kind for name in only.parameters}
    present = {"", *contacts, *(["contacts"] if contacts else [])}
    return tuple(p for p in PARAMETERS if p.name not in foreign and p.needs in present)


def resolve_parameters(
    named: Mapping[str, Any],
    tail_links: int,
    kind: str = "articulated",
    contacts: Collection[str] = (),
) -> Parameters:
    """Check the named parameters and fill in the others, for N = m n links; raises SceneError."""
    if not isinstance(named, Mapping):
        remedy = "needs to be a table, under a line [parameters]"
        raise SceneError([Problem("parameters", named, remedy)])
    problems = unknown_keys(named, "parameters.", NAMES)
    if "link_inertia" in named and "link_radius" in named:
        remedy = "given together with link_radius, which it overrides; remove one of the two"
        problems.append(Problem("parameters.link_inertia", named["link_inertia"], remedy))
    given = {}
    for p in [p for p in PARAMETERS if p.name in named]:
        try:
            given[p.name] = in_unit(named[p.name], p.unit)
        except ValueError as error:
            problems.append(Problem(f"parameters.{p.name}", named[p.name], str(error)))
            continue
        if not fits(p, given[p.name]):
            problems.append(number_problem(p, named[p.name]))
    if problems:
        raise SceneError(problems)

    # defaults for what is not named; the link's inertia follows from its radius, or replaces it
    unused = "link_radius" if "link_inertia" in named else "link_inertia"
    values = {p.name: p.default for p in parameters_of(kind, contacts) if p.name != unused}
    resolved = {name: _floats(value) for name, value in (values | given).items()}
    if "link_radius" in resolved:
        resolved["link_inertia"] = _ellipsoid_inertia(resolved, tail_links)
    return Parameters(tuple((name, resolved[name]) for name in NAMES if name in resolved))


def _ellipsoid_inertia(parameters: Mapping[str, Any], tail_links: int) -> tuple[float, ...]:
    """I = m/5 [L^2/4 + r^2, 2 r^2, L^2/4 + r^2]: uniform ellipsoid, semi-axes (r, L/2, r)."""
    m, L = parameters["tail_mass"] / tail_links, parameters["tail_length"] / tail_links
    r = parameters["link_radius"]
    across, along = m / 5 * (L * L / 4 + r * r), m / 5 * (2 * r * r)
    if not math.isfinite(across + along):
        remedy = (
            "computed from tail_mass, tail_length and link_radius, but not finite; use kg and m"
        )
        raise SceneError([Problem("parameters.link_inertia", [across, along, across], remedy)])
    return (across, along, across)


def _floats(value: Any) -> Value:
    """Return checked numbers as floats; + 0.0 turns -0.0 into 0.0."""
    if isinstance(value, list | tuple):
        return tuple(float(x) + 0.0 for x in value)
    return float(value) + 0.0
