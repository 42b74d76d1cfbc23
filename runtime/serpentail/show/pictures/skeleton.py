"""``leg_joints``: the joints of both legs along a motion, to draw them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...model.model import Model
from ...motion.trajectory import Trajectory


def leg_joints(model: Model, motion: Trajectory, angles: ArrayLike) -> np.ndarray:
    """Return the joints of both legs along a motion (Eqs. 5 to 9).

    Parameters
    ----------
    model : Model
        A model with feet.
    motion : Trajectory
        The motion, of K samples.
    angles : array_like, shape (K, 4)
        gamma and delta of the right leg, then of the left (rad), as in ``Contact.legs``.

    Returns
    -------
    ndarray, shape (K, 2, 6, 3)
        Hip, D, knee, A, M and T of the right leg, then of the left (m, world).

    Raises
    ------
    StateError
        The angles have a wrong shape.
    ModelError
        The model has no function "leg_points".
    """
    return model.leg_points(motion.q, angles)
