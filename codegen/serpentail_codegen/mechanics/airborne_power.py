"""Virtual power of a piece of the tail, and the power of its momentum under a motion as one rigid
body.

Second derivatives of airborne motion are made from these.
"""

from sympy import Matrix

from .arc import segment_velocity
from .arc_inertia import segment_momentum
from .arc_wrench import segment_power
from .link import link_angular_velocity, link_linear_velocity, link_momentum, link_power
from .shapes import M33, V1, V2, V3, V4, V6, V8, V12, V16


def torso_momentum_power(
    let, torso_mass: V1, torso_inertia: V3, w: V3, drift: V3, w_rigid: V3, u_rigid: V3
) -> dict:
    """The torso's momentum at B times a virtual motion, torso axes."""
    spin = torso_inertia.multiply_elementwise(w)
    return {"power": [torso_mass[0] * drift.dot(u_rigid) + let("spin", spin).dot(w_rigid)]}


def link_power_and_momentum(
    let,
    joint: V4,
    rates: V2,
    accelerations: V2,
    virtual_rates: V2,
    link: V6,
    w: V3,
    w_dot: V3,
    a: V3,
    w_virtual: V3,
    u_virtual: V3,
    u: V3,
    w_rigid: V3,
    u_rigid: V3,
) -> dict:
    """``link_power``, and the link's momentum times a virtual motion of the animal as one rigid
    body; the velocity ``u`` and that motion are carried on, too.
    """
    power = link_power(
        let,
        joint,
        rates,
        accelerations,
        virtual_rates,
        link,
        w,
        w_dot,
        a,
        w_virtual,
        u_virtual,
    )
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
    rates: V2,
    accelerations: V2,
    virtual_rates: V2,
    shape: V16,
    section: V2,
    tip: V8,
    E: M33,
    r: V3,
    bend: V12,
    h_own: V3,
    I_own: V6,
    pitch_own: V6,
    yaw_own: V6,
    H_own: V3,
    w: V3,
    w_dot: V3,
    a: V3,
    w_virtual: V3,
    u_virtual: V3,
    u: V3,
    w_rigid: V3,
    u_rigid: V3,
) -> dict:
    """``segment_power``, and the segment's momentum times a virtual motion of the animal as one
    rigid body; the velocity ``u`` and that motion are carried on, too.
    """
    power = segment_power(
        let,
        angles,
        rates,
        accelerations,
        virtual_rates,
        shape,
        section,
        tip,
        E,
        r,
        bend,
        h_own,
        I_own,
        pitch_own,
        yaw_own,
        H_own,
        w,
        w_dot,
        a,
        w_virtual,
        u_virtual,
    )
    own = (section, h_own, I_own, pitch_own, yaw_own, H_own)
    F = let("momentum", segment_momentum(let, rates, *own, w, u)["F"])
    momentum = F[0:3, :].dot(u_rigid) + F[3:6, :].dot(w_rigid)
    real = segment_velocity(let, rates, E, r, bend, w, u)
    rigid = segment_velocity(let, Matrix([0, 0]), E, r, bend, w_rigid, u_rigid)
    carried = {"u": real["u"], "w_rigid": rigid["w"], "u_rigid": rigid["u"]}
    return power | carried | {"power": [power["power"][0] + momentum]}
