"""Predicts the end of a flight: the time at which the body would land in a posture."""

import math

import numpy as np

from serpentail_scene.layout import QUATERNION, TAIL_Q

from ..basics.errors import SimulationError
from ..model.model import Model
from ..planning.goal import Goal
from ..planning.result.full_state import com_at_start

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def landing_time(
    model: Model, state: tuple[np.ndarray, np.ndarray], goal: Goal, angles: np.ndarray
) -> float:
    """Return the time (s) from a state (q, v) to the landing in the posture of a checked goal.

    Then the lowest foot, or the lowest point of a model without feet, is at the ground. angles
    (2,): gamma, delta (rad) of the legs. Parts that the goal leaves free count as upright and
    straight. SimulationError if the centre of mass never reaches that height.
    """
    (_, _, z), (_, _, rise) = com_at_start(model, state)
    drop, g = z - _height(model, goal, angles), model.parameters["gravity"]
    inside = rise**2 + 2 * g * drop
    if g == 0 or inside < 0:
        raise SimulationError(
            f"landing: the centre of mass is {-drop:.3g} m too low for the goal's posture, and "
            f"rises by {max(rise, 0) ** 2 / (2 * g) if g else 0:.3g} m: give the plan a duration"
        )
    time = (rise + math.sqrt(inside)) / g
    if time <= 0:
        raise SimulationError("landing: it is in the past: give the plan a duration")
    return time


def _height(model: Model, goal: Goal, angles: np.ndarray) -> float:
    """Height (m) of the centre of mass over the lowest foot, or point, in the goal's posture."""
    q = np.zeros(model.nq)
    named = isinstance(goal.attitude, str) or goal.attitude is None
    q[QUATERNION] = UPRIGHT if named else goal.attitude
    if goal.tail is not None:
        q[TAIL_Q] = np.nan_to_num(goal.tail)
    legs = (np.array([*angles, *angles, *np.zeros(4)]),) if "feet" in model.contacts else ()
    points, _ = model.contact_points(q, np.zeros(model.nv), *legs)
    lowest = points[: model.contacts.get("feet", len(points)), 2].min()
    return float(com_at_start(model, (q, np.zeros(model.nv)))[0][2] - lowest)
