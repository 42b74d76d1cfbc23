"""The passive tail: springs, damping and stops of its coordinates, if a scene names them.

Their parameters have one number for each tail coordinate; a single number stands for all.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

from .parameters import ANY, NOT_NEGATIVE, POSITIVE, Parameter
from .problems import Problem

PARTS = ("spring", "damping", "stops")  # a scene has a part if it names one of its parameters
PER_COORDINATE = 0  # the number of segments determines the size
# no default: required if a scene has the part
PASSIVE = (
    Parameter(
        "tail_stiffness",
        PER_COORDINATE,
        None,
        "N m/rad",
        NOT_NEGATIVE,
        "stiffness of the springs of the tail coordinates",
        "spring",
    ),
    Parameter(
        "tail_rest",
        PER_COORDINATE,
        0.0,
        "rad",
        ANY,
        "tail coordinates at which the springs are relaxed",
        "spring",
    ),
    Parameter(
        "tail_damping",
        PER_COORDINATE,
        None,
        "N m s",
        NOT_NEGATIVE,
        "passive damping of the tail coordinates",
        "damping",
    ),
    Parameter(
        "tail_stop_lower",
        PER_COORDINATE,
        None,
        "rad",
        ANY,
        "tail coordinates below which stops push back",
        "stops",
    ),
    Parameter(
        "tail_stop_upper",
        PER_COORDINATE,
        None,
        "rad",
        ANY,
        "tail coordinates above which stops push back",
        "stops",
    ),
    Parameter(
        "tail_stop_stiffness",
        PER_COORDINATE,
        None,
        "N m/rad",
        POSITIVE,
        "stiffness of the stops beyond tail_stop_width",
        "stops",
    ),
    Parameter(
        "tail_stop_width",
        PER_COORDINATE,
        0.1,
        "rad",
        POSITIVE,
        "angle beyond a stop over which its stiffness grows from zero to tail_stop_stiffness",
        "stops",
    ),
)
PASSIVE_NAMES = tuple(p.name for p in PASSIVE)


def parts_of(named: Collection[str]) -> tuple[str, ...]:
    """Return the passive parts of which the scene names at least one parameter."""
    present = {p.needs for p in PASSIVE if p.name in named}
    return tuple(part for part in PARTS if part in present)


def passive_parameters(passive: Collection[str], segments: int) -> tuple[Parameter, ...]:
    """Return the parameters of a tail's passive parts, with one number for each coordinate."""
    size = 2 * segments
    return tuple(
        replace(p, size=size, default=(p.default,) * size if isinstance(p.default, float) else None)
        for p in PASSIVE
        if p.needs in passive
    )


def for_all(parameter: Parameter, value: Any) -> Any:
    """Return one number for each coordinate, also if a single number stands for all."""
    alone = isinstance(value, int | float) and not isinstance(value, bool)
    return [value] * parameter.size if alone else value


def lacking_passive(named: Mapping[str, Any], passive: Collection[str]) -> list[Problem]:
    """Return a problem for each parameter that a part needs and the scene does not name."""
    problems = []
    for p in PASSIVE:
        if p.needs in passive and p.default is None and p.name not in named:
            first = next(q.name for q in PASSIVE if q.needs == p.needs and q.name in named)
            remedy = f"has no default, and {first} needs it: give it in {p.unit}, or remove {first}"
            problems.append(Problem(f"parameters.{p.name}", None, remedy))
    return problems


def stop_problems(given: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each coordinate whose stops leave no room between them."""
    pairs = zip(given["tail_stop_lower"], given["tail_stop_upper"], strict=True)
    return [
        Problem(
            f"parameters.tail_stop_lower[{k}]",
            lower,
            f"needs to be below tail_stop_upper[{k}] = {upper}: stops exclude each other",
        )
        for k, (lower, upper) in enumerate(pairs)
        if not lower < upper
    ]
