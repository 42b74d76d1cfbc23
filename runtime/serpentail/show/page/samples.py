"""The samples of a motion in the page, thinned, with the places of the animal's parts, as text."""

import base64
import dataclasses
import gzip
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...basics.attitude import Array, tilt_deg
from ...model.model import Model
from ...motion.trajectory import ARRAYS, Trajectory
from ..animal import bends, centre_of_mass, poses_of

LARGEST = float(np.finfo(np.float32).max)


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
    t, contact = motion.t.astype(np.float32), motion.contact
    poses = poses_of(model, motion.q, None if contact is None else contact.legs, *motion.given)
    arrays = {
        "t": np.stack([t, motion.t - t], axis=1),
        "pose": poses.torso,
        "tail": poses.tail,
        "com": centre_of_mass(model, motion.q, motion.v, *motion.given),
        "height": poses.torso[:, 2],
        "tilt": tilt_deg(motion.attitude),
        "bends": np.degrees(bends(model, motion.tail)),
        "torque": motion.tau,
        "momentum": motion.angular_momentum,
        "energy": np.stack([motion.energy, motion.kinetic, motion.potential], axis=1),
    }
    if contact is not None:
        # where no force acts no arrow is drawn, so no point is needed
        pushed = np.abs(contact.forces).max(axis=2, keepdims=True) > 0
        arrays["touching"] = np.where(pushed, contact.points, 0)
        arrays["forces"] = contact.forces
        totals = [contact.of(group).total for group in contact.groups]
        arrays["force"] = np.stack(totals, axis=1)
    if poses.legs is not None:
        arrays["legs"] = poses.legs
    return {name: np.asarray(array, float) for name, array in arrays.items()}


def packed(samples: NDArray[np.float64]) -> str:
    """Return samples (K, ...) as text: float32, their bits' differences by bytes, gzip, base64.

    A smooth column's bits change little from sample to sample, so the high bytes of their
    differences are mostly zero: two to three times smaller than gzip alone, and not a bit is lost.
    Numbers beyond float32 become its largest.
    """
    columns = samples.reshape(len(samples), -1).T
    bits = np.ascontiguousarray(np.clip(columns, -LARGEST, LARGEST), "<f4").view("<u4")
    steps = np.diff(bits, axis=1, prepend=np.zeros((len(bits), 1), "<u4"))
    planes = np.ascontiguousarray(steps).reshape(-1, 1).view(np.uint8).T
    return as_text(planes.tobytes())


def as_text(content: bytes) -> str:
    """Return bytes as text: gzip, base64."""
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")
