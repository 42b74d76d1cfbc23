"""How far points slip along the ground while it pushes them."""

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY

from ..basics.attitude import Array, rotation_matrix
from ..model.model import Model
from .trajectory import Trajectory


def slip(model: Model, motion: Trajectory) -> dict[str, float] | None:
    """Length (m) of the longest path that a point of each group slips; None in flight.

    A path is that of the anchor of the point's friction spring between samples at which the ground
    pushes the point, so a point that sticks has none. With the friction "paper", whose anchors
    never move, it is the path of the point itself.
    """
    if motion.contact is None:
        return None
    found = {}
    for group in motion.contact.groups:
        own = motion.contact.of(group)
        ways = _torso_ways(motion) if group == "torso" else np.diff(own.points[..., :2], axis=0)
        if model.manifest["scene"].get("friction") != "paper":
            ways = ways - np.diff(own.bristles, axis=0)
        pushed = own.forces[..., 2] > 0
        lengths = np.linalg.norm(ways, axis=-1) * (pushed[1:] & pushed[:-1])
        found[group] = float(lengths.sum(axis=0).max())
    return found


def _torso_ways(motion: Trajectory) -> Array:
    """Return the ways (K - 1, 1, 2) of the material of the torso's lowest point, rolling aside."""
    assert motion.contact is not None
    arms = motion.contact.of("torso").points[:, 0] - motion.q[:, POSITION]
    turning = np.einsum("kij,kj->ki", rotation_matrix(motion.q[:, QUATERNION]), motion.v[:, OMEGA])
    speeds = (motion.v[:, VELOCITY] + np.cross(turning, arms))[:, :2]
    ways: Array = (speeds[1:] + speeds[:-1]) / 2 * np.diff(motion.t)[:, None]
    return ways[:, None]
