"""Coordinates of the torso's attitude, their rates and rotations, for numbers and for CasADi.

A plan describes the attitude by a quaternion or, as the paper does, by Euler angles.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from serpentail_scene.layout import QUATERNION

from ...basics.attitude import (
    from_angles,
    pitch_roll_yaw,
    product,
    quaternion_rate,
    sign_continuous,
)
from ...basics.errors import PlanningError

if TYPE_CHECKING:
    import casadi as ca

KINDS = {"quaternion": 4, "euler": 3}  # name -> number of coordinates
IDENTITY_POSE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])  # in q: at the origin, not rotated
COM_ENTRIES = ((1, 5), (2, 3), (0, 4))  # of H: the COM from B, body axes, times the mass


@dataclass(frozen=True)
class Attitude:
    """Coordinates of the torso's attitude: "quaternion" (w, x, y, z), or "euler", three angles.

    The angles (phi_x, phi_y, phi_z), rad, give R = Rz(phi_z) Rx(phi_x) Ry(phi_y) as in reports.
    """

    kind: str

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return KINDS[self.kind]

    def quaternion(self, c: "ca.SX") -> "ca.SX":
        """Return the quaternion (CasADi) of coordinates c."""
        import casadi as ca

        if self.kind == "quaternion":
            return c
        half = [c[k] / 2 for k in range(3)]
        x, y, z = ([ca.cos(h), ca.sin(h)] for h in half)
        pitch, roll, yaw = [x[0], x[1], 0, 0], [y[0], 0, y[1], 0], [z[0], 0, 0, z[1]]
        return ca.vertcat(*product(product(yaw, pitch), roll))

    def rate(self, c: "ca.SX", omega: "ca.SX") -> "ca.SX":
        """Return the rate (CasADi) of coordinates c at the angular velocity omega in body axes."""
        import casadi as ca

        w = [omega[k] for k in range(3)]
        if self.kind == "quaternion":
            return ca.vertcat(*quaternion_rate([c[k] for k in range(4)], w))
        # Ry(phi_y) omega is in the axes before the roll: (phi_x_dot, phi_y_dot +
        # sin(phi_x) phi_z_dot, cos(phi_x) ...)
        cy, sy = ca.cos(c[1]), ca.sin(c[1])
        across, up = cy * w[0] + sy * w[2], cy * w[2] - sy * w[0]
        yaw = up / ca.cos(c[0])
        return ca.vertcat(across, w[1] - ca.sin(c[0]) * yaw, yaw)

    def coordinates(self, q: np.ndarray) -> np.ndarray:
        """Return coordinates (K, size) of a motion's q (K, nq), continuous in time."""
        if self.kind == "euler":
            return pitch_roll_yaw(q, unwrap=True)
        return sign_continuous(q[:, QUATERNION])

    def as_quaternion(self, c: np.ndarray) -> np.ndarray:
        """Return unit quaternions (K, 4) of coordinates c (K, size)."""
        if self.kind == "euler":
            return from_angles(c)
        return c / np.linalg.norm(c, axis=-1, keepdims=True)


def attitude(kind: str) -> Attitude:
    """Return the attitude coordinates of a name; PlanningError if it is unknown."""
    if kind not in KINDS:
        raise PlanningError(f"attitude: value {kind!r}: needs {' or '.join(map(repr, KINDS))}")
    return Attitude(kind)


def rotated(quaternion: "ca.SX", x: "ca.SX", sense: int = 1) -> "ca.SX":
    """R x, or R^T x for the sense -1, of a quaternion of any norm but zero (CasADi)."""
    import casadi as ca

    w, u = sense * quaternion[0], quaternion[1:]
    twice = (w**2 - ca.dot(u, u)) * x + 2 * ca.dot(u, x) * u + 2 * w * ca.cross(u, x)
    return twice / ca.sumsqr(quaternion)
