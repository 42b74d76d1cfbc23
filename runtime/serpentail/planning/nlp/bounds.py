"""The limits of a nonlinear program: bounds of its unknowns and of its constraints.

They depend on start, duration and magnitudes, which differ between plans of one program.
"""

from dataclasses import dataclass

import numpy as np

from ...attitude import pitch_roll_yaw
from ...model.layout import POSITION
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
    first = np.concatenate([start[name] / variables.units[name] for name, _ in variables.states])
    lbx[indices.states[0]] = ubx[indices.states[0]] = first
    _fix_end(nlp, lbx, ubx)
    return Limits(lbx, ubx, *_constraint_bounds(nlp, angles))


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
    return (
        np.concatenate([defects, at_nodes[0], least]),
        np.concatenate([defects, at_nodes[1], most]),
    )


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
