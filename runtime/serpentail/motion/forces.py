"""Peaks of the ground's forces at a motion's samples: of points, feet, groups and all together."""

import numpy as np

from ..model.model import Model
from .body import weight
from .contact import Array
from .trajectory import Trajectory

FEET = ("right_foot", "left_foot")


def in_weights(model: Model, force: float | None) -> float | None:
    """A force in body weights; None without gravity."""
    whole = weight(model)
    return force / whole if force is not None and whole else None


def peak_total(motion: Trajectory) -> float | None:
    """The largest force (N) on all points together; None in flight."""
    return None if motion.contact is None else float(motion.contact.total.max())


def peaks(motion: Trajectory) -> dict[str, float] | None:
    """The largest force (N) on each group, and on each foot; None in flight."""
    if motion.contact is None:
        return None
    groups = {group: motion.contact.of(group).forces for group in motion.contact.groups}
    totals = {name: forces.sum(axis=1) for name, forces in (groups | feet(motion)).items()}
    return {name: float(np.linalg.norm(total, axis=1).max()) for name, total in totals.items()}


def feet(motion: Trajectory) -> dict[str, Array]:
    """Return the forces (K, points, 3) on the right and on the left foot; nothing without feet."""
    if motion.contact is None or "feet" not in motion.contact.groups:
        return {}
    sides = np.split(motion.contact.of("feet").forces, 2, axis=1)
    return dict(zip(FEET, sides, strict=True))


def peak_force(motion: Trajectory, group: str) -> float | None:
    """Largest force (N) on a point of a group, of both feet together; None without the group."""
    if motion.contact is None or group not in motion.contact.groups:
        return None
    forces = motion.contact.of(group).forces
    if group == "feet":
        forces = np.add(*np.split(forces, 2, axis=1))
    return float(np.linalg.norm(forces, axis=-1).max())
