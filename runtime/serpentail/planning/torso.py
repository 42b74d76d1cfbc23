"""A constraint that keeps the tail out of the torso, made where a plan goes through it."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION

from ..basics.attitude import rotation_matrix
from ..model.model import Model
from ..motion.body import semi_axes
from ..motion.plausibility import SUNK, depth_in_torso, torso_is_known
from .problem import PlanningProblem
from .program.cache import memoised
from .result.full_state import full_state
from .result.plan import sample_times
from .round import Round

if TYPE_CHECKING:
    import casadi as ca

BETWEEN = (0.25, 0.5, 0.75, 1.0)  # where each line between two points of the tail is kept out
KEPT = SUNK / 2  # how deep it may be, of the way from the surface to the centre


def goes_through_torso(found: Round) -> bool:
    """Tell if the tail of a round's motion goes through the torso."""
    model, motion, problem = found.model, found.curve, found.problem
    if not torso_is_known(model):
        return False
    times = sample_times(motion.ends)
    q, _ = full_state(model, (problem.q0, problem.v0), times, motion.at(times))
    return bool(depth_in_torso(model, q).max() > SUNK)


def off_torso(model: Model, problem: PlanningProblem) -> PlanningProblem | None:
    """Return the problem with the constraint; None if the start is in the torso already."""
    if depth_in_torso(model, problem.q0[None])[0] > KEPT:
        return None
    function = memoised(("torso", model), lambda: _outside(model))
    return replace(problem, path=(*problem.path, (function, 0.0, np.inf)))


def _outside(model: Model) -> "Callable[[Any], ca.SX]":
    """Return a function of a point that is not negative where the tail is out of the torso.

    Points that a straight tail has inside the torso may be as near to its centre as the mount.
    """
    axes = semi_axes(model)
    q = np.zeros(model.nq)
    q[QUATERNION.start] = 1.0
    straight = _divided(model, q, axes)
    distance, nearest = np.linalg.norm(straight, axis=1), np.ones(len(straight))
    ends: list[int] = []
    for chain in model.layout.chains:
        ends += range(chain.points.start + 1, chain.points.stop)
        inside = distance[chain.points] <= 1
        nearest[chain.points][inside] = min(distance[chain.points.start], 1.0)
    nearest = np.maximum(nearest - KEPT, 0)

    def outside(point: Any) -> "ca.SX":
        import casadi as ca

        points = point.tail_from_torso
        own = [points[k, :].T / axes for k in range(points.size1())]
        rows = []
        for k in ends:
            for part in BETWEEN:
                # the point may be as near as the nearer end of its line
                least = min(nearest[k - 1], nearest[k])
                at = (1 - part) * own[k - 1] + part * own[k]
                rows.append(ca.sumsqr(at) - least**2)
        return ca.vertcat(*rows)

    return outside


def _divided(model: Model, q: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the tail's points (P, 3) from the torso's centre, its axes, over its semi-axes."""
    from_b = model.tail_points(q) - q[POSITION]
    return np.asarray(from_b @ rotation_matrix(q[QUATERNION]) / axes)
