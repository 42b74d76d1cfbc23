"""The size of the torso, which numbers and pictures need."""

import numpy as np

from ..basics.attitude import Array
from ..model.model import Model


def semi_axes(model: Model) -> Array:
    """Return the semi-axes (3,) of the torso, m, along its own axes.

    The torso is the ellipsoid that touches the ground, else the homogeneous one of its inertia.
    A fixed base has no torso: zeros.
    """
    p = model.parameters
    if model.fixed:
        return np.zeros(3)
    if "torso_semi_axes" in p:
        return np.array(p["torso_semi_axes"], float)
    spread = np.sum(p["torso_inertia"]) - 2 * np.array(p["torso_inertia"])
    return np.sqrt(np.maximum(2.5 / p["torso_mass"] * spread, 0))
