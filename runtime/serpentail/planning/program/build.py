"""The program of a plan: flight on a mesh from a start to a goal, within bounds."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...model.model import Model
from ...optimal.mesh import TimeMesh
from ...optimal.problem import OptimalProblem
from ...optimal.rules import CollocationRule
from ..air import drift_of_states, in_air
from ..design import refuse_unused
from ..problem import PlanningProblem
from ..result.full_state import com_at_start
from ..tendons import TENSION, of_motors
from .cache import memoised
from .end import end_rows, given_entries
from .nodes import (
    FlightDynamics,
    NodeSymbols,
    NodeTerms,
    is_compiled,
    rates_of,
    symbols_of,
    terms_with,
)
from .objective import cost
from .point import asked
from .start import start_rows
from .variables import Blocks, PlanVariables, variables_of

if TYPE_CHECKING:
    import casadi as ca

SOFTENING: Blocks = (("softening", 1),)
LEAST_ROOM = 1e-6  # between two limits, relative: an interior point needs some


@dataclass(frozen=True, eq=False)
class PlanProgram:
    """A problem on a mesh, as stages, and what its variables mean.

    terms: of the flight's nodes, whose rows are the path constraints.
    """

    model: Model
    problem: PlanningProblem
    variables: PlanVariables
    optimal: OptimalProblem
    terms: NodeTerms
    compiled: bool

    @property
    def mesh(self) -> TimeMesh:
        """Its intervals."""
        return self.optimal.mesh

    @property
    def rule(self) -> CollocationRule:
        """Its collocation rule."""
        return self.optimal.rule

    def each_path(self) -> np.ndarray:
        """Least and most (2, entries) of all entries of the path constraints."""
        return _path_limits(self.problem, self.terms)


def conserved_at(model: Model, start: tuple[np.ndarray, np.ndarray]) -> dict[str, np.ndarray]:
    """Return what a flight from a start conserves: see ``CONSERVED``."""
    com, velocity = com_at_start(model, start)
    return {"momentum": model.momentum(*start)[1], "com": com, "com_velocity": velocity}


def plan_program(
    model: Model,
    problem: PlanningProblem,
    mesh: TimeMesh,
    rule: CollocationRule,
    softening: float,
) -> PlanProgram:
    """Return the program of a problem on a mesh, with the constraints of Eq. 43.

    softening: of its objective, see ``cost``.
    """
    conserved = conserved_at(model, (problem.q0, problem.v0))
    compiled = is_compiled(model, problem)
    falls = problem.is_free and _falls(model, problem, compiled)
    variables = variables_of(model, problem, falls)
    numbers = np.concatenate([*conserved.values()])
    flight = FlightDynamics(model, problem, variables, numbers, compiled)

    # the flight
    terms = _flight_terms(flight)
    node = flight.node(terms, np.ones(terms.rows), np.array([softening]))

    # its start and its end
    at_start, at_end = start_rows(flight), end_rows(flight)
    known = not problem.free_start and not variables.torque_is_state
    bounded, limits, fixed = _bounded(problem, variables)
    least, most = problem.duration
    constants = np.zeros(node.constants)
    constants[-1] = most
    controls = "torque_rate" if variables.torque_is_state else variables.input
    strongest = getattr(problem.bounds, controls)
    if controls == "torque" and strongest is not None:
        strongest = of_motors(model, strongest)
    optimal = OptimalProblem(
        node=node,
        mesh=mesh,
        rule=rule,
        coefficients=coefficients_of(problem, rule),
        start=_start(model, problem) / variables.scale(variables.states) if known else None,
        constants=constants,
        duration_is_free=least < most,
        control_limits=_limits(strongest, variables.units[controls])
        * np.array([[controls != TENSION], [1]]),
        bounded=bounded,
        state_limits=limits,
        constant_limits=with_room(_constant_limits(problem, variables)),
        row_limits=with_room(_path_limits(problem, terms)),
        fixed=fixed,
    )
    if at_start is not None:
        optimal = replace(
            optimal,
            at_start=at_start.node,
            start_equalities=len(at_start.values),
            start_values=at_start.values,
            start_limits=with_room(at_start.limits),
        )
    if at_end is not None:
        optimal = replace(
            optimal, at_end=at_end.node, end_values=at_end.values, end_room=at_end.room
        )
    return PlanProgram(model, problem, variables, optimal, terms, compiled)


def coefficients_of(problem: PlanningProblem, rule: CollocationRule) -> int:
    """Return how many coefficients a control has in a stage: torques are linear in plans of least
    time, and rates of torques have one degree less than these.
    """
    nodes = len(rule.nodes)
    if problem.bounds.torque_rate is not None:
        return max(nodes - 1, 1)
    return min(nodes, 2) if problem.objective == "time" else nodes


def _start(model: Model, problem: PlanningProblem) -> np.ndarray:
    """Return the states at the start, SI."""
    parts = [problem.q0[3:], problem.v0[6:]]
    if in_air(model):
        parts += [x[0] for x in drift_of_states(model, problem.q0[None], problem.v0[None]).values()]
    return np.concatenate(parts)


def _flight_terms(flight: FlightDynamics) -> NodeTerms:
    """Return the terms of the flight's nodes: path constraints and cost."""
    problem, variables = flight.problem, flight.variables
    legs = None if problem.legs is None else tuple(problem.legs.curve.at(0.0)[0])
    key = ("flight", *flight.key, problem.objective, problem.smoothing, problem.rows, legs)

    def make() -> NodeTerms:
        symbols = flight.symbols(SOFTENING)
        parts, own = _parts(symbols, problem, variables)
        rates = _rates(flight, symbols)
        _refuse_unused(variables, symbols, [*parts, own, rates])
        return terms_with(symbols, parts, rates, own)

    units = [tuple(variables.units[name]) for name in ("torque", variables.input)]
    return memoised((*key, *units), make)


def _rates(flight: FlightDynamics, symbols: NodeSymbols) -> "ca.SX":
    import casadi as ca

    if flight.compiled:
        return ca.SX(0, 1)
    return rates_of(symbols, flight.problem, flight.variables)


def _parts(
    symbols: NodeSymbols, problem: PlanningProblem, variables: PlanVariables
) -> "tuple[list[ca.SX], ca.SX]":
    """Return the path constraints and the cost of a node."""
    import casadi as ca

    point = symbols.point(problem)
    rows = [
        ca.vec(asked(f"path[{k}]", function, point))
        for k, (function, _, _) in enumerate(problem.rows)
    ]
    return rows, cost(problem, point, symbols.blocks["softening"], variables)


def _falls(model: Model, problem: PlanningProblem, compiled: bool) -> bool:
    """Tell if path constraints or the cost depend on where the COM is, or how fast it moves."""
    import casadi as ca

    variables = variables_of(model, problem, True)
    symbols = symbols_of(model, variables, compiled, SOFTENING)
    rows, own = _parts(symbols, problem, variables)
    flying = ca.vertcat(symbols.blocks["com"], symbols.blocks["com_velocity"])
    return bool(ca.depends_on(ca.vertcat(*rows, own), flying))


def _refuse_unused(variables: PlanVariables, symbols: NodeSymbols, parts: "list[ca.SX]") -> None:
    """PlanningError if neither the dynamics nor a function of points uses a design's parameter."""
    import casadi as ca

    if not variables.design.size:
        return
    own = symbols.blocks["design"]
    used = [ca.depends_on(ca.vertcat(*parts), own[k]) for k in range(own.numel())]
    refuse_unused(variables.design, np.array(used))


def _path_limits(problem: PlanningProblem, terms: NodeTerms) -> np.ndarray:
    """Return least and most (2, entries) of the entries of path constraints."""
    limits = np.array([row[1:] for row in problem.rows]).reshape(-1, 2).T
    return np.repeat(limits, terms.entries, axis=1)


def _limits(bound: np.ndarray | None, unit: np.ndarray) -> np.ndarray:
    most = np.full(len(unit), np.inf) if bound is None else bound / unit
    return np.array([-most, most])


def _bounded(
    problem: PlanningProblem, variables: PlanVariables
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which states have bounds, these (2, n), and whether the goal gives the state."""
    places, bounds = variables.places(variables.states), problem.bounds
    chosen, limits, fixed = [np.zeros(0, int)], [np.zeros((2, 0))], [np.zeros(0, bool)]
    for name, bound in (
        ("tail", bounds.angle),
        ("tail_rate", bounds.rate),
        ("torque", bounds.torque),
    ):
        if bound is None or name not in places:
            continue
        place, finite = places[name], np.isfinite(bound)
        chosen.append(np.arange(place.start, place.stop)[finite])
        limits.append(_limits(bound, variables.units[name])[:, finite])
        own = np.zeros(len(bound), bool)
        if name != "torque":
            own[given_entries(problem.goal, name)] = True
        fixed.append(own[finite])
    return np.concatenate(chosen), np.concatenate(limits, axis=1), np.concatenate(fixed)


def _constant_limits(problem: PlanningProblem, variables: PlanVariables) -> np.ndarray:
    """Return the limits (2, n) of the constants: design, conserved quantities, duration."""
    sizes = dict(variables.constants)
    conserved = sum(size for name, size in sizes.items() if name not in ("design", "duration"))
    free = np.full((2, conserved), [[-np.inf], [np.inf]])
    design = problem.design
    least, most = problem.duration
    parts: list[Any] = [np.array([design.least, design.most]) / design.units, free]
    if least < most:
        parts.append([[least], [most]])
    return np.concatenate([np.reshape(part, (2, -1)) for part in parts], axis=1)


def with_room(limits: np.ndarray) -> np.ndarray:
    """Return limits (2, n) with room between them where they are equal."""
    least, most = limits
    with np.errstate(invalid="ignore"):
        need = LEAST_ROOM * np.maximum(1.0, np.abs(np.nan_to_num(most, posinf=0, neginf=0)))
        tight = most - least < need
    return np.where(tight, [least - need / 2, most + need / 2], limits)
