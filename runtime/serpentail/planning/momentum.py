"""Goals that the conserved angular momentum forbids, found before anything is derived.

At the end H_bb (d, omega) + H_bt q_t_dot = (0, R^T h), d being the velocity of B relative to the
centre of mass.  Where the goal fixes the torso's rate and the tail, only free rates of the tail,
and the yaw of an upright end, are left to carry h.
"""

import numpy as np

from serpentail_scene.layout import OMEGA, VELOCITY

from ..basics.attitude import rotation_matrix
from ..basics.errors import PlanningError
from ..model.model import Model
from .air import in_air
from .goal import middle, room
from .problem import PlanningProblem
from .program.coordinates import IDENTITY_POSE

SMALL = 1e-3  # of the angular momentum: largest difference at the end that is not refused
YAWS = np.linspace(0.0, 2 * np.pi, 73)


def refuse_impossible(model: Model, problem: PlanningProblem) -> None:
    """PlanningError if no end of a flight can have the rates that the goal asks for.

    Nothing is refused in air or if parts of the start are free, because they change the momentum,
    or if the torso's rate has a range.
    """
    if problem.free_start or in_air(model):
        return
    goal, h = problem.goal, model.momentum(problem.q0, problem.v0)[1]
    size = float(np.linalg.norm(h))
    if goal.torso_rate is None or room(goal.torso_rate).any() or size == 0:
        return
    told = f"flight conserves the angular momentum {np.array2string(h, precision=3)} kg m^2/s"
    tail_rests = goal.tail_rate is not None and not np.any(goal.tail_rate)
    if tail_rests and not np.any(goal.torso_rate):
        raise PlanningError(
            f"goal: torso and tail at rest, but {told}: leave torso_rate or tail_rate free"
        )
    if problem.design.size or goal.tail is None or not np.isfinite(goal.tail).all():
        return
    left = _least_left(model, problem, h)
    if left > SMALL * size:
        raise PlanningError(
            f"goal: with this tail and torso_rate, tail rates within their bounds cannot carry "
            f"{left / size:.1%} of the angular momentum: {told}: leave torso_rate, or entries of "
            "tail or tail_rate, free"
        )


def _least_left(model: Model, problem: PlanningProblem, h: np.ndarray) -> float:
    """Return the least angular momentum (kg m^2/s) that nothing is left to carry, over all yaws of
    an upright end.
    """
    from scipy.optimize import lsq_linear, minimize_scalar

    goal, bounds = problem.goal, problem.bounds
    if goal.attitude is None:
        return 0.0
    # H of torso's and tail's rates where B's velocity follows from them
    H = model.mass_matrix(np.concatenate([IDENTITY_POSE, goal.tail]))
    rates = slice(OMEGA.start, None)
    S = H[rates, rates] - H[rates, VELOCITY] @ H[VELOCITY, rates] / H[0, 0]
    own, tail = S[:3, :3], S[:3, 3:]
    wanted = np.full(len(goal.tail), np.nan) if goal.tail_rate is None else goal.tail_rate
    free = np.isnan(wanted)
    fixed = own @ middle(goal.torso_rate) + tail[:, ~free] @ wanted[~free]
    size, scale = float(np.linalg.norm(h)), float(np.linalg.norm(tail))
    most = np.inf if bounds.rate is None else bounds.rate[free] * scale / size

    def left(yaw: float) -> float:
        carried = _at_end(goal.attitude, h, yaw) - fixed
        if not free.any():
            return float(np.linalg.norm(carried))
        found = lsq_linear(tail[:, free] / scale, carried / size, (-most, most))
        return size * float(np.sqrt(2 * found.cost))

    if not isinstance(goal.attitude, str):
        return left(0.0)
    coarse = min(YAWS, key=left)
    span = (coarse - YAWS[1], coarse + YAWS[1])
    return min(left(coarse), float(minimize_scalar(left, bounds=span, method="bounded").fun))


def _at_end(attitude: np.ndarray | str, h: np.ndarray, yaw: float) -> np.ndarray:
    """Angular momentum (3,) in body axes at an upright end of this yaw (rad), or at an attitude."""
    if not isinstance(attitude, str):
        return rotation_matrix(attitude).T @ h
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([c * h[0] + s * h[1], c * h[1] - s * h[0], h[2]])
