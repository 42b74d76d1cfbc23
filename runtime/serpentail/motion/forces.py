"""Peaks of the ground's forces: on all points together, on groups and on feet."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..model.model import Model
from .body import weight
from .contact import Array

if TYPE_CHECKING:
    from .trajectory import Trajectory

FEET = ("right_foot", "left_foot")


class Peak(NamedTuple):
    """A largest force (N), and its time (s)."""

    force: float
    time: float


def in_weights(model: Model, force: float | None) -> float | None:
    """A force in body weights; None without gravity."""
    whole = weight(model)
    return force / whole if force is not None and whole else None


def peaks(motion: "Trajectory") -> dict[str, Peak]:
    """The largest forces on all points, each group and each foot; nothing in flight.

    They are those at the ends of the integrator's steps, which do not depend on the samples, and at
    the samples, which are all that a motion of other origin has.
    """
    contact = motion.contact
    if contact is None:
        return {}
    groups = {group: contact.of(group).forces for group in contact.groups}
    found = {}
    for name, forces in ({"all": contact.forces} | groups | feet(motion)).items():
        total = np.linalg.norm(forces.sum(axis=1), axis=1)
        k = int(total.argmax())
        found[name] = Peak(float(total[k]), float(motion.t[k]))
        recorded = Peak(*motion.info.get("peaks", {}).get(name, found[name]))
        if motion.t[0] <= recorded.time <= motion.t[-1]:  # a resampled motion may be a part
            found[name] = max(found[name], recorded)
    return found


def feet(motion: "Trajectory") -> dict[str, Array]:
    """Return the forces (K, points, 3) on the right and on the left foot; nothing without feet."""
    if motion.contact is None or "feet" not in motion.contact.groups:
        return {}
    sides = np.split(motion.contact.of("feet").forces, 2, axis=1)
    return dict(zip(FEET, sides, strict=True))
