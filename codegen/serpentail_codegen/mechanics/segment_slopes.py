"""How small changes of motion and of loads pass from segment to segment.

A motion is (w, w_dot, a) of a frame, in its axes.  A segment's slopes tell how the motion of its
tip, and its wrench and torques (force, moment, two torques), change with w of its base; with w_dot
and a they change by T and the segment's inertia, as in ``free_segment``.  A lane of what is wide is
a direction in which the state changes.
"""

from sympy import Matrix

from .free_segment import tip_matrix
from .rotations import symmetric
from .shapes import V1, V2, V3, V6, V8, V9, V15, V30, V3x6, V3x8


def change_at_base(
    let, motion: V9, mass: V1, h: V3, I: V6, pitch: V6, yaw: V6, force: V3x8
) -> dict:
    """Change of wrench and torques with the motion of the base; accelerations act by the segment's
    own inertia.
    """
    w, w_dot, a = (motion[k : k + 3, :] for k in (0, 3, 6))
    by_w = Matrix([row.dot(w) for row in force])
    inertial, moment = mass[0] * a + w_dot.cross(h), h.cross(a) + symmetric(I) * w_dot
    torques = [p[0:3, :].dot(a) + p[3:6, :].dot(w_dot) for p in (pitch, yaw)]
    return {"change": by_w + Matrix([inertial, moment, Matrix(torques)])}


def change_at_tip(let, motion: V9, tip_map: V30, tip: V3x6) -> dict:
    """Change of the tip's motion with that of the base: ``tip_0`` to ``tip_5`` are the rows of
    (w_dot, a) by w, the rest is T.
    """
    w, w_dot, a = (motion[k : k + 3, :] for k in (0, 3, 6))
    T = tip_matrix(tip_map)[:, 0:6]
    by_w = Matrix([row.dot(w) for row in tip])
    moved = T * Matrix([a, w_dot])
    turned = T[3:6, 3:6] * w
    return {"motion": Matrix([turned, by_w[0:3, :] + moved[3:6, :], by_w[3:6, :] + moved[0:3, :]])}


def change_from_tip(let, tip_map: V30, wrench: V6) -> dict:
    """Change of wrench and torques with the wrench at the tip: T^T times it."""
    return {"change": tip_matrix(tip_map).T * wrench}


def freed_change(let, change: V8, shares: V15) -> dict:
    """Eliminate the coordinates: the wrench that is left, and the load that accelerates each of
    them.

    ``shares`` are those of ``free_segment.free_coordinates``.
    """
    pitch_share, yaw_share = shares[0:6, :], shares[7:14, :]
    yaw = change[7]
    pitch = let("pitch", change[6] - yaw_share[6] * yaw)
    return {
        "wrench": change[0:6, :] - yaw_share[0:6, :] * yaw - pitch_share * pitch,
        "free": Matrix([pitch, yaw]),
    }


def responding(let, tip_map: V30, shares: V15, over: V2, free: V2, base: V6) -> dict:
    """Second derivatives of the coordinates, and the acceleration of the tip, from that of the
    base; ``over`` is one over the pivots.
    """
    pitch = let("pitch", -(shares[0:6, :].dot(base) + free[0] * over[0]))
    yaw = let("yaw", -(shares[7:13, :].dot(base) + shares[13] * pitch + free[1] * over[1]))
    both = Matrix([pitch, yaw])
    return {"accelerations": both, "base": tip_matrix(tip_map) * Matrix([base, both])}


def accelerating_load(let, force: V3, moment: V3) -> dict:
    """The load that accelerates the torso, for (omega_dot, a): minus inertial force and moment."""
    return {"rhs": Matrix([-moment, -force])}


def mount_response(let, response: V6, tail_mount: V3) -> dict:
    """Acceleration and angular acceleration of the mount, from (omega_dot, a) of the torso."""
    w_dot, a = response[0:3, :], response[3:6, :]
    return {"base": Matrix([a + w_dot.cross(tail_mount), w_dot])}


def with_own(let, change: V8, own: V8) -> dict:
    """Add the segment's own change."""
    return {"change": change + own}
