"""Rotations: quaternions, rotation matrices and angles, and conversions between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from serpentail_scene.layout import QUATERNION, TORSO_NQ, TORSO_Q, Layout

from .checks import finite_array
from .errors import StateError

Array = NDArray[np.float64]
Entries = Sequence[Any] | Array  # numbers, arrays or CasADi expressions, one after another
TURN = 2 * np.pi
REST = np.array([0.0, 0, 0, 1, 0, 0, 0])  # place and quaternion of a fixed base
REST.setflags(write=False)


def pose_of(q: NDArray[Any], layout: Layout) -> NDArray[Any]:
    """Return place and quaternion (..., 7) of the torso in configurations q (..., nq).

    A fixed base is at the world's origin, in its axes.
    """
    return np.broadcast_to(REST, (*q.shape[:-1], TORSO_NQ)) if layout.fixed else q[..., TORSO_Q]


def product(a: Entries, b: Entries) -> list[Any]:
    """Return the four entries of the quaternion product a b, the quaternions given by entries."""
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def quaternion_rate(quaternion: Entries, omega: Entries) -> list[Any]:
    """Return the four entries of q_dot = q (0, omega) / 2, omega (rad/s) in body axes."""
    return [entry / 2 for entry in product(quaternion, [0, omega[0], omega[1], omega[2]])]


def turned(quaternion: Array, turn: Array) -> Array:
    """Return unit quaternions (..., 4) after turns (..., 3), rad, about body axes.

    quaternion: of any norm but 0.
    """
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    step = np.concatenate([np.cos(angle / 2), turn / 2 * np.sinc(angle / TURN)], axis=-1)
    largest = np.abs(quaternion).max(axis=-1, keepdims=True)  # whose square may be no number
    entries = (np.moveaxis(each, -1, 0) for each in (quaternion / largest, step))
    after = np.stack(product(*entries), axis=-1)
    return after / np.linalg.norm(after, axis=-1, keepdims=True)


def turn_between(a: Array, b: Array) -> Array:
    """Return the shortest turns (..., 3), rad, about body axes that take attitudes a to b.

    a, b: quaternions (..., 4) of any norm but 0.
    """
    a, b = (each / np.abs(each).max(axis=-1, keepdims=True) for each in (a, b))
    entries = product(np.moveaxis(a * (1, -1, -1, -1), -1, 0), np.moveaxis(b, -1, 0))
    between = np.stack(entries, axis=-1)
    between = np.where(between[..., :1] < 0, -between, between)
    size = np.linalg.norm(between[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(size, between[..., :1])
    return angle * between[..., 1:] / np.where(size > 0, size, 1)


def from_angles(angles: Array) -> Array:
    """Return quaternions (..., 4) of pitch, roll and yaw (..., 3), rad."""
    c, s = np.cos(angles / 2), np.sin(angles / 2)
    zero = np.zeros_like(c[..., 0])
    pitch = [c[..., 0], s[..., 0], zero, zero]
    roll = [c[..., 1], zero, s[..., 1], zero]
    yaw = [c[..., 2], zero, zero, s[..., 2]]
    return np.stack(product(product(yaw, pitch), roll), axis=-1)


def angle_deg(a: ArrayLike, b: ArrayLike) -> Array:
    """Return angles (...) in degrees between attitudes given as unit quaternions (..., 4)."""
    conjugate = np.asarray(a) * (1, -1, -1, -1)
    entries = product(np.moveaxis(conjugate, -1, 0), np.moveaxis(np.asarray(b), -1, 0))
    vector = np.sqrt(entries[1] ** 2 + entries[2] ** 2 + entries[3] ** 2)
    return np.degrees(2 * np.arctan2(vector, np.abs(entries[0])))


def tilt_deg(quaternion: ArrayLike) -> Array:
    """Return angles (...) in degrees between the torso's and the world's z axis.

    The quaternions (..., 4) have norm 1.
    """
    q = np.asarray(quaternion)
    level = np.hypot(q[..., 1], q[..., 2])
    return np.degrees(2 * np.arctan2(level, np.hypot(q[..., 0], q[..., 3])))


def rotation_matrix(quaternion: ArrayLike) -> Array:
    """Return rotation matrices from body to world axes.

    Parameters
    ----------
    quaternion : array_like, shape (..., 4)
        Quaternions (w, x, y, z) of any norm but 0.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Rotation matrices R.

    Raises
    ------
    StateError
        The shape is wrong, a value is not finite, or a quaternion is zero.

    Examples
    --------
    >>> import serpentail as st
    >>> st.rotation_matrix([1, 0, 0, 0])
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    quaternion = finite_array("quaternion", quaternion)
    if quaternion.shape[-1:] != (4,):
        raise StateError(f"quaternion has shape {quaternion.shape}, not (4,) or (..., 4)")
    # scaled by the largest entry first, so that no square overflows
    size = np.max(np.abs(quaternion), axis=-1, keepdims=True)
    if not (size >= np.finfo(float).tiny).all():
        raise StateError("a quaternion is zero: upright is (1, 0, 0, 0)")
    quaternion = quaternion / size
    unit = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    w, x, y, z = np.moveaxis(unit, -1, 0)
    first = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=-1)
    second = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=-1)
    third = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1)
    return np.stack([first, second, third], axis=-2)


def pitch_roll_yaw(q: ArrayLike, unwrap: bool = False) -> Array:
    """Return pitch, roll and yaw of configurations, with R = Rz(yaw) Rx(pitch) Ry(roll).

    Parameters
    ----------
    q : array_like, shape (..., 7 + 2m)
        Configurations; the tail coordinates may be left out.
    unwrap : bool, default False
        For ``q`` of shape (K, 7 + 2m): follow the angles continuously over time, over whole
        turns and through a pitch of 90 degrees.

    Returns
    -------
    ndarray, shape (..., 3)
        Angles (phi_x, phi_y, phi_z), rad. Without ``unwrap`` the pitch is between -pi/2 and pi/2;
        at either limit roll and yaw are not unique, and one valid pair is returned.

    Raises
    ------
    StateError
        The shape is wrong, a value is not finite, or a quaternion is zero.
    ValueError
        ``unwrap`` is True and ``q`` is not two-dimensional.

    Examples
    --------
    >>> import numpy as np
    >>> import serpentail as st
    >>> q = [0, 0, 0, np.cos(0.1), np.sin(0.1), 0, 0]
    >>> round(float(st.pitch_roll_yaw(q)[0]), 6)
    0.2
    """
    q = finite_array("q", q)
    if q.ndim == 0 or q.shape[-1] < TORSO_NQ:
        raise StateError(f"q has shape {q.shape}, not (7 + 2m,) or (..., 7 + 2m)")
    rotation = rotation_matrix(q[..., QUATERNION])
    first, second, third = (rotation[..., row, :] for row in range(3))
    yaw = np.arctan2(-first[..., 1], second[..., 1])
    # Rz(-phi_z) R = Rx(phi_x) Ry(phi_y)
    c, s = np.cos(yaw)[..., None], np.sin(yaw)[..., None]
    first, second = c * first + s * second, c * second - s * first
    pitch = np.arctan2(third[..., 1], second[..., 1])
    angles = np.stack([pitch, np.arctan2(first[..., 2], first[..., 0]), yaw], axis=-1)
    return _continued(angles) if unwrap else angles


def sign_continuous(quaternion: Array) -> Array:
    """Return the same rotations, each quaternion with the sign nearest to the one before."""
    flips = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
    signs = np.cumprod(np.where(flips, -1.0, 1.0), dtype=np.float64)
    return np.vstack([quaternion[:1], signs[:, None] * quaternion[1:]])


def _continued(angles: Array) -> Array:
    """Return angles (K, 3) followed over time, over whole turns and both Euler branches."""
    if angles.ndim != 2:
        raise ValueError(
            f"q of {angles.ndim} dimensions cannot be unwrapped: give (K, 7 + 2m), time first"
        )
    if not len(angles):
        return angles
    # for either branch there are the same two choices: stay on it, or change to the other
    first, second = branches = _branches(angles)
    stay, change = (np.abs(_less_turns(b[1:] - first[:-1])).sum(axis=1) for b in branches)
    changes = np.concatenate([[_upright(branches[:, 0])], change < stay])
    followed = np.where(np.cumsum(changes)[:, None] % 2, second, first)
    # whole turns are counted, so that rounding does not add up; the first sample has the least
    turns = np.round(np.diff(followed, axis=0, prepend=0) / TURN)
    turns[0, 0] = 0  # its pitch stays
    return followed - TURN * np.cumsum(turns, axis=0)


def _branches(angles: Array) -> Array:
    """Return both Euler branches (2, K, 3): (x, y, z) and (pi - x, y + pi, z + pi)."""
    return np.stack([angles, angles * (-1, 1, 1) + np.pi])


def _upright(branches: Array) -> bool:
    """Tell if the second branch has less roll and yaw, so that a somersault is pitch."""
    first, second = np.abs(_less_turns(branches[:, 1:])).sum(axis=1)
    return bool(second < first)


def _less_turns(angles: Array) -> Array:
    """Return angles less the nearest whole number of turns."""
    return angles - TURN * np.round(angles / TURN)
