"""Rotations by a quaternion, as expressions of CasADi, and where a mass matrix has the COM."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import casadi as ca

IDENTITY_POSE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])  # in q: at the origin, not rotated
COM_ENTRIES = ((1, 5), (2, 3), (0, 4))  # of H: the COM from B, body axes, times the mass


def rotated(quaternion: "ca.SX", x: "ca.SX", sense: int = 1) -> "ca.SX":
    """R x, or R^T x for the sense -1, of a quaternion of any norm but zero (CasADi)."""
    import casadi as ca

    w, u = sense * quaternion[0], quaternion[1:]
    twice = (w**2 - ca.dot(u, u)) * x + 2 * ca.dot(u, x) * u + 2 * w * ca.cross(u, x)
    return twice / ca.sumsqr(quaternion)
