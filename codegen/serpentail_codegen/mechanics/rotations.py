"""Rotation matrices, quaternions, and symmetric tensors by their six entries.

``let`` names an intermediate result, so that expressions stay small.
"""

from sympy import Matrix, eye, sqrt

from .shapes import M33, V1, V3, V4, V6

X, Y, Z = (Matrix(row) for row in eye(3).tolist())  # the axes


def symmetric(I) -> Matrix:
    """Return the symmetric 3 x 3 matrix of (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = I
    return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def entries(tensor) -> Matrix:
    """Return (xx, yy, zz, xy, xz, yz) of a symmetric matrix."""
    return Matrix([tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])


def turned(let, name, turn, F) -> Matrix:
    """Rotate force and moment."""
    return let(name, Matrix([turn * F[0:3, :], turn * F[3:6, :]]))


def world_vector(let, R: M33, vector: V3) -> dict:
    """Turn a vector from torso axes to world axes."""
    return {"vector": R * vector}


def upward_part(let, R: M33, vector: V3) -> dict:
    """World z of a vector in torso axes."""
    return {"part": [R.row(2).dot(vector)]}


def world_composite(let, R: M33, h: V3, I: V6) -> dict:
    """First moment and inertia turned from torso axes to world axes (Eq. A14)."""
    half = let("half", R * symmetric(I))
    return {"h": R * h, "I": entries(half * R.T)}


def world_acceleration(let, R: M33, gravity: V1, a: V3) -> dict:
    """p_b_ddot = R_b a - g z."""
    return {"p_ddot": R * a - gravity[0] * Z}


def world_acceleration_sloped(let, R: M33, gravity_vector: V3, a: V3) -> dict:
    """The same where gravity has any direction: R_b a + g."""
    return {"p_ddot": R * a + gravity_vector}


def rotation_x(c, s) -> Matrix:
    """R_x of Eq. 11 from cosine and sine."""
    return Matrix([[1, 0, 0], [0, c, -s], [0, s, c]])


def rotation_z(c, s) -> Matrix:
    """R_z of Eq. 11 from cosine and sine."""
    return Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def quaternion_rotation(let, quaternion: V4) -> dict:
    """R_b from (w, x, y, z); only the direction of the quaternion counts, so it need not be
    normalised.
    """
    w, x, y, z = quaternion
    s = let("s", 2 / (w * w + x * x + y * y + z * z))
    sx, sy, sz = let("sq", Matrix([s * x, s * y, s * z]))
    xx, yy, zz = let("d", Matrix([sx * x, sy * y, sz * z]))
    xy, xz, yz, wx, wy, wz = let("e", Matrix([sx * y, sx * z, sy * z, sx * w, sy * w, sz * w]))
    rows = [
        [1 - (yy + zz), xy - wz, xz + wy],
        [xy + wz, 1 - (xx + zz), yz - wx],
        [xz - wy, yz + wx, 1 - (xx + yy)],
    ]
    return {"R": Matrix(rows)}


def unit_quaternion(let, quaternion: V4) -> dict:
    """The quaternion over its norm."""
    norm = let("norm", sqrt(let("square", quaternion.dot(quaternion))))
    return {"unit": quaternion * let("inverse", 1 / norm)}


def turned_quaternion(let, quaternion: V4, turn: V3) -> dict:
    """Rate of a unit quaternion for a rate of rotation in body axes: q (0, turn) / 2."""
    w, x, y, z = quaternion
    half = [let("half", entry / 2) for entry in turn]
    rates = [
        -(x * half[0] + y * half[1] + z * half[2]),
        w * half[0] + y * half[2] - z * half[1],
        w * half[1] + z * half[0] - x * half[2],
        w * half[2] + x * half[1] - y * half[0],
    ]
    return {"rate": Matrix(rates)}


def turn_gradient(let, quaternion: V4, gradient: V4) -> dict:
    """Gradient with respect to a rotation in body axes, from that with respect to a unit
    quaternion's four numbers.
    """
    w, x, y, z = quaternion
    gw, gx, gy, gz = gradient
    twice = [
        w * gx - x * gw + z * gy - y * gz,
        w * gy - y * gw + x * gz - z * gx,
        w * gz - z * gw + y * gx - x * gy,
    ]
    return {"turn": Matrix(twice) / 2}
