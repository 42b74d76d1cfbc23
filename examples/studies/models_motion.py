"""The motion by which tail models are compared (Sect. 4.1): the tail swings, the torso yaws."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

import serpentail as st

STEPS = 400
FULL_TURN = np.arctan(np.pi / 2)  # rad, COM direction of an arc bent by pi
SHOWN = 4  # links of the tail in Fig. 8a, the one that differs most
THIN = (0.0, 0.0, 0.0)  # kg m^2: links are lines, like the continuum
MOST_BEND = 1.5 * np.pi  # rad, more than any tail needs for it


def com_directions(steps: int = STEPS) -> np.ndarray:
    """Return the tail COM's direction theta_com (steps + 1,), rad, at equal times: 0 to atan(pi /
    2), a cubic.
    """
    s = np.linspace(0, 1, steps + 1)
    return FULL_TURN * (3 * s**2 - 2 * s**3)


def arc_direction(bend: np.ndarray) -> np.ndarray:
    """Return theta_com (rad) of an arc bent by `bend` (rad), Eq. 49."""
    return np.arctan2(bend - np.sin(bend), 1 - np.cos(bend))


def chain_direction(bend: np.ndarray, links: int) -> np.ndarray:
    """Return theta_com (rad) of equal links that are bent by `bend` (rad) in all, each by bend /
    n.
    """
    angles = np.multiply.outer(bend, np.arange(1, links + 1) / links)
    reach = (
        links + 0.5 - np.arange(1, links + 1)
    )  # weight of each link's bend: half for the link itself, one for each link after it
    return np.arctan2(np.sin(angles) @ reach, np.cos(angles) @ reach)


def bend_towards(direction: Callable, targets: np.ndarray) -> np.ndarray:
    """Return the bends (rad) at which the COM has the target directions (rad), by bisection."""
    low, high = np.zeros_like(targets), np.full_like(targets, MOST_BEND)
    for _ in range(60):
        middle = (low + high) / 2
        short = direction(middle) < targets
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return (low + high) / 2


def yaw_motion(model: st.Model) -> np.ndarray:
    """Return the torso's yaw phi_z (STEPS + 1,), deg, in Sect. 4.1's motion of a tail of one
    segment.
    """
    if model.links is None:
        return torso_yaw(model, bend_towards(arc_direction, com_directions()))
    bends = bend_towards(lambda bend: chain_direction(bend, model.links), com_directions())
    return torso_yaw(model, bends / model.links)


def torso_yaw(model: st.Model, angles: np.ndarray) -> np.ndarray:
    """Return the yaw (K,), deg, of a torso at zero momentum whose tail takes the yaw coordinates
    (K,), rad, in turn.

    Zero momentum is H_bb v_b + H_bt q_t_dot = 0 (upper rows of Eq. 1): only the path matters, not
    its timing.
    """
    q = np.zeros((len(angles) - 1, model.nq))
    q[:, 3], q[:, 8] = 1.0, (angles[1:] + angles[:-1]) / 2
    H = model.mass_matrix(q)
    turns = -np.linalg.solve(H[:, :6, :6], H[:, :6, 7:8])[:, 3:, 0] * np.diff(angles)[:, None]
    attitude = [Rotation.identity()]
    for turn in turns:
        attitude.append(attitude[-1] * Rotation.from_rotvec(turn))
    q = np.zeros((len(angles), model.nq))
    q[:, 3:7] = [rotation.as_quat(scalar_first=True) for rotation in attitude]
    return np.degrees(st.pitch_roll_yaw(q)[:, 2])
