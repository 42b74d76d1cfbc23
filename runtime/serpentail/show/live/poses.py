"""Where the parts of the animal are in given poses, as instances of a ball and of a rod."""

from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import POSITION, QUATERNION

from ...basics.attitude import Array, pose_of, rotation_matrix
from ...model.model import Model
from ...motion.body import leg_points
from ..page.shape import shape

# of the torso's ellipsoid: where it is and how large, in semi-axes, so that its sides are told
# apart
PARTS = {
    "back": ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    "belly": ((0.0, 0.0, -0.1), (0.97, 0.97, 0.93)),
    "head": ((0.0, 1.0, 0.3), (0.6, 0.35, 0.6)),
}
LEG_RADIUS = 0.1  # of the torso's smallest semi-axis
SHORTEST = 1e-9  # m, of a rod that has a direction


@dataclass(frozen=True, eq=False)
class Instances:
    """n copies of a mesh of unit size: positions (n, 3) m, quaternions (n, 4), sizes (n, 3) m."""

    positions: Array
    wxyzs: Array
    scales: Array


def animal(model: Model, q: Array, legs: Array | None) -> dict[str, Instances]:
    """Return the parts in the poses q (n, nq): balls of the torso, rods of tail and legs.

    legs (n, 4): their angles, rad; they are left out where these are unknown, or the model has no
    ``leg_points``.
    """
    look = shape(model)
    semi_axes = np.array(look["semi_axes"])
    found = {name: _ball(pose_of(q, model.layout), semi_axes, name) for name in PARTS}
    found["tail"] = rods(model.tail_points(q), np.array(look["tail_radii"]))
    joints = leg_points(model, q, legs)
    if joints is not None:
        found["legs"] = rods(joints.reshape(2 * len(q), 6, 3), LEG_RADIUS * semi_axes.min())
    return found


def _ball(q: Array, semi_axes: Array, name: str) -> Instances:
    """One part of the torso."""
    at, size = (np.array(each) * semi_axes for each in PARTS[name])
    places = q[:, POSITION] + rotation_matrix(q[:, QUATERNION]) @ at
    return Instances(places, q[:, QUATERNION], np.tile(size, (len(q), 1)))


def rods(points: Array, radii: Array | float) -> Instances:
    """Return rods between following points of chains (n, k, 3), m, of one radius, or of k - 1."""
    begins, ends = points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3)
    lengths = np.linalg.norm(ends - begins, axis=1)
    along = (ends - begins) / np.maximum(lengths, SHORTEST)[:, None]
    thick = np.broadcast_to(radii, (len(points), points.shape[1] - 1)).ravel()
    scales = np.column_stack([thick, thick, lengths])
    return Instances((begins + ends) / 2, from_z(along), scales)


def from_z(along: Array) -> Array:
    """Return quaternions (n, 4) that turn the z axis to unit vectors (n, 3)."""
    x, y, z = along.T
    turns = np.stack([1 + z, -y, x, 0 * z], axis=1)
    turns[z < -1 + 1e-9] = [0, 1, 0, 0]  # half a turn about x
    return turns / np.linalg.norm(turns, axis=1, keepdims=True)
