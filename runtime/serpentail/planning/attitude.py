"""Attitude coordinates: a name goes in; conversions and rates come out, for numbers and for CasADi."""

from dataclasses import dataclass

import numpy as np

from ..errors import PlanningError
from ..trajectory import pitch_roll_yaw, sign_continuous

KINDS = {"quaternion": 4, "euler": 3}


@dataclass(frozen=True)
class Attitude:
    """Coordinates of the torso's attitude: "quaternion" (w, x, y, z), or "euler" (phi_x, phi_y, phi_z) in rad.

    R = Rz(phi_z) Rx(phi_x) Ry(phi_y) as in reports.
    """

    kind: str

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return KINDS[self.kind]

    def quaternion(self, c):
        """Return the quaternion (CasADi) of coordinates c."""
        import casadi as ca

        if self.kind == "quaternion":
            return c
        half = [c[k] / 2 for k in range(3)]
        x, y, z = ([ca.cos(h), ca.sin(h)] for h in half)
        pitch, roll, yaw = [x[0], x[1], 0, 0], [y[0], 0, y[1], 0], [z[0], 0, 0, z[1]]
        return ca.vertcat(*product(product(yaw, pitch), roll))

    def rate(self, c, omega):
        """Return the rate (CasADi) of coordinates c at the angular velocity omega in body axes."""
        import casadi as ca

        w = [omega[k] for k in range(3)]
        if self.kind == "quaternion":
            return ca.vertcat(*(entry / 2 for entry in product([c[k] for k in range(4)], [0, *w])))
        # Ry(phi_y) omega is in the axes before the roll: (phi_x_dot, phi_y_dot + sin(phi_x) phi_z_dot, cos(phi_x) ...)
        cy, sy = ca.cos(c[1]), ca.sin(c[1])
        across, up = cy * w[0] + sy * w[2], cy * w[2] - sy * w[0]
        yaw = up / ca.cos(c[0])
        return ca.vertcat(across, w[1] - ca.sin(c[0]) * yaw, yaw)

    def coordinates(self, q: np.ndarray) -> np.ndarray:
        """Return coordinates (K, size) of a motion's q (K, nq), continuous in time."""
        if self.kind == "euler":
            return pitch_roll_yaw(q, unwrap=True)
        return sign_continuous(q[:, 3:7])

    def as_quaternion(self, c: np.ndarray) -> np.ndarray:
        """Return unit quaternions (K, 4) of coordinates c (K, size)."""
        if self.kind == "euler":
            return from_angles(c)
        return c / np.linalg.norm(c, axis=-1, keepdims=True)


def attitude(kind: str) -> Attitude:
    """Return the attitude coordinates of a name; PlanningError where it is unknown."""
    if kind not in KINDS:
        raise PlanningError(f"attitude: value {kind!r}: needs {' or '.join(map(repr, KINDS))}")
    return Attitude(kind)


def product(a, b) -> list:
    """Return the entries of the quaternion product a b."""
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def from_angles(angles: np.ndarray) -> np.ndarray:
    """Return quaternions (..., 4) of pitch, roll and yaw (..., 3), rad, R = Rz(phi_z) Rx(phi_x) Ry(phi_y)."""
    c, s = np.cos(angles / 2), np.sin(angles / 2)
    zero = np.zeros_like(c[..., 0])
    pitch, roll = [c[..., 0], s[..., 0], zero, zero], [c[..., 1], zero, s[..., 1], zero]
    yaw = [c[..., 2], zero, zero, s[..., 2]]
    return np.stack(product(product(yaw, pitch), roll), axis=-1)


def angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the angle (...) in degrees between attitudes given as unit quaternions (..., 4)."""
    conjugate = np.asarray(a) * (1, -1, -1, -1)
    entries = product(list(np.moveaxis(conjugate, -1, 0)), list(np.moveaxis(np.asarray(b), -1, 0)))
    vector = np.sqrt(entries[1] ** 2 + entries[2] ** 2 + entries[3] ** 2)
    return np.degrees(2 * np.arctan2(vector, np.abs(entries[0])))


def tilt_deg(quaternion: np.ndarray) -> np.ndarray:
    """Return the angle (...) in degrees between the torso's z axis and the world's, of unit quaternions (..., 4)."""
    q = np.asarray(quaternion)
    level = np.hypot(q[..., 1], q[..., 2])
    return np.degrees(2 * np.arctan2(level, np.hypot(q[..., 0], q[..., 3])))
