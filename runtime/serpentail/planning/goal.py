"""``Goal`` and ``Bounds`` of a plan."""

from dataclasses import dataclass
from typing import Any

import numpy as np

HALF_TURN = "half turn"  # of each segment, a bound of its angles
MOTOR = "motor"  # a bound that is the model's own, if its scene describes motors
LIMIT = "limit"  # a bound that is the model's own


@dataclass(frozen=True)
class Goal:
    """What holds at the end of a plan (f_bc of Eq. 43); None leaves a part free.

    Parameters
    ----------
    attitude : {"upright"} or array_like, shape (4,), default "upright"
        Attitude of the torso: upright at any yaw, or a quaternion (w, x, y, z) from torso to
        world.
    torso_rate : array_like, shape (3,), default zeros
        Angular velocity of the torso (rad/s, body): each component a number, or a range
        (least, most). ``Mpc`` aims at the middle of a range.
    tail : array_like, shape (2m,), optional
        Tail coordinates (rad); single numbers may be None. Default: free.
    tail_rate : array_like, shape (2m,), optional
        Their rates (rad/s); single numbers may be None. Default: free.
    chains : mapping, optional
        In place of ``tail``, coordinates (rad) by the names of chains, pairs and joints, such as
        ``{"tail": [0, 0.2], "hind_knee": -0.5}``: one number, or one for each. Others are free.
    chain_rates : mapping, optional
        Likewise, in place of ``tail_rate`` (rad/s).

    Examples
    --------
    >>> import serpentail as st
    >>> st.Goal(tail=[0.0, None]).attitude
    'upright'
    """

    attitude: Any = "upright"
    torso_rate: Any = (0.0, 0.0, 0.0)
    tail: Any = None
    tail_rate: Any = None
    chains: Any = None
    chain_rates: Any = None


GOALS = {"upright": Goal()}  # by name


def middle(part: np.ndarray) -> np.ndarray:
    """Return the numbers (n,) of a part of a checked goal; of ranges (2, n) their middles."""
    return part if part.ndim == 1 else part.mean(axis=0)


def room(part: np.ndarray) -> np.ndarray:
    """Return how far (n,) a part of a checked goal may be from its middle."""
    return np.zeros(len(part)) if part.ndim == 1 else (part[1] - part[0]) / 2


@dataclass(frozen=True)
class Bounds:
    """Largest magnitudes along a plan (g_pc of Eq. 43); None sets no bound.

    Each is one number, or one for each of the 2m tail coordinates, in SI units or as text with a
    unit, such as "20 mN m". Of several chains it may be a mapping from names of chains, pairs and
    joints, such as ``{"tail": "40 deg", "hind_knee": 1.2}``; later names win, and what has no name
    has the default. One number is that of all coordinates with motors, not of passive ones.

    Parameters
    ----------
    angle : float, array_like or "half turn", default "half turn"
        Tail coordinates (rad): the angle of each joint. A segment of n links bends by n times it.
        "half turn" bends a segment by half a turn at most, or as far as start and goal ask for.
    rate : float or array_like, optional
        Their rates (rad/s). Default: no bound.
    torque : float or array_like, default "motor"
        Torques (N m). "motor": ``motor_torque`` of the model; 0.02 without motors.
    torque_rate : float or array_like, optional
        Rates of the torques (N m/s). With it, the torques are continuous. Default: no bound.
    speed : float or array_like, default "motor"
        Speed (rad/s) of each motor without load: the largest torque falls from ``torque`` at rest
        to 0 there, and beyond it brakes. "motor": ``motor_speed`` of the model; no bound without.
    tension : float or array_like, default "limit"
        Tensions of the tendons (N), one number or one for each, instead of what motors give.
        "limit": ``tendon_limits`` of the model. Between nodes, too, a tension stays 0 or above.
    power : float or array_like, default "motor"
        Mechanical power of each motor (W), torque times rate. "motor": ``motor_power`` of the
        model; no bound without.

    Examples
    --------
    >>> import serpentail as st
    >>> st.Bounds(torque=0.01).torque
    0.01
    """

    angle: Any = HALF_TURN
    rate: Any = None
    torque: Any = MOTOR
    torque_rate: Any = None
    speed: Any = MOTOR
    power: Any = MOTOR
    tension: Any = LIMIT
