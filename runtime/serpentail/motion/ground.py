"""What the ground does in a motion: peaks of its forces, and how far it lets points slip."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, VELOCITY

from ..basics.attitude import Array, rotation_matrix
from ..model.model import Model

if TYPE_CHECKING:
    from .trajectory import Trajectory

FEET = ("right_foot", "left_foot")


class Peak(NamedTuple):
    """A largest force (N), and its time (s)."""

    force: float
    time: float


def peaks(motion: "Trajectory") -> dict[str, Peak]:
    """The largest forces on all points, each group and each foot; nothing in flight.

    They are those at the ends of the integrator's steps, which do not depend on the samples, and at
    the samples, which are all that a motion of other origin has.
    """
    contact = motion.contact
    if contact is None:
        return {}
    totals = {"all": contact.total} | {group: contact.of(group).total for group in contact.groups}
    for foot, forces in feet(motion).items():
        totals[foot] = np.linalg.norm(forces.sum(axis=1), axis=1)
    largest = {}
    for name, total in totals.items():
        k = int(total.argmax())
        largest[name] = Peak(float(total[k]), float(motion.t[k]))
        recorded = Peak(*motion.info.get("peaks", {}).get(name, largest[name]))
        if motion.t[0] <= recorded.time <= motion.t[-1]:  # a resampled motion may be a part
            largest[name] = max(largest[name], recorded)
    return largest


def feet(motion: "Trajectory") -> dict[str, Array]:
    """The forces (K, points, 3) on the right and on the left foot; nothing without feet."""
    if motion.contact is None or "feet" not in motion.contact.groups:
        return {}
    sides = np.split(motion.contact.of("feet").forces, 2, axis=1)
    return dict(zip(FEET, sides, strict=True))


def slip(model: Model, motion: "Trajectory") -> dict[str, float] | None:
    """Length (m) of the longest path that a point of each group slips; None in flight.

    A path is that of the anchor of the point's friction spring between samples at which the ground
    pushes the point, so a point that sticks has none. With the friction "paper", whose anchors
    never move, it is the path of the point itself.
    """
    if motion.contact is None:
        return None
    paths = {}
    for group in motion.contact.groups:
        contact = motion.contact.of(group)
        if group == "torso":
            ways = _torso_ways(motion, contact.points[:, 0])
        else:
            ways = np.diff(contact.points[..., :2], axis=0)
        if model.manifest["scene"].get("friction") != "paper":
            ways = ways - np.diff(contact.bristles, axis=0)
        pushed = contact.forces[..., 2] > 0
        lengths = np.linalg.norm(ways, axis=-1) * (pushed[1:] & pushed[:-1])
        paths[group] = float(lengths.sum(axis=0).max())
    return paths


def _torso_ways(motion: "Trajectory", lowest: Array) -> Array:
    """The ways (K - 1, 1, 2) of the material of the torso's lowest point (K, 3), rolling aside."""
    rotations = rotation_matrix(motion.q[:, QUATERNION])
    turning = np.einsum("kij,kj->ki", rotations, motion.v[:, OMEGA])
    arms = lowest - motion.q[:, POSITION]
    speeds = (motion.v[:, VELOCITY] + np.cross(turning, arms))[:, :2]
    ways: Array = (speeds[1:] + speeds[:-1]) / 2 * np.diff(motion.t)[:, None]
    return ways[:, None]
