"""Virtual power of a piece of the tail, and the power of its momentum under a motion as one rigid
body.

Second derivatives of airborne motion are made from these.
"""

from sympy import Matrix

from .arc import ArcTip, segment_velocity
from .arc_inertia import ArcInertia, segment_momentum
from .arc_wrench import segment_power
from .link import link_angular_velocity, link_linear_velocity, link_momentum, link_power
from .shapes import (
    V1,
    V2,
    V3,
    V4,
    V6,
    V8,
    V16,
    CoordinateMotion,
    FrameMotion,
    VirtualMotion,
)


def torso_momentum_power(
    let, torso_mass: V1, torso_inertia: V3, w: V3, drift: V3, w_rigid: V3, u_rigid: V3
) -> dict:
    """The torso's momentum at B times a virtual motion, torso axes."""
    spin = torso_inertia.multiply_elementwise(w)
    return {"power": [torso_mass[0] * drift.dot(u_rigid) + let("spin", spin).dot(w_rigid)]}


def link_power_and_momentum(
    let,
    joint: V4,
    moving: CoordinateMotion,
    link: V6,
    base: FrameMotion,
    virtual: VirtualMotion,
    u: V3,
    w_rigid: V3,
    u_rigid: V3,
) -> dict:
    """``link_power``, and the link's momentum times a virtual motion of the animal as one rigid
    body; the velocity ``u`` and that motion are carried on, too.
    """
    power = link_power(let, joint, moving, link, base, virtual)
    real = {k: let(k, x) for k, x in link_linear_velocity(let, joint, link, power["w"], u).items()}
    F = let("p", link_momentum(let, link, power["w"], real["u_joint"])["F"])

    # the rigid motion of the link, without rates of its joint
    turn = let("turn", link_angular_velocity(let, joint, Matrix([0, 0]), w_rigid)["w"])
    slide = {k: let(k, x) for k, x in link_linear_velocity(let, joint, link, turn, u_rigid).items()}
    momentum = F[0:3, :].dot(slide["u_joint"]) + F[3:6, :].dot(turn)
    carried = {"u": real["u"], "w_rigid": turn, "u_rigid": slide["u"]}
    return power | carried | {"power": [power["power"][0] + momentum]}


def segment_power_and_momentum(
    let,
    angles: V2,
    moving: CoordinateMotion,
    shape: V16,
    section: V2,
    tip: V8,
    end: ArcTip,
    own: ArcInertia,
    root: FrameMotion,
    virtual: VirtualMotion,
    u: V3,
    w_rigid: V3,
    u_rigid: V3,
) -> dict:
    """``segment_power``, and the segment's momentum times a virtual motion of the animal as one
    rigid body; the velocity ``u`` and that motion are carried on, too.
    """
    power = segment_power(let, angles, moving, shape, section, tip, end, own, root, virtual)
    F = let("momentum", segment_momentum(let, moving.rates, section, own, root.w, u)["F"])
    momentum = F[0:3, :].dot(u_rigid) + F[3:6, :].dot(w_rigid)
    real = segment_velocity(let, moving.rates, end, root.w, u)
    rigid = segment_velocity(let, Matrix([0, 0]), end, w_rigid, u_rigid)
    carried = {"u": real["u"], "w_rigid": rigid["w"], "u_rigid": rigid["u"]}
    return power | carried | {"power": [power["power"][0] + momentum]}
