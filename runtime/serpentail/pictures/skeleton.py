"""Where the joints of both legs are in a motion, to draw them."""

import numpy as np
from numpy.typing import ArrayLike

from ..model.model import Model
from ..motion.trajectory import Trajectory


def leg_joints(model: Model, motion: Trajectory, angles: ArrayLike) -> np.ndarray:
    """Return hip, D, knee, ankle A, M and T of both legs, (K, 2, 6, 3), m, world (Eqs. 5 to 9).

    angles (K, 4): gamma and delta (rad) of the right leg, then of the left, as ``Legs.curve`` has
    them.  ModelError where the model has no function ``leg_points``.
    """
    return model.leg_points(motion.q, angles)
