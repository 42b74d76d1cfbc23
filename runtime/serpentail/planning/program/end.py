"""The goal of a plan as rows at its end (f_bc of Eq. 43)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...optimal.problem import OcpNode
from ..goal import Goal, middle, room
from .cache import memoised
from .nodes import FlightDynamics, NodeTerms, no_rates, terms_with

if TYPE_CHECKING:
    pass

NUMBERS = (("numbers", 12),)  # of the matrix of ``goal_matrix``, row by row
LEAST_ROOM = 1e-6  # an interior point needs some; a narrower range is its middle
GOALS = ("tail", "tail_rate", "torso_rate")


@dataclass(frozen=True, eq=False)
class EndRows:
    """A node at the end, the values of its rows, and how far each may be off."""

    node: OcpNode
    values: np.ndarray
    room: np.ndarray


def goal_matrix(goal: Any) -> np.ndarray:
    """Rows (.., 4) of the quaternion at the end that are zero, of f_bc in Eq. 43."""
    if goal is None:
        return np.zeros((0, 4))
    if isinstance(goal, str):
        return np.eye(4)[1:3]  # x = y = 0: a turn about the vertical
    w, x, y, z = goal  # the vector part of conj(goal) q
    return np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])


def given_entries(goal: Goal, name: str) -> np.ndarray:
    """Return the entries of a part of the state that the goal gives."""
    value = getattr(goal, name)
    return np.zeros(0, int) if value is None else np.flatnonzero(np.isfinite(middle(value)))


def end_rows(flight: FlightDynamics) -> EndRows | None:
    """Return the rows of the goal; None if it asks for nothing."""
    goal, variables = flight.problem.goal, flight.variables
    matrix = goal_matrix(goal.attitude)
    entries = {name: given_entries(goal, name) for name in GOALS}
    rows = len(matrix) + sum(part.size for part in entries.values())
    if rows == 0:
        return None
    key = ("end", *flight.key, len(matrix), *(tuple(part) for part in entries.values()))
    made = memoised(key, lambda: _terms(flight, len(matrix), entries))
    numbers = np.zeros(12)
    numbers[: matrix.size] = matrix.ravel()
    units = [np.ones(len(matrix)), *(variables.units[k][entries[k]] for k in GOALS)]
    asked = {k: getattr(goal, k) for k in GOALS if entries[k].size}
    values = [np.zeros(len(matrix)), *(middle(part)[entries[k]] for k, part in asked.items())]
    rooms = [np.zeros(len(matrix)), *(room(part)[entries[k]] for k, part in asked.items())]
    row_units = np.concatenate(units)
    off = np.concatenate(rooms) / row_units
    node = flight.node(made, row_units, numbers)
    return EndRows(node, np.concatenate(values) / row_units, np.where(off > LEAST_ROOM, off, 0.0))


def _terms(flight: FlightDynamics, rows: int, entries: dict[str, np.ndarray]) -> NodeTerms:
    import casadi as ca

    symbols = flight.symbols(NUMBERS)
    blocks = symbols.blocks
    matrix: ca.SX = ca.reshape(blocks["numbers"], 4, 3).T[:rows, :]
    parts = [ca.mtimes(matrix, blocks["attitude"])]
    parts += [blocks[name][part.tolist()] for name, part in entries.items() if part.size]
    return terms_with(symbols, parts, no_rates(flight.variables, flight.compiled), ca.SX(0))
