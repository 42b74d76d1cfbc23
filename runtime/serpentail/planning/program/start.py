"""The start of a plan where parts of it, or parameters of the model, are free.

What flight conserves then follows from the start: rows there tie the conserved quantities, which
are constants of the program, to the parts of the start that are given, or keep free parts within
their ranges.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...optimal.problem import OcpNode
from ..free_start import part_of
from .cache import memoised
from .coordinates import rotated
from .nodes import FlightDynamics, NodeTerms, no_rates, terms_with
from .point import asked, center_of_mass_offset, drift_of

if TYPE_CHECKING:
    import casadi as ca

    from ..problem import PlanningProblem
    from .nodes import NodeSymbols

PARTS = ("attitude", "tail", "tail_rate", "torso_rate", "position", "velocity")
ROW_UNITS = {"attitude": 1.0, "tail": 1.0, "tail_rate": 10.0, "torso_rate": 10.0}


@dataclass(frozen=True, eq=False)
class StartRows:
    """A node at the start, values of its equalities, and limits (2, n) of its other rows."""

    node: OcpNode
    values: np.ndarray
    limits: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def start_rows(flight: FlightDynamics) -> StartRows | None:
    """Return the rows at the start; None if it is known."""
    problem, variables = flight.problem, flight.variables
    if not problem.is_free and not variables.torque_is_state:
        return None
    parts = _parts(flight)
    given = {name: _given(problem, name) for name in parts}
    fixed = {name: least == most for name, (least, most) in given.items()}
    ranged = tuple(tuple(np.flatnonzero(~fixed[name])) for name in parts)
    key = (
        "start",
        *flight.key,
        tuple(parts),
        ranged,
        problem.rows,
        "attitude" in problem.free_start,
    )
    made: NodeTerms = memoised(key, lambda: _terms(flight, fixed))
    row_unit = ROW_UNITS | {name: abs(x) or 1.0 for name, x in _totals(problem).items()}
    units = [np.full(len(least), row_unit.get(name, 1.0)) for name, (least, _) in given.items()]
    equal = np.concatenate([u[fixed[name]] for u, name in zip(units, parts, strict=True)])
    open_units = np.concatenate([u[~fixed[name]] for u, name in zip(units, parts, strict=True)])
    rest = made.rows - equal.size - open_units.size
    row_units = np.concatenate([equal, open_units, np.ones(rest)])
    limits = np.column_stack([np.array(given[name])[:, ~fixed[name]] for name in parts])
    paths = _path_limits(problem, made.entries[2:])
    values = np.concatenate([given[name][0][fixed[name]] for name in parts])
    node = flight.node(made, row_units, np.zeros(0))
    return StartRows(node, values / equal, np.column_stack([limits / open_units, paths]))


def _parts(flight: FlightDynamics) -> list[str]:
    """Return the parts of the start that have rows."""
    problem, names = flight.problem, []
    if problem.free_start or flight.variables.torque_is_state:
        names += ["attitude", "tail", "tail_rate"]
    if problem.is_free:
        names.append("torso_rate")
    if "com" in dict(flight.variables.constants):
        names += ["position", "velocity"]
    return [*names, *_totals(problem)]


def _totals(problem: "PlanningProblem") -> dict[str, float]:
    """Return the sums that numbers of the design keep, by the names of their rows."""
    return {f"total of {name}": total for name, total in problem.design.totals.items()}


def _given(problem: "PlanningProblem", name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return least and most of a part: equal where it is given."""
    if name == "attitude":
        if name in problem.free_start:
            least, most = problem.free_start[name]
            return np.append(1.0, least), np.append(1.0, most)
        return problem.q0[3:7], problem.q0[3:7]
    if name in (totals := _totals(problem)):
        return np.array([totals[name]]), np.array([totals[name]])
    value = part_of((problem.q0, problem.v0), name)
    return problem.free_start.get(name, (value, value))


def _terms(flight: FlightDynamics, fixed: dict[str, np.ndarray]) -> NodeTerms:
    """Return terms whose rows are what is given, what has a range, and path constraints."""
    import casadi as ca

    symbols = flight.symbols()
    rows = _expressions(flight, symbols)
    point = symbols.point(flight.problem)
    equal, ranged = (
        ca.vertcat(*(rows[n][k] for n in fixed for k in np.flatnonzero(fixed[n] == own).tolist()))
        for own in (True, False)
    )
    paths = [_at_start(symbols, k, path, point) for k, path in enumerate(flight.problem.rows)]
    parts = [equal, ranged, *(paths if flight.problem.free_start else [])]
    rates = no_rates(flight.variables, flight.compiled)
    return terms_with(symbols, parts, rates, ca.SX(0))


def _expressions(flight: FlightDynamics, symbols: "NodeSymbols") -> dict[str, Any]:
    """Return the parts of the start as they follow from states and constants."""
    import casadi as ca

    blocks, free = symbols.blocks, flight.problem.free_start
    c, body = blocks["attitude"], symbols.body
    found = {name: blocks[name] for name in ("tail", "tail_rate", "torso_rate")}
    found["attitude"] = ca.vertcat(ca.sumsqr(c), angles_of(c)) if "attitude" in free else c
    if "com" in dict(flight.variables.constants):
        found["position"] = blocks["com"] - rotated(c, center_of_mass_offset(body, blocks["tail"]))
        found["velocity"] = blocks["com_velocity"] + rotated(c, drift_of(body, blocks))
    numbers = flight.problem.design.split(blocks.get("design"))
    return found | {f"total of {n}": ca.sum1(numbers[n]) for n in flight.problem.design.totals}


def _at_start(symbols: "NodeSymbols", k: int, path: Any, point: Any) -> "ca.SX":
    """Return a path constraint's entries if they do not depend on torques."""
    import casadi as ca

    values = ca.vec(asked(f"path[{k}]", path[0], point))
    driven = [symbols.blocks[n] for n in ("torque", "tension") if n in symbols.blocks]
    return ca.SX(0, 1) if any(ca.depends_on(values, x) for x in driven) else values


def _path_limits(problem: "PlanningProblem", entries: tuple[int, ...]) -> np.ndarray:
    limits = np.array([row[1:] for row in problem.rows]).reshape(-1, 2).T
    return np.repeat(limits[:, : len(entries)], entries, axis=1)


def angles_of(c: "ca.SX") -> "ca.SX":
    """Return pitch, roll and yaw (rad) of a quaternion, R = Rz(yaw) Rx(pitch) Ry(roll)."""
    import casadi as ca

    R = ca.horzcat(*(rotated(c, ca.SX(ca.DM.eye(3)[:, k])) for k in range(3)))
    return ca.vertcat(ca.asin(R[2, 1]), ca.atan2(-R[2, 0], R[2, 2]), ca.atan2(-R[0, 1], R[1, 1]))
