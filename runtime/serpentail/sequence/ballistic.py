"""When a flight would end: the centre of mass falls to its height in the landing's posture."""

import math

import numpy as np

from ..errors import SimulationError
from ..model.layout import QUATERNION, TAIL_Q
from ..model.model import Model
from ..planning.goal import Goal
from ..planning.result.full_state import com_at_start

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def landing_time(
    model: Model, state: tuple[np.ndarray, np.ndarray], goal: Goal, angles: np.ndarray
) -> float:
    """Return after how many seconds from a state (q, v) the lowest foot is at the ground, or the
    lowest point of a model without feet, if the animal is in a checked goal's posture then.

    angles (2,): gamma, delta (rad) of the legs.  What the goal leaves free is upright and straight.
    SimulationError where the centre of mass never comes to that height.
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
