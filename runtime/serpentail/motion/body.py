"""What of the animal's body numbers and pictures need: weight, size, centre of mass, legs."""

import numpy as np

from serpentail_scene.layout import POSITION

from ..basics.attitude import Array, pose_of
from ..model.model import Model
from ..model.parameters import total_mass
from ..model.polar import polar_to_bend


def weight(model: Model) -> float:
    """Return the weight (N) of torso and tail, of the tail on a fixed base; 0 without gravity."""
    return float(total_mass(model.parameters) * model.parameters["gravity"])


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


def centre_of_mass(model: Model, q: Array, v: Array) -> Array:
    """Return the centre of mass (K, 3), m; that of the torso if the scene left out
    ``center_of_mass``; on a fixed base the place of the base.
    """
    if model.fixed or "center_of_mass" not in model.kernels:
        return pose_of(q, model.layout)[:, POSITION]
    return np.asarray(model.center_of_mass(q, v)[0])


def bends(model: Model, tail: Array) -> Array:
    """Return the bends (K, 2m) of the segments in pitch and yaw, rad, of tail coordinates (K, 2m).

    The bend of an articulated segment is the sum of its links' angles.
    """
    if model.links is not None:
        return np.repeat(model.joints_each, 2) * tail
    if model.manifest["scene"]["coordinates"] != "polar":
        return tail
    pitch, yaw, *_ = polar_to_bend(tail[:, 0::2], tail[:, 1::2])
    return np.stack([pitch, yaw], axis=2).reshape(tail.shape)


def leg_points(model: Model, q: Array, legs: Array | None) -> Array | None:
    """Return the joints (K, 2, 6, 3) of the legs, m, world.

    None if the angles (K, 4) are unknown, or the scene left out the function ``leg_points``.
    """
    if legs is None or "leg_points" not in model.kernels:
        return None
    return np.asarray(model.leg_points(q, legs))
