"""The steps of a hinge: a joint that turns about one axis, and the body beyond it.

``joint`` = (cos, sin) of its angle. ``body`` = (m, b, I, r): mass, first moment (3) and inertia
(xx, yy, zz, xy, xz, yz) about the joint, and where the next joint is (3). ``rotor`` is the inertia
of the motor's rotor, times the square of the gear ratio, which resists the angle alone. The setting
``kind`` begins with the axis, x, y or z of the frame before, and says what is 0: "along": all of
the body that is not on -y; "bare": the whole body; without "geared" the rotor. Other vectors are as
in `link`.
"""

from dataclasses import dataclass
from typing import Any

from sympy import Matrix, cos, diag, eye, sin, zeros

from .link import turned_inertia
from .rotations import entries, symmetric, turned
from .shapes import M33, V1, V2, V3, V5, V6, V13, FrameMotion, VirtualMotion


@dataclass(frozen=True)
class Hinge:
    """The numbers of a hinge: ``twice`` are those of its doubled angle."""

    joint: V2
    twice: V5
    rotor: V1
    body: V13


@dataclass(frozen=True)
class HingeMotion:
    """Rate and acceleration of a hinge's angle, and a virtual rate."""

    rates: V1
    accelerations: V1
    virtual_rates: V1


@dataclass(frozen=True)
class Known:
    """A hinge of some kind: numbers of the axes that it turns, and of its own, its rotation and
    axis, rotor and body.
    """

    axes: tuple[int, int, int]
    turn: Matrix
    axis: Matrix
    rotor: Any
    mass: Any
    first: Matrix
    about: Matrix
    tip: Matrix


def known(hinge: Hinge, kind: str) -> Known:
    """Return a hinge with zeros where its kind says so."""
    k = "xyz".index(kind[0])
    i, j = (k + 1) % 3, (k + 2) % 3
    turn, body = eye(3), hinge.body
    turn[i, i] = turn[j, j] = hinge.joint[0]
    turn[i, j], turn[j, i] = -hinge.joint[1], hinge.joint[1]
    if "along" in kind:
        body = Matrix([*body[0:1], 0, body[2], 0, *body[4:7], 0, 0, 0, 0, body[11], 0])
    body = zeros(13, 1) if "bare" in kind else body
    parts = body[0], body[1:4, :], body[4:10, :], body[10:13, :]
    rotor = hinge.rotor[0] if "geared" in kind else 0
    return Known((i, j, k), turn, eye(3).col(k), rotor, *parts)


def along_body(let, link_masses: V1, link_lengths: V1, link_centers: V1, link_inertias: V3) -> dict:
    """A body along -y, its COM ``link_centers`` from the joint."""
    center = Matrix([0, -link_centers[0], 0])
    return placed_body(let, link_masses, Matrix([0, -link_lengths[0], 0]), center, link_inertias)


def placed_body(let, link_masses: V1, link_tips: V3, link_offsets: V3, link_inertias: V3) -> dict:
    """A body with its COM and the next joint anywhere."""
    c = link_offsets
    first = let("b", link_masses[0] * c)
    about = diag(*link_inertias) + let("square", first.dot(c)) * eye(3) - first * c.T
    return {"body": Matrix([link_masses[0], *first, *entries(about), *link_tips])}


def hinge_trigonometry(let, angles: V1) -> dict:
    """Cosine and sine of the angle."""
    return {"joint": Matrix([cos(angles[0]), sin(angles[0])])}


def hinge_double_angle(let, joint: V2) -> dict:
    """s^2, s c, 2 s c, c^2 - s^2 and c^2: what turns a symmetric tensor."""
    c, s = joint
    square, product = let("k", Matrix([s * s, s * c]))
    return {"twice": Matrix([square, product, 2 * product, 1 - 2 * square, c * c])}


def hinge_pose(let, hinge: Hinge, R: M33, P: V3, kind="x") -> dict:
    """Attitude beyond the hinge, and place of the next joint."""
    own = known(hinge, kind)
    R = let("turned", R * own.turn)
    return {"R": R, "P": P + R * own.tip}


def hinge_twist(let, hinge: Hinge, R: M33, P: V3, kind="x") -> dict:
    """Spatial column of the hinge at B."""
    axis = R * known(hinge, kind).axis
    return {"S": Matrix([axis, P.cross(axis)])}


def hinge_at_torso(let, R: M33, P: V3, column: V6) -> dict:
    """Momentum column of the hinge, from its frame at ``P`` to the torso frame at B."""
    force = let("force", R * column[0:3, :])
    return {"columns": Matrix([force, R * column[3:6, :] + P.cross(force)])}


def moved(let, own: Known, moving: HingeMotion, base: FrameMotion) -> FrameMotion:
    """Return the motion of the frame beyond the hinge."""
    before, spin = let("w_before", own.turn.T * base.w), moving.rates[0] * own.axis
    w_dot = own.turn.T * base.w_dot + moving.accelerations[0] * own.axis + before.cross(spin)
    w, a = let("w_here", before + spin), let("a_here", own.turn.T * base.a)
    return FrameMotion(w, let("w_dot_here", w_dot), a)


def wrench_of(let, own: Known, at: FrameMotion) -> Matrix:
    """Return the inertial wrench of a body at its joint."""
    swing, I = let("swing", at.w.cross(own.first)), symmetric(own.about)
    force = own.mass * at.a + at.w_dot.cross(own.first) + at.w.cross(swing)
    moment = I * at.w_dot + at.w.cross(let("I_w", I * at.w)) + own.first.cross(at.a)
    return Matrix([force, moment])


def carried(let, own: Known, at: FrameMotion) -> dict:
    """Return the motion of the frame at the next joint."""
    sling = let("sling", at.w.cross(own.tip))
    a = at.a + at.w_dot.cross(own.tip) + at.w.cross(sling)
    return {"w": at.w, "w_dot": at.w_dot, "a": a}


def hinge_motion(let, hinge: Hinge, moving: HingeMotion, base: FrameMotion, kind="x") -> dict:
    """Carry the motion over the hinge; the body's inertial wrench at the joint, the rotor's
    torque.
    """
    own = known(hinge, kind)
    at, torque = moved(let, own, moving, base), own.rotor * moving.accelerations[0]
    return {"F": wrench_of(let, own, at), "torque_own": [torque], **carried(let, own, at)}


def hinge_power(
    let, hinge: Hinge, moving: HingeMotion, base: FrameMotion, virtual: VirtualMotion, kind="x"
) -> dict:
    """Power of the body's inertial wrench and of the rotor under a virtual motion; both motions
    carried on.
    """
    own = known(hinge, kind)
    at = moved(let, own, moving, base)
    F, rate = let("F", wrench_of(let, own, at)), moving.virtual_rates[0]
    turn = let("turn", own.turn.T * virtual.w_virtual + rate * own.axis)
    slide = let("slide", own.turn.T * virtual.u_virtual)
    power = F[0:3, :].dot(slide) + F[3:6, :].dot(turn)
    power += own.rotor * moving.accelerations[0] * rate
    beyond = {"w_virtual": turn, "u_virtual": slide + turn.cross(own.tip)}
    return {"power": [power], **carried(let, own, at), **beyond}


def hinge_momentum(let, hinge: Hinge, moving: HingeMotion, w: V3, u: V3, kind="x") -> dict:
    """Carry angular and linear velocity over the hinge; momentum at the joint, kinetic energy."""
    own, rate = known(hinge, kind), moving.rates[0]
    w, u = let("w_here", own.turn.T * w + rate * own.axis), let("u_here", own.turn.T * u)
    p = let("p", own.mass * u + w.cross(own.first))
    L = let("L", symmetric(own.about) * w + own.first.cross(u))
    kinetic = (u.dot(p) + w.dot(L) + own.rotor * rate**2) / 2
    return {"F": Matrix([p, L]), "kinetic": [kinetic], "w": w, "u": u + w.cross(own.tip)}


def gather_hinge(let, hinge: Hinge, mass: V1, h: V3, I: V6, kind="x") -> dict:
    """Composite of the body and all beyond in the frame before the hinge, its momentum column, and
    its entry of H.
    """
    own = known(hinge, kind)
    at_tip = let("at_tip", h + mass[0] * own.tip)
    spread = let("spread", (h + at_tip).dot(own.tip))
    about = symmetric(I) + spread * eye(3) - (h * own.tip.T + own.tip * at_tip.T)
    h, I = let("h_sum", at_tip + own.first), let("I_sum", entries(about) + own.about)
    column = Matrix([own.axis.cross(h), symmetric(I) * own.axis])
    return {
        "mass": mass + Matrix([own.mass]),
        "h": own.turn * h,
        "I": turned_inertia(let, own.axes, own.turn, hinge.twice, I),
        "column": turned(let, "out", own.turn, column),
        "H_own": [I[own.axes[2]] + own.rotor],
    }


def gather_hinge_wrench(let, hinge: Hinge, F: V6, F_next: V6, torque_own: V1, kind="x") -> dict:
    """Add what all beyond passes on, read the torque, pass on to the frame before the hinge."""
    own, force = known(hinge, kind), F_next[0:3, :]
    beyond = Matrix([force, F_next[3:6, :] + own.tip.cross(force)])
    total = let("total", beyond if "bare" in kind else F + beyond)
    torque = total[3 + own.axes[2]] + (torque_own[0] if "geared" in kind else 0)
    return {"F_next": turned(let, "out", own.turn, total), "torque": [torque]}


def gather_hinge_moment(let, hinge: Hinge, mass: V1, h: V3, kind="x") -> dict:
    """Mass and first moment of the body and all beyond, in the frame before the hinge."""
    own = known(hinge, kind)
    moment = let("moment", h + mass[0] * own.tip + own.first)
    return {"mass": mass + Matrix([own.mass]), "h": own.turn * moment}
