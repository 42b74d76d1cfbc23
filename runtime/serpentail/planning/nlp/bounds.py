"""The limits of a nonlinear program: bounds of its unknowns and of its constraints.

They depend on start, duration and magnitudes, which differ between plans of one program.
"""

from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import POSITION

from ...basics.attitude import pitch_roll_yaw
from ..goal import Goal
from ..problem import PlanningProblem
from .coordinates import Attitude
from .direct import goal_matrix
from .indices import columns_of
from .node import Node
from .transcription import Transcription


@dataclass(frozen=True, eq=False)
class Limits:
    """Bounds of w and of g, both in the program's units, named as CasADi names them."""

    lbx: np.ndarray
    ubx: np.ndarray
    lbg: np.ndarray
    ubg: np.ndarray


def limits(nlp: Transcription, start: dict[str, np.ndarray], angles: np.ndarray) -> Limits:
    """Return the limits (Eq. 43) for a start and the guess's Euler angles (3,) at the end.

    start: blocks in SI.
    """
    problem, indices, variables = nlp.problem, nlp.indices, nlp.variables
    lbx, ubx = np.full(indices.size, -np.inf), np.full(indices.size, np.inf)
    lbx[0], ubx[0] = problem.duration
    _bound_motion(nlp, lbx, ubx)
    lbx[indices.states[0]], ubx[indices.states[0]] = _ranges(nlp, variables.states, start)
    lbx[indices.at_start], ubx[indices.at_start] = _ranges(nlp, variables.at_start, start)
    design = variables.design
    chosen = indices.common[: design.size]
    lbx[chosen], ubx[chosen] = design.least / design.units, design.most / design.units
    _fix_end(nlp, lbx, ubx)
    return Limits(lbx, ubx, *_constraint_bounds(nlp, angles))


def _ranges(
    nlp: Transcription, blocks: tuple[tuple[str, int], ...], start: dict[str, np.ndarray]
) -> np.ndarray:
    """Return least and most (2, n), in units, of blocks at the start: ranges if they are free."""
    units, free = nlp.variables.units, nlp.problem.free_start
    parts = [np.zeros((2, 0))]
    for name, _ in blocks:
        parts.append(np.array(free.get(name, (start[name], start[name]))) / units[name])
    return np.concatenate(parts, axis=1)


def _bound_motion(nlp: Transcription, lbx: np.ndarray, ubx: np.ndarray) -> None:
    """Bounds of angles, rates and torques at every point."""
    bounds, indices, variables = nlp.problem.bounds, nlp.indices, nlp.variables
    for name, bound in (("tail", bounds.angle), ("tail_rate", bounds.rate)):
        if bound is not None:
            columns = columns_of(indices.states, variables.states, name)
            lbx[columns], ubx[columns] = (
                -bound / variables.units[name],
                bound / variables.units[name],
            )
    if bounds.torque is not None:
        bound = bounds.torque / variables.units["torque"]
        lbx[indices.controls], ubx[indices.controls] = -bound, bound


def _fix_end(nlp: Transcription, lbx: np.ndarray, ubx: np.ndarray) -> None:
    """Fix tail and rates at the end to the goal."""
    goal, indices, variables = nlp.problem.goal, nlp.indices, nlp.variables
    for name in ("tail", "tail_rate", "torso_rate"):
        value = getattr(goal, name)
        if value is None:
            continue
        if name in dict(variables.states):
            end = columns_of(indices.states, variables.states, name)[-1]
        else:
            end = columns_of(indices.others, variables.algebraic, name)[-1]
        fixed = np.isfinite(value)
        lbx[end[fixed]] = ubx[end[fixed]] = (value / variables.units[name])[fixed]


def _constraint_bounds(nlp: Transcription, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the constraints, in the order of the transcription's rows."""
    problem, indices, node = nlp.problem, nlp.indices, nlp.node
    defects = np.zeros((len(indices.states) - 1) * indices.states.shape[1])
    one_node = np.column_stack([np.zeros((2, node.residuals)), _path(problem, node)])
    at_nodes = np.tile(one_node, len(indices.others))
    goal = _goal_values(problem.goal, nlp.attitude, angles)
    least, most = nlp.direct.least.copy(), nlp.direct.most.copy()
    least[: len(goal)] = most[: len(goal)] = goal
    at_start = _at_start(nlp)
    return (
        np.concatenate([defects, at_nodes[0], least, at_start[0]]),
        np.concatenate([defects, at_nodes[1], most, at_start[1]]),
    )


def _at_start(nlp: Transcription) -> np.ndarray:
    """Bounds (2, rows) of the rows at the start; path constraints there hold at a first node."""
    rows = nlp.node.start
    if rows is None:
        return np.zeros((2, 0))
    paths = np.array([row[1:] for row in nlp.problem.path]).reshape(-1, 2).T[:, rows.paths]
    if nlp.indices.first == 0:
        paths = np.repeat([[-np.inf], [np.inf]], len(rows.paths), axis=1)
    return np.concatenate([np.zeros((2, rows.zeros)), paths], axis=1)


def _path(problem: PlanningProblem, node: Node) -> np.ndarray:
    """Bounds (2, path) of path constraints, one pair for all entries of one function."""
    limits = np.array([row[1:] for row in problem.path]).reshape(-1, 2)
    return node.each_path(limits.T)


def _goal_values(goal: Goal, coordinates: Attitude, angles: np.ndarray) -> np.ndarray:
    """Values of the goal's rows of the attitude: zero, or Euler angles nearest to the guess's."""
    rows = len(goal_matrix(goal.attitude, coordinates))
    if coordinates.kind == "quaternion" or not rows:
        return np.zeros(rows)
    if isinstance(goal.attitude, str):
        turns = np.round(angles[:2] / (2 * np.pi)) if goal.turns is None else goal.turns
        return 2 * np.pi * turns
    target = pitch_roll_yaw(np.concatenate([np.zeros(POSITION.stop), goal.attitude]))
    return target + 2 * np.pi * np.round((angles - target) / (2 * np.pi))
