"""The steps of a hinge: a joint that turns about one axis, and the body beyond it.

``joint`` = (cos, sin) of its angle; ``axis`` is x, y or z of the frame before it. ``body`` = (m, b,
I, r): mass, first moment (3) and inertia (xx, yy, zz, xy, xz, yz) about the joint, and where the
next joint is (3). ``form`` says which of them are 0: of an "along" body what is not on -y, where it
and the next joint lie; of a "bare" hinge all. A ``geared`` hinge has the inertia ``rotor`` of its
motor's rotor, times the square of the gear ratio, which resists its own angle alone. Other vectors
are as in `link`.
"""

from dataclasses import dataclass
from typing import Any

from sympy import Matrix, cos, diag, eye, sin, zeros

from .link import turned_inertia
from .rotations import entries, symmetric, turned
from .shapes import M33, V1, V2, V3, V5, V6, V13, FrameMotion, VirtualMotion


@dataclass(frozen=True)
class HingeMotion:
    """Rate and acceleration of a hinge's angle, and a virtual rate."""

    rates: V1
    accelerations: V1
    virtual_rates: V1


@dataclass(frozen=True)
class Body:
    """A hinge's body: mass, first moment and inertia about the joint, place of the next joint."""

    mass: Any
    first: Matrix
    about: Matrix
    tip: Matrix


def body_of(form: str, body: Matrix) -> Body:
    """Return a body, in which numbers are 0 that its form says to be so."""
    if form == "bare":
        return Body(0, zeros(3, 1), zeros(6, 1), zeros(3, 1))
    mass, b, about, tip = body[0], body[1:4, :], body[4:10, :], body[10:13, :]
    if form != "along":
        return Body(mass, b, about, tip)
    return Body(mass, Matrix([0, b[1], 0]), Matrix([*about[0:3], 0, 0, 0]), Matrix([0, tip[1], 0]))


def axes_of(axis: str) -> tuple[int, int, int]:
    """Return the numbers of the two axes that a hinge turns, and of its own."""
    k = "xyz".index(axis)
    return (k + 1) % 3, (k + 2) % 3, k


def turn_of(axis: str, joint: Matrix) -> Matrix:
    """Return the rotation of a hinge."""
    (i, j, _), R = axes_of(axis), eye(3)
    R[i, i] = R[j, j] = joint[0]
    R[i, j], R[j, i] = -joint[1], joint[1]
    return R


def unit(axis: str) -> Matrix:
    """Return the axis as a vector."""
    return eye(3).col(axes_of(axis)[2])


def along_body(let, link_masses: V1, link_lengths: V1, link_centers: V1, link_inertias: V3) -> dict:
    """A body along -y, its COM ``link_centers`` from the joint."""
    m, center = link_masses[0], link_centers[0]
    first = let("b", m * center)
    steiner = let("steiner", first * center)
    Ix, Iy, Iz = link_inertias
    about = [Ix + steiner, Iy, Iz + steiner, 0, 0, 0]
    return {"body": Matrix([m, 0, -first, 0, *about, 0, -link_lengths[0], 0])}


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


def hinge_pose(let, joint: V2, body: V13, R: M33, P: V3, axis="x", form="") -> dict:
    """Attitude beyond the hinge, and place of the next joint."""
    turned_R = let("turned", R * turn_of(axis, joint))
    return {"R": turned_R, "P": P + turned_R * body_of(form, body).tip}


def hinge_twist(let, R: M33, P: V3, axis="x") -> dict:
    """Spatial column of the hinge at B."""
    e = R * unit(axis)
    return {"S": Matrix([e, P.cross(e)])}


def hinge_at_torso(let, R: M33, P: V3, column: V6) -> dict:
    """Momentum column of the hinge, from its frame at ``P`` to the torso frame at B."""
    force = let("force", R * column[0:3, :])
    return {"columns": Matrix([force, R * column[3:6, :] + P.cross(force)])}


def _moved(let, axis, joint, rates, accelerations, base) -> FrameMotion:
    """Return the motion of the frame beyond the hinge."""
    back, e = turn_of(axis, joint).T, unit(axis)
    before, spin = let("w_before", back * base.w), rates[0] * e
    w_dot = back * base.w_dot + accelerations[0] * e + before.cross(spin)
    return FrameMotion(
        let("w_here", before + spin), let("w_dot_here", w_dot), let("a_here", back * base.a)
    )


def _wrench(let, body: Body, at: FrameMotion) -> Matrix:
    """Return the inertial wrench of a body at its joint."""
    swing = let("swing", at.w.cross(body.first))
    force = body.mass * at.a + at.w_dot.cross(body.first) + at.w.cross(swing)
    I = symmetric(body.about)
    moment = I * at.w_dot + at.w.cross(let("I_w", I * at.w)) + body.first.cross(at.a)
    return Matrix([force, moment])


def _carried(let, body: Body, at: FrameMotion) -> dict:
    """Return the motion of the frame at the next joint."""
    sling = let("sling", at.w.cross(body.tip))
    a = at.a + at.w_dot.cross(body.tip) + at.w.cross(sling)
    return {"w": at.w, "w_dot": at.w_dot, "a": a}


def hinge_motion(
    let,
    joint: V2,
    rates: V1,
    accelerations: V1,
    rotor: V1,
    body: V13,
    base: FrameMotion,
    axis="x",
    form="",
    geared=False,
) -> dict:
    """Carry the motion over the hinge; the body's inertial wrench at the joint, the rotor's
    torque.
    """
    at, own = _moved(let, axis, joint, rates, accelerations, base), body_of(form, body)
    torque = {"torque_own": [rotor[0] * accelerations[0]]} if geared else {}
    return {"F": _wrench(let, own, at), **torque, **_carried(let, own, at)}


def hinge_power(
    let,
    joint: V2,
    moving: HingeMotion,
    rotor: V1,
    body: V13,
    base: FrameMotion,
    virtual: VirtualMotion,
    axis="x",
    form="",
    geared=False,
) -> dict:
    """Power of the body's inertial wrench under a virtual motion; both motions carried on."""
    at, own = (
        _moved(let, axis, joint, moving.rates, moving.accelerations, base),
        body_of(form, body),
    )
    F, back = let("F", _wrench(let, own, at)), turn_of(axis, joint).T
    turn = let("turn", back * virtual.w_virtual + moving.virtual_rates[0] * unit(axis))
    slide = let("slide", back * virtual.u_virtual)
    power = F[0:3, :].dot(slide) + F[3:6, :].dot(turn)
    if geared:
        power += rotor[0] * moving.accelerations[0] * moving.virtual_rates[0]
    carried = {"w_virtual": turn, "u_virtual": slide + turn.cross(own.tip)}
    return {"power": [power], **_carried(let, own, at), **carried}


def hinge_momentum(
    let,
    joint: V2,
    rates: V1,
    rotor: V1,
    body: V13,
    w: V3,
    u: V3,
    axis="x",
    form="",
    geared=False,
) -> dict:
    """Carry angular and linear velocity over the hinge; momentum at the joint, kinetic energy."""
    own, back = body_of(form, body), turn_of(axis, joint).T
    w, u = let("w_here", back * w + rates[0] * unit(axis)), let("u_here", back * u)
    p = let("p", own.mass * u + w.cross(own.first))
    L = let("L", symmetric(own.about) * w + own.first.cross(u))
    twice = u.dot(p) + w.dot(L) + (rotor[0] * rates[0] ** 2 if geared else 0)
    return {"F": Matrix([p, L]), "kinetic": [twice / 2], "w": w, "u": u + w.cross(own.tip)}


def gather_hinge(
    let,
    joint: V2,
    twice: V5,
    rotor: V1,
    body: V13,
    mass: V1,
    h: V3,
    I: V6,
    axis="x",
    form="",
    geared=False,
) -> dict:
    """Composite of the body and all beyond in the frame before the hinge, its momentum column, and
    its entry of H.
    """
    own, (i, j, k) = body_of(form, body), axes_of(axis)
    at_tip = let("at_tip", h + mass[0] * own.tip)
    spread = let("spread", (h + at_tip).dot(own.tip))
    moved = symmetric(I) + spread * eye(3) - (h * own.tip.T + own.tip * at_tip.T)
    h, I = let("h_sum", at_tip + own.first), let("I_sum", entries(moved) + own.about)
    turn, e = turn_of(axis, joint), unit(axis)
    return {
        "mass": mass + Matrix([own.mass]),
        "h": turn * h,
        "I": turned_inertia(let, (i, j, k), turn, twice, I),
        "column": turned(let, "out", turn, Matrix([e.cross(h), symmetric(I) * e])),
        "H_own": [I[k] + (rotor[0] if geared else 0)],
    }


def gather_hinge_wrench(
    let, joint: V2, body: V13, F: V6, F_next: V6, torque_own: V1, axis="x", form="", geared=False
) -> dict:
    """Add what all beyond passes on, read the torque, pass on to the frame before the hinge."""
    force = F_next[0:3, :]
    moved = Matrix([force, F_next[3:6, :] + body_of(form, body).tip.cross(force)])
    total = let("total", (F if form != "bare" else zeros(6, 1)) + moved)
    torque = total[3 + axes_of(axis)[2]] + (torque_own[0] if geared else 0)
    return {"F_next": turned(let, "out", turn_of(axis, joint), total), "torque": [torque]}


def gather_hinge_moment(let, joint: V2, body: V13, mass: V1, h: V3, axis="x", form="") -> dict:
    """Mass and first moment of the body and all beyond, in the frame before the hinge."""
    own = body_of(form, body)
    moment = let("moment", h + mass[0] * own.tip + own.first)
    return {"mass": mass + Matrix([own.mass]), "h": turn_of(axis, joint) * moment}
