"""Constraints of the unknowns alone: the attitude at the end, and torques between nodes.

Between nodes torques are polynomials. Their coefficients in the Bernstein basis bound them, and the
coefficients of their slopes bound the slopes.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .coordinates import Attitude, attitude
from .indices import Indices, columns_of
from .mesh import Mesh
from .rules import CollocationRule

if TYPE_CHECKING:
    from ..problem import PlanningProblem
    from .node import Variables


@dataclass(frozen=True, eq=False)
class DirectRows:
    """least <= matrix w <= most; of the first rows, the goal's, the values are a call's own."""

    matrix: Any  # SciPy's, sparse
    least: np.ndarray
    most: np.ndarray


def direct_rows(
    problem: "PlanningProblem",
    variables: "Variables",
    indices: Indices,
    mesh: Mesh,
    rule: CollocationRule,
) -> DirectRows:
    """Return the rows of the goal, of torques in guarded intervals, and of their rates."""
    rows = [_goal_rows(problem, variables, indices)]
    if mesh.controls is not None:
        rows.append(_shared_rows(indices, mesh.controls, mesh, rule))
    if problem.objective == "time" and len(rule.nodes) > 2:
        rows.append(_straight_rows(indices, mesh, rule))
    bounds, unit = problem.bounds, variables.units["torque"]
    if bounds.torque is not None and mesh.guarded.any():
        rows.append(_torque_rows(indices, bounds.torque / unit, mesh, rule))
    if bounds.torque_rate is not None:
        rate = bounds.torque_rate / unit
        if len(rule.nodes) > 1:
            rows += [_slope_rows(indices, rate, mesh, rule), _joint_rows(indices, mesh, rule)]
        else:
            rows.append(_step_rows(indices, rate, mesh, rule))
    return DirectRows(
        _stacked([part.matrix for part in rows]).tocoo(),
        np.concatenate([part.least for part in rows]),
        np.concatenate([part.most for part in rows]),
    )


def goal_matrix(goal: Any, coordinates: Attitude) -> np.ndarray:
    """Rows (.., size) of the attitude at the end that are zero, or for "euler" have given values.

    These are of the boundary constraints f_bc of Eq. 43.
    """
    if goal is None:
        return np.zeros((0, coordinates.size))
    if coordinates.kind == "euler":
        return np.eye(3)[: 2 if isinstance(goal, str) else 3]
    if isinstance(goal, str):
        return np.eye(4)[1:3]  # x = y = 0: a turn about the vertical
    w, x, y, z = goal  # the vector part of conj(goal) q
    return np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])


def _goal_rows(problem: "PlanningProblem", variables: "Variables", indices: Indices) -> DirectRows:
    goal = goal_matrix(problem.goal.attitude, attitude(problem.attitude))
    end = columns_of(indices.states, variables.states, "attitude")[-1]
    i, j = np.nonzero(goal)
    zero = np.zeros(len(goal))
    return DirectRows(_sparse(goal[i, j], i, end[j], (len(goal), indices.size)), zero, zero)


def _shared_rows(
    indices: Indices, controls: np.ndarray, mesh: Mesh, rule: CollocationRule
) -> DirectRows:
    """Return torques minus the polynomial continued from the interval before.

    These are zero inside a control interval.
    """
    earlier = np.flatnonzero(np.diff(controls) == 0)
    own = rule.nodes > 0  # the first may be the last of the interval before
    parts = [_of_nodes(indices, earlier[:0], np.eye(len(rule.nodes))[own], rule)]
    for k in earlier:
        ahead = rule.basis(1 + rule.nodes * mesh.widths[k + 1] / mesh.widths[k])
        now = _of_nodes(indices, np.array([k + 1]), np.eye(len(rule.nodes))[own], rule)
        parts.append(now - _of_nodes(indices, np.array([k]), ahead[own], rule))
    return _zero(_stacked(parts))


def _straight_rows(indices: Indices, mesh: Mesh, rule: CollocationRule) -> DirectRows:
    """Return second differences of Bernstein coefficients, zero if torques are straight lines."""
    k = np.arange(mesh.intervals)
    if mesh.controls is not None:  # the first of each control interval; others share its polynomial
        k = np.flatnonzero(np.diff(mesh.controls, prepend=-1))
    return _zero(_of_nodes(indices, k, np.diff(rule.bernstein(), n=2, axis=0), rule))


def _zero(matrix: Any) -> DirectRows:
    """Rows that are zero."""
    return DirectRows(matrix, np.zeros(matrix.shape[0]), np.zeros(matrix.shape[0]))


def _torque_rows(
    indices: Indices, bound: np.ndarray, mesh: Mesh, rule: CollocationRule
) -> DirectRows:
    """Bernstein coefficients of torques within +- bound (2m,), in guarded intervals."""
    chosen = np.flatnonzero(mesh.guarded)
    matrix = _of_nodes(indices, chosen, rule.bernstein(), rule)
    most = np.tile(bound, len(chosen) * len(rule.nodes))
    return DirectRows(matrix, -most, most)


def _slope_rows(
    indices: Indices, rate: np.ndarray, mesh: Mesh, rule: CollocationRule
) -> DirectRows:
    """Those of slopes, d, within +- rate T width: d - r T w <= 0 and -d - r T w <= 0."""
    degree = len(rule.nodes) - 1
    slopes = degree * np.diff(rule.bernstein(), axis=0)
    matrix = _of_nodes(indices, np.arange(mesh.intervals), slopes, rule)
    return _within_rate(matrix, np.kron(np.repeat(mesh.widths, degree), rate))


def _joint_rows(indices: Indices, mesh: Mesh, rule: CollocationRule) -> DirectRows:
    """Return torques at the ends of intervals minus those at the beginning of the next: zero."""
    bernstein, inner = rule.bernstein(), np.arange(mesh.intervals - 1)
    if rule.nodes[0] == 0:  # a node of both
        inner = inner[:0]
    matrix = _of_nodes(indices, inner, bernstein[-1:], rule) - _of_nodes(
        indices, inner + 1, bernstein[:1], rule
    )
    return _zero(matrix)


def _step_rows(indices: Indices, rate: np.ndarray, mesh: Mesh, rule: CollocationRule) -> DirectRows:
    """Steps of torques that are constant in each interval, within +- rate times their distance."""
    later, earlier = indices.controls[1:].ravel(), indices.controls[:-1].ravel()
    row, ones = np.arange(later.size), np.ones(later.size)
    shape = (later.size, indices.size)
    steps = _sparse(ones, row, later, shape) - _sparse(ones, row, earlier, shape)
    apart = np.diff(mesh.points(rule)[indices.first :])
    return _within_rate(steps, np.kron(apart, rate))


def _within_rate(rows: Any, largest: np.ndarray) -> DirectRows:
    """Rows within +- largest times the duration, the first unknown."""
    count, size = rows.shape
    duration = _sparse(largest, np.arange(count), np.zeros(count, int), (count, size))
    free = np.full(2 * count, -np.inf)
    return DirectRows(_stacked([rows - duration, -rows - duration]), free, np.zeros(2 * count))


def _of_nodes(
    indices: Indices, intervals: np.ndarray, weights: np.ndarray, rule: CollocationRule
) -> Any:
    """Rows, interval by interval, of weights (r, K) times the torques at its K nodes."""
    r, K, nu = *weights.shape, indices.controls.shape[1]
    interval, i, j, u = np.meshgrid(
        intervals, np.arange(r), np.arange(K), np.arange(nu), indexing="ij"
    )
    place = np.arange(len(intervals))[:, None, None, None]
    rows = (place * r + i) * nu + u
    columns = indices.controls[interval * rule.steps + j, u]
    values = weights[i, j]
    shape = (len(intervals) * r * nu, indices.size)
    return _sparse(values.ravel(), rows.ravel(), columns.ravel(), shape)


def _stacked(parts: list) -> Any:
    """Rows below each other."""
    from scipy.sparse import vstack

    return vstack(parts)


def _sparse(values: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple) -> Any:
    from scipy.sparse import coo_matrix

    return coo_matrix((values, (rows, columns)), shape)
