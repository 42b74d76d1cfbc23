"""Gives each parameter of a model its value, from those that the scene names."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from serpentail_scene.keys import LIMBS, foreign_to
from serpentail_scene.parameters import (
    AIR,
    NAMES,
    PARAMETERS,
    PASSIVE,
    WIDTHS,
    Parameter,
    Value,
    ellipsoid,
    parts_of,
)
from serpentail_scene.rules import NOT_NEGATIVE
from serpentail_scene.units import in_unit

from .checks import fits, number_problem, plain, unknown_keys
from .cone import single_links
from .problems import Problem, SceneError
from .scene import Parameters
from .segment_tables import flattened
from .segments import RADIUS
from .variant import EQUAL, Shape, Stretch, stretches_of

HAS_NOT = {  # why a tail or a base has no such parameters
    "equal": "each piece of this tail has a value of its own",
    "free": "a fixed base does not move",
    "weight": "gravity_vector or weightless = true replaces it",
    "sloped": "this scene is weightless",
    "tendon": "this tail has no tendons, which tables [tendon.NAME] give",
    "guided": "the guides of all links are alike",
}
MEANINGS = {  # in a mixed tail
    "arc_masses": "mass of each arc",
    "arc_lengths": "length of each arc",
}
OPTIONAL = ("link_centers", "link_inertias")  # defaults of values that single links may leave out


def parameters_of(
    kind: str,
    contacts: Collection[str] = (),
    shape: Shape = EQUAL,
    passive: Collection[str] = (),
    segments: int = 1,
    widths: int = 0,
) -> tuple[Parameter, ...]:
    """Return the parameters of a kind of tail, with those of its contacts and of its passive parts,
    and of the air if there are widths.

    Parameters of single links or arcs have numbers for all links or arcs together.
    """
    foreign = foreign_to(kind)[1]
    present = {"", *contacts, *(["contacts"] if contacts else [])}
    candidates = [p for p in PARAMETERS if p.name not in foreign and p.needs in present]
    counted = [(p, shape.numbers_of(p.tail)) for p in candidates]
    parameters = tuple(replace(p, size=p.size * count) for p, count in counted if count)
    if shape.given:
        parameters = tuple(
            replace(p, rule=NOT_NEGATIVE) if p.name == "link_masses" else p for p in parameters
        )
    if kind == "mixed":
        parameters = tuple(replace(p, meaning=MEANINGS.get(p.name, p.meaning)) for p in parameters)
    air = tuple(
        replace(p, size=p.size or widths) for p in AIR if widths and shape.numbers_of(p.tail)
    )
    coordinates = segments * (1 if kind in LIMBS else 2)
    return parameters + air + passive_parameters(passive, coordinates)


def each_parameter(model: Any) -> Iterator[tuple[Any, Parameter]]:
    """Yield the parameters of a scene, or of the sizes of its model, each with what it describes:
    the torso and the tail, or another chain.
    """
    for owner, part in model.parts.items():
        sizes = part.passive, part.segments, part.widths
        for p in parameters_of(part.kind, part.contacts, part.shape, *sizes):
            if p.of_chain or not owner:
                yield part, p.owned(owner)


def resolve_parameters(
    named: Mapping[str, Any],
    tail_links: int,
    kind: str = "articulated",
    contacts: Collection[str] = (),
    shape: Shape = EQUAL,
    segments: int = 1,
) -> Parameters:
    """Check the named parameters and fill in the others, for N = m n links; raises SceneError."""
    if not isinstance(named, Mapping):
        remedy = "needs to be a table, under a line [parameters]"
        raise SceneError([Problem("parameters", named, remedy)])
    problems = unknown_keys(named, "parameters.", NAMES)
    if "link_inertia" in named and "link_radius" in named:
        remedy = "given together with link_radius, which it overrides; remove one of the two"
        problems.append(Problem("parameters.link_inertia", named["link_inertia"], remedy))
    numbers: dict[str, Any] = {}
    passive = parts_of(named)
    widths = widths_of(named, segments, tail_links // segments, kind, shape)
    problems += missing(named, ("air", *passive))
    parameters = parameters_of(kind, contacts, shape, passive, segments, widths)
    sized = {p.name: p for p in (*PARAMETERS, *AIR, *parameters)}
    for p in [p for p in sized.values() if p.name in named]:
        try:
            numbers[p.name] = of_pieces(p, in_unit(named[p.name], p.unit))
        except ValueError as error:
            problems.append(Problem(f"parameters.{p.name}", named[p.name], str(error)))
            continue
        if p.spread:
            numbers[p.name] = for_all(p, numbers[p.name])
        if not fits(p, numbers[p.name]):
            problems.append(number_problem(p, named[p.name]))
    problems += [] if problems else piece_problems(numbers, shape, foreign_to(kind)[1])
    stretches = stretches_of(segments, tail_links // segments, kind, shape)
    problems += [] if problems else ratio_problems(numbers, stretches)
    problems += missing_widths(named, kind, shape) if widths and not problems else []
    if not problems and "stops" in passive:
        problems += stop_problems(numbers)
    if problems:
        raise SceneError(problems)

    # defaults for what is not named; the link's inertia follows from its radius, or replaces it
    unused = "link_radius" if "link_inertia" in named else "link_inertia"
    values = {p.name: p.default for p in parameters if p.name != unused}
    own = shape.links and kind not in LIMBS
    values |= with_link_defaults(numbers, shape.links) if own else numbers
    floats = {name: _floats(value) for name, value in (values | wide(values, widths)).items()}
    if "link_radius" in floats:
        floats["link_inertia"] = _ellipsoid_inertia(floats, tail_links)
    return Parameters(tuple((name, floats[name]) for name in NAMES if name in floats))


def _ellipsoid_inertia(parameters: Mapping[str, Any], tail_links: int) -> tuple[float, ...]:
    """Return the moments of inertia of one of N equal links."""
    m, L = parameters["tail_mass"] / tail_links, parameters["tail_length"] / tail_links
    across, along, _ = ellipsoid(m, L, parameters["link_radius"])
    if not math.isfinite(across + along):
        remedy = (
            "computed from tail_mass, tail_length and link_radius, but not finite; use kg and m"
        )
        raise SceneError([Problem("parameters.link_inertia", [across, along, across], remedy)])
    return (across, along, across)


def of_pieces(parameter: Parameter, value: Any) -> Any:
    """Return a value of single links or arcs as one array; each may have its own three moments."""
    if not parameter.of_pieces or not isinstance(value, list | tuple):
        return value
    numbers = list(flattened(value))
    return numbers[0] if parameter.size == len(numbers) == 1 else numbers


def piece_problems(
    numbers: Mapping[str, Any], shape: Shape, foreign: Collection[str] = ()
) -> list[Problem]:
    """Return a problem for each missing value of single links or arcs, and for each parameter that
    this tail or base does not have; ``foreign``: those of other kinds.
    """
    problems = []
    for p in (*PARAMETERS, *AIR):
        required = p.default is None and p.tail and p.name not in (*OPTIONAL, *foreign)
        if p.tail in HAS_NOT and not shape.numbers_of(p.tail) and p.name in numbers:
            remedy = f"{HAS_NOT[p.tail]}; remove it"
            problems.append(Problem(f"parameters.{p.name}", plain(numbers[p.name]), remedy))
        elif shape.own and required and shape.numbers_of(p.tail) and p.name not in numbers:
            sized = replace(p, size=p.size * shape.numbers_of(p.tail))
            problems.append(number_problem(sized, None))
    return problems


def with_link_defaults(numbers: Mapping[str, Any], links: int) -> dict[str, Any]:
    """Return the values of single links, with defaults: COM in the middle, inertia of an
    ellipsoid.
    """
    masses, lengths = (tuple(flattened(numbers[name])) for name in ("link_masses", "link_lengths"))
    default = single_links(masses, lengths, tuple(length / 2 for length in lengths), (), RADIUS)
    centers = default.centers if links > 1 else default.centers[0]
    return {"link_centers": centers, "link_inertias": default.inertias, **numbers}


def _floats(value: Any) -> Value:
    """Return checked numbers as floats; + 0.0 turns -0.0 into 0.0."""
    if isinstance(value, list | tuple):
        return tuple(float(x) + 0.0 for x in value)
    return float(value) + 0.0


# ---- the air, and the passive tail ---------------------------------------------------------------


def passive_parameters(passive: Collection[str], size: int) -> tuple[Parameter, ...]:
    """Return the parameters of a tail's passive parts, with one number for each coordinate."""
    return tuple(
        replace(p, size=size, default=(p.default,) * size if isinstance(p.default, float) else None)
        for p in PASSIVE
        if p.needs in passive
    )


def for_all(parameter: Parameter, value: Any) -> Any:
    """Return one number for each coordinate, also if a single number stands for all; of a single
    coordinate it is no list.
    """
    if parameter.size == 1:
        return value[0] if isinstance(value, list | tuple) and len(value) == 1 else value
    alone = isinstance(value, int | float) and not isinstance(value, bool)
    return [value] * parameter.size if alone else value


def widths_of(named: Mapping[str, Any], segments: int, links: int, kind: str, shape: Shape) -> int:
    """Return the number of widths of a tail in the air, one at its root and one for each piece; 0
    without air.
    """
    if not any(p.name in named for p in AIR):
        return 0
    return stretches_of(segments, links, kind, shape)[-1].pieces_before(segments) + 1


def wide(values: Mapping[str, Any], widths: int) -> dict[str, Any]:
    """Return the widths of a tail that names none, which are those of its links."""
    given = not widths or values[WIDTHS] is not None
    return {} if given else {WIDTHS: (2 * values["link_radius"],) * widths}


def missing_widths(named: Mapping[str, Any], kind: str, shape: Shape) -> list[Problem]:
    """Return a problem if a tail in air has neither widths nor a link_radius that gives them."""
    round_ = kind == "articulated" and not shape.own and "link_inertia" not in named
    if round_ or WIDTHS in named:
        return []
    remedy = "has no default, because this tail has no link_radius: give it in m"
    return [Problem(f"parameters.{WIDTHS}", None, remedy)]


def missing(named: Mapping[str, Any], parts: Collection[str]) -> list[Problem]:
    """Return a problem for each parameter that a part needs and the scene does not name."""
    problems = []
    for p in (*AIR, *PASSIVE):
        others = [q.name for q in (*AIR, *PASSIVE) if q.needs == p.needs and q.name in named]
        if p.needs == "stops" and "stop damping" in parts:
            others.append("tail_stop_damping")
        needed = bool(others) and p.default is None and p.name != WIDTHS
        if needed and p.name not in named:
            first = others[0]
            remedy = f"has no default, and {first} needs it: give it in {p.unit}, or remove {first}"
            problems.append(Problem(f"parameters.{p.name}", None, remedy))
    return problems


def stop_problems(numbers: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each coordinate whose stops leave no room between them."""
    ends = (numbers["tail_stop_lower"], numbers["tail_stop_upper"])
    pairs = zip(*(end if isinstance(end, list | tuple) else [end] for end in ends), strict=True)
    return [
        Problem(
            f"parameters.tail_stop_lower[{k}]",
            lower,
            f"needs to be below tail_stop_upper[{k}] = {upper}: stops exclude each other",
        )
        for k, (lower, upper) in enumerate(pairs)
        if not lower < upper
    ]


def ratio_problems(numbers: Mapping[str, Any], stretches: Iterable[Stretch]) -> list[Problem]:
    """Return a problem for each segment that the ratios of its joints would not let bend."""
    ratios, problems = [*flattened(numbers.get("joint_ratios", ()))], []
    remedy = "sum 0 (joint_ratios): the angles of this segment would not bend it"
    each = [(i, run) for run in stretches for i in range(run.first, run.stop) if ratios]
    for i, run in each:
        own = ratios[run.pieces_before(i) : run.pieces_before(i + 1)]
        problems += [Problem(f"segments[{i}].ratios", own, remedy)] if sum(own) == 0 else []
    return problems
