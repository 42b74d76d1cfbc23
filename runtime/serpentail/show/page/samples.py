"""The samples of a motion in the page, with the positions of the animal's parts."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...basics.attitude import Array, tilt_deg
from ...model.model import Model
from ...motion.body import bends, centre_of_mass, leg_points
from ...motion.trajectory import ARRAYS, Trajectory


def thinned_rows(count: int, most: int) -> tuple[NDArray[np.intp], int]:
    """Return every n-th of ``count`` rows and the last, at most ``most`` of them; and n."""
    step = max(-(-(count - 1) // (most - 1)), 1)
    if step == 1:
        return np.arange(count), 1
    return np.append(np.arange(0, count - 1, step), count - 1), step


def thinned(motion: Trajectory, most: int) -> tuple[Trajectory, int]:
    """Return every n-th sample of a motion and the last, at most ``most`` of them; and n."""
    rows, step = thinned_rows(len(motion.t), most)
    if step == 1:
        return motion, 1
    arrays: dict[str, Any] = {name: getattr(motion, name)[rows] for name in ARRAYS}
    contact = motion.contact and motion.contact.mapped(lambda samples: samples[rows])
    return dataclasses.replace(motion, contact=contact, **arrays), step


def samples(model: Model, motion: Trajectory) -> dict[str, Array]:
    """Return arrays (K, ...) by name, SI; plotted angles are in degrees.

    t as two floats whose sum it is; pose: p and quaternion; tail, legs, touching: points in the
    world; forces of the ground at ``touching``; then the plotted curves.
    """
    t = motion.t.astype(np.float32)
    arrays = {
        "t": np.stack([t, motion.t - t], axis=1),
        "pose": motion.pose,
        "tail": model.tail_points(motion.q),
        "com": centre_of_mass(model, motion.q, motion.v),
        "height": motion.pose[:, 2],
        "tilt": tilt_deg(motion.attitude),
        "bends": np.degrees(bends(model, motion.tail)),
        "torque": motion.tau,
        "energy": np.stack([motion.energy, motion.kinetic, motion.potential], axis=1),
    }
    return {
        name: np.asarray(array, float) for name, array in (arrays | _ground(model, motion)).items()
    }


def _ground(model: Model, motion: Trajectory) -> dict[str, Array]:
    """Legs, points that touch and their forces, and each group's total; none in flight."""
    contact = motion.contact
    if contact is None:
        return {}
    # where no force acts no arrow is drawn, so no point is needed
    pushed = np.abs(contact.forces).max(axis=2, keepdims=True) > 0
    arrays = {
        "touching": np.where(pushed, contact.points, 0),
        "forces": contact.forces,
        "force": np.stack([contact.of(group).total for group in contact.groups], axis=1),
    }
    legs = leg_points(model, motion.q, contact.legs)
    return arrays if legs is None else arrays | {"legs": legs}
