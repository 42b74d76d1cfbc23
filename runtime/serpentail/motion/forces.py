"""Peaks of the ground's forces: on all points together, on groups and on feet."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..model.model import Model
from .body import weight
from .contact import OF_POINTS, Contact

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
    if motion.contact is None:
        return {}
    parts = {"all": motion.contact}
    parts |= {group: motion.contact.of(group) for group in motion.contact.groups} | feet(motion)
    found = {}
    for name, part in parts.items():
        k = int(part.total.argmax())
        found[name] = Peak(float(part.total[k]), float(motion.t[k]))
        recorded = Peak(*motion.info.get("peaks", {}).get(name, found[name]))
        if motion.t[0] <= recorded.time <= motion.t[-1]:  # a resampled motion may be a part
            found[name] = max(found[name], recorded)
    return found


def feet(motion: "Trajectory") -> dict[str, Contact]:
    """Return the points of the right and of the left foot; nothing without feet."""
    if motion.contact is None or "feet" not in motion.contact.groups:
        return {}
    both = motion.contact.of("feet")
    halves = {name: np.split(getattr(both, name), 2, axis=1) for name in OF_POINTS}
    count, found = {"feet": both.groups["feet"] // 2}, {}
    for k, name in enumerate(FEET):
        own: dict[str, Any] = {array: half[k] for array, half in halves.items()}
        found[name] = replace(both, **own, groups=count)
    return found
