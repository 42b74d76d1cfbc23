"""Peaks of the ground's forces at a motion's samples: of points, feet, groups and all together."""

from dataclasses import replace

import numpy as np

from ..model.model import Model
from .body import weight
from .trajectory import Trajectory


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
    parts = {group: motion.contact.of(group) for group in motion.contact.groups}
    if "feet" in parts:
        feet = parts["feet"].forces
        for name, foot in zip(("right_foot", "left_foot"), np.split(feet, 2, axis=1), strict=True):
            parts[name] = replace(parts["feet"], forces=foot)
    return {name: float(part.total.max()) for name, part in parts.items()}


def peak_force(motion: Trajectory, group: str) -> float | None:
    """Largest force (N) on a point of a group, of both feet together; None without the group."""
    if motion.contact is None or group not in motion.contact.groups:
        return None
    forces = motion.contact.of(group).forces
    if group == "feet":
        forces = np.add(*np.split(forces, 2, axis=1))
    return float(np.linalg.norm(forces, axis=-1).max())
