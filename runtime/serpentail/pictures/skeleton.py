"""Where the joints of both legs are in a motion, to draw them."""

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import rotation_matrix
from ..model.layout import POSITION
from ..model.model import Model
from ..motion.trajectory import Trajectory

SIDES = (1.0, -1.0)  # the left hip mirrors the right one in x


def leg_joints(model: Model, motion: Trajectory, angles: ArrayLike) -> np.ndarray:
    """Return hip, D, knee, ankle A, M and T of both legs, (K, 2, 6, 3), m, world (Eqs. 5 to 8).

    angles (K, 4): gamma and delta (rad) of the right leg, then of the left, as ``Legs.curve`` has
    them.
    """
    # from joint to joint, in the torso frame
    gamma, delta = np.moveaxis(np.reshape(np.asarray(angles, float), (-1, 2, 2)), -1, 0)
    p = model.parameters
    steps = [
        p["L_h2d"] * _ray(gamma),
        p["L_d2k"] * _ray(delta),
        p["L_k2a"] * _ray(gamma),
        p["L_a2m"] * _ray(delta),
        -p["L_m2t"] * _ray(gamma - p["delta_m"]),
    ]

    # from the hips on, and into the world
    hips = np.array(p["hip"]) * [[side, 1.0, 1.0] for side in SIDES]
    reach = np.cumsum(np.stack(steps, axis=2), axis=2)
    local = hips[None, :, None] + np.concatenate([np.zeros_like(reach[:, :, :1]), reach], axis=2)
    rotated = np.einsum("kij,klnj->klni", rotation_matrix(motion.attitude), local)
    return motion.q[:, None, None, POSITION] + rotated


def _ray(angle: np.ndarray) -> np.ndarray:
    """u of Eq. 9: (0, cos, sin)."""
    return np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=-1)
