"""Segments as articulated bodies: the inertia and the loads that pass from segment to segment.

The links of a segment move with its base and with its two coordinates.  A motion is (acceleration
of the origin, angular acceleration), a wrench (force, moment), in the axes of the base they are
about; the tip of a segment is the base of the next one.  With x = (motion of the base, second
derivatives of the coordinates), K x + b is the wrench that moves a segment and all beyond, and the
torques on its coordinates: K is 8 x 8.  Once the coordinates are eliminated it is A a + b of the
base's motion a alone.  Lanes of K, A, b and T are the entries of x.
"""

from sympy import Matrix, diag, zeros

from .rotations import X, Y, Z, symmetric
from .shapes import M33, V1, V2, V3, V6, V8, V12, V15, V30, V6x3, V6x6


def swept_by(arm) -> Matrix:
    """Velocity of a point at ``arm`` for a turn about each axis: columns e_k x arm."""
    return Matrix.hstack(*(axis.cross(arm) for axis in (X, Y, Z)))


def tip_motion(let, R: M33, P: V3, S: V12) -> dict:
    """The quantities that determine the tip's motion: R^T, R^T (e_k x P), and in its axes the
    columns S at the tip (A5 to A8).
    """
    turn, parts = R.T, []
    for axis, velocity in ((S[0:3, :], S[3:6, :]), (S[6:9, :], S[9:12, :])):
        parts += [turn * let("at_tip", velocity + axis.cross(P)), turn * axis]
    return {
        "tip_map": Matrix(
            [*turn, *(turn * swept_by(P)), *(entry for part in parts for entry in part)]
        )
    }


def tip_matrix(tip_map) -> Matrix:
    """T, 6 x 8: motion of the tip in its own axes = T x, without the terms of velocities."""
    turn, swept = (tip_map[k : k + 9, :].reshape(3, 3) for k in (0, 9))
    pitch, turn_pitch, yaw, turn_yaw = (tip_map[18 + 3 * k : 21 + 3 * k, :] for k in range(4))
    return Matrix.vstack(
        Matrix.hstack(turn, swept, pitch, yaw),
        Matrix.hstack(zeros(3, 3), turn, turn_pitch, turn_yaw),
    )


def tip_rows(let, tip_map: V30) -> dict:
    """The rows of T."""
    return {f"T_{r}": tip_matrix(tip_map).row(r).T for r in range(6)}


def tip_angular_velocity(let, tip_map: V30, rates: V2, w: V3) -> dict:
    """omega of the tip (A1), in its axes."""
    return {"w": tip_matrix(tip_map)[3:6, 3:8] * Matrix([w, rates])}


def own_inertia(
    let, mass: V1, h: V3, I: V6, pitch: V6, yaw: V6, H_pp: V1, H_py: V1, H_yy: V1
) -> dict:
    """Rows of K of a segment's own links: their composite inertia and momentum columns (Eq. 16)."""
    body = Matrix([[diag(*[mass[0]] * 3), swept_by(h)], [swept_by(h).T, symmetric(I)]])
    columns, block = Matrix.hstack(pitch, yaw), Matrix([[H_pp[0], H_py[0]], [H_py[0], H_yy[0]]])
    K = Matrix([[body, columns], [columns.T, block]])
    return {f"K_{r}": K.row(r).T for r in range(8)}


def load_at_tip(let, A: V6, b: V1, coasting: V6) -> dict:
    """Wrench A a + b that moves everything beyond a tip with the motion ``coasting``, which follows
    from velocities alone.
    """
    total = b[0]
    for k in range(6):
        total += let("moved", coasting[k] * A[k])
    return {"load": [total]}


def pass_on(let, T: V6, tip_map: V30, A: V6x6, load: V6) -> dict:
    """Contribution of everything beyond the tip to a segment: T^T A T to K, T^T load to b; ``A_0``
    to ``A_5`` are the rows of A.
    """
    entries = tip_matrix(tip_map)
    moved = [let("moved", sum((A[c][r] * T[c] for c in range(6)), 0)) for r in range(6)]
    K = [sum((entries[r, k] * moved[r] for r in range(6)), 0) for k in range(8)]
    return {"K": K, "b": [sum((load[r] * T[r] for r in range(6)), 0)]}


def free_coordinates(
    let, K: V8, b: V1, pitch_row: V8, yaw_row: V8, joint_load: V2, torques: V2
) -> dict:
    """Eliminate the coordinates, yaw first; the rows are the last of K, ``joint_load`` the last two
    entries of b.

    ``shares`` tell each coordinate's second derivative: minus the sum of (the entries of x before
    it, 1) times them.
    """
    # coefficients: yaw from its row, pitch from what is left of its own
    over_yaw = let("over_yaw", 1 / yaw_row[7])
    yaw_share = let("yaw_share", yaw_row[0:7, :] * over_yaw)
    left = let("left", pitch_row[0:7, :] - yaw_row[6] * yaw_share)
    over_pitch = let("over_pitch", 1 / left[6])
    pitch_share = let("pitch_share", left[0:6, :] * over_pitch)

    # right-hand sides
    yaw_load = let("yaw_load", joint_load[1] - torques[1])
    pitch_load = let(
        "pitch_load", (joint_load[0] - torques[0] - yaw_share[6] * yaw_load) * over_pitch
    )
    yaw_load = let("yaw_load", yaw_load * over_yaw)
    pitch_lanes = let("pitch_lanes", K[6] - yaw_share[6] * K[7])
    return {
        "A": [
            let("A", K[r] - yaw_share[r] * K[7]) - pitch_share[r] * pitch_lanes for r in range(6)
        ],
        "b_base": [let("b", b[0] - yaw_load * K[7]) - pitch_load * pitch_lanes],
        "shares": Matrix([*pitch_share, pitch_load, *yaw_share, yaw_load]),
        "pivots": Matrix([left[6], yaw_row[7]]),
        "over": Matrix([over_pitch, over_yaw]),
    }


def outward(let, tip_map: V30, shares: V15, coasting: V6, base: V6) -> dict:
    """Second derivatives of a segment's coordinates, and the motion of its tip, from the motion of
    its base.
    """
    pitch = let("pitch", -(shares[0:6, :].dot(base) + shares[6]))
    yaw = let("yaw", -(shares[7:13, :].dot(base) + shares[13] * pitch + shares[14]))
    free = Matrix([pitch, yaw])
    return {"accelerations": free, "base": coasting + tip_matrix(tip_map) * Matrix([base, free])}


def freed_inertia(let, torso_mass: V1, torso_inertia: V3, tail_mount: V3, A: V6x6) -> dict:
    """Inertia of torso and tail at B with free coordinates: lower triangle for (omega_dot, a),
    torso axes.
    """
    rows, swept = Matrix.hstack(*A).T, swept_by(tail_mount)

    # blocks of A moved from the mount to B, the torso added
    force, moment = rows[0:3, 0:3], rows[3:6, 0:3]
    coupling = let("coupling", moment + swept.T * force)
    turning = rows[3:6, 3:6] + moment * swept + swept.T * coupling.T
    H = Matrix(
        [
            [turning + diag(*torso_inertia), zeros(3, 3)],
            [coupling.T, force + diag(*[torso_mass[0]] * 3)],
        ]
    )
    return {f"H_{r}": H[r, 0 : r + 1].T for r in range(6)}


def freed_wrench(let, tail_mount: V3, a_mount: V3, A: V6x3, b_mount: V6) -> dict:
    """Wrench at B that moves a tail with free coordinates whose mount accelerates by ``a_mount``
    and does not turn.
    """
    F = let("F", b_mount + a_mount[0] * A[0] + a_mount[1] * A[1] + a_mount[2] * A[2])
    return {"F": Matrix([F[0:3, :], F[3:6, :] + tail_mount.cross(F[0:3, :])])}


def net_load(let, at_torso: V6, force: V3, moment: V3) -> dict:
    """Applied minus inertial loads at B, for (omega_dot, a)."""
    return {"rhs": Matrix([at_torso[3:6, :] - moment, at_torso[0:3, :] - force])}
