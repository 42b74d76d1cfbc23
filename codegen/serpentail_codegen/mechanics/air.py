"""What the air does to the animal, as minus a wrench: it is added to inertial wrenches.

``u`` is a velocity against the air. Across a piece of tail the force per length is -rho/2 C_n d |u|
u, along it -rho/2 C_t d |u| u (Morison et al., J. Petrol. Technol. 2 (1950) 149-154), with the
width d, and |u| smoothed by e. A link has the sum over its three Gauss points, an arc over four.
"""

from dataclasses import dataclass

from sympy import Float, Matrix, Rational, sqrt

from .link import link_angular_velocity, link_linear_velocity
from .rotations import Y
from .shapes import M33, V1, V2, V3, V4, V6, V12

OFF = Float(0.15**0.5)  # sqrt(3/5) / 2: of the outer points from the middle
HALF, END, MIDDLE = Rational(1, 2), Rational(5, 18), Rational(4, 9)  # weights of both sorts


@dataclass(frozen=True)
class Drag:
    """The law of the tail: density, coefficients across and along, smoothing speed, and the widths
    at both ends of a piece.
    """

    air_density: V1
    tail_drag: V2
    tail_drag_speed: V1
    tail_widths: V2


@dataclass(frozen=True)
class TorsoDrag:
    """The law of the torso."""

    air_density: V1
    tail_drag_speed: V1
    torso_drag: V3
    torso_drag_turning: V3
    torso_air_damping: V3


@dataclass(frozen=True)
class Slice:
    """A slice of an arc: its share of the length from the root and its weight, and how the part up
    to it is bent and moves with its own bend.
    """

    slice: V2
    E: M33
    r: V3
    bend: V12


@dataclass(frozen=True)
class Flow:
    """Angular velocity of a frame and velocity of its origin against the air; the same of a virtual
    motion.
    """

    w: V3
    u: V3
    w_virtual: V3
    u_virtual: V3


def relative_velocity(let, R: M33, p_dot: V3, wind: V3) -> dict:
    """Velocity of B against the air, in torso axes: R_b^T (p_b_dot - wind)."""
    return {"u": R.T * let("against", p_dot - wind)}


def negated(let, minus: V1) -> dict:
    """A number of the opposite sign."""
    return {"force": -minus}


def speed(let, drag, *components):
    """Return |u|, smoothed."""
    squares = sum(x * x for x in (*components, drag.tail_drag_speed[0]))
    return let("speed", sqrt(let("square", squares)))


def link_drag(let, drag: Drag, link: V6, w: V3, u_joint: V3) -> dict:
    """Minus the wrench of the air on a link at its joint, in the link frame."""
    length, (root, tip) = link[1], drag.tail_widths
    pressure = let("pressure", drag.air_density[0] * length / 2)
    swing = let("swing", length * Matrix([w[2], 0, -w[0]]))  # what the whole link adds to u
    middle, off = let("middle", u_joint + swing / 2), let("off", OFF * swing)
    f = []
    for side, weight in ((-1, END), (0, MIDDLE), (1, END)):
        x, _, z = let("u", middle + side * off)
        width = weight * ((HALF - side * OFF) * root + (HALF + side * OFF) * tip)
        f.append(let("pull", width * speed(let, drag, x, z)) * Matrix([x, 0, z]))
    across = let("across", f[0] + f[1] + f[2])
    lever = across / 2 + OFF * (f[2] - f[0])
    normal = let("normal", pressure * drag.tail_drag[0])
    axial = pressure * drag.tail_drag[1] * (root + tip) / 2
    along = axial * speed(let, drag, u_joint[1]) * u_joint[1]
    return {"F": Matrix([normal * across + along * Y, normal * length * lever.cross(Y)])}


def link_drag_power(
    let, joint: V4, rates: V2, virtual_rates: V2, drag: Drag, link: V6, flow: Flow
) -> dict:
    """Power of minus that wrench under a virtual motion; ``u`` is carried to the next joint."""
    w = let("w", link_angular_velocity(let, joint, rates, flow.w)["w"])
    own = {k: let(k, x) for k, x in link_linear_velocity(let, joint, link, w, flow.u).items()}
    F = let("F", link_drag(let, drag, link, w, own["u_joint"])["F"])
    turn = let("turn", link_angular_velocity(let, joint, virtual_rates, flow.w_virtual)["w"])
    slide = link_linear_velocity(let, joint, link, turn, flow.u_virtual)["u_joint"]
    return {"power": [F[0:3, :].dot(slide) + F[3:6, :].dot(turn)], "u": own["u"]}


def torso_drag(let, drag: TorsoDrag, w: V3, u: V3) -> dict:
    """Minus force and moment of the air on the torso at B."""
    half = let("half", drag.air_density[0] / 2)
    push = let("push", half * speed(let, drag, *u))
    turn = let("turn", half * speed(let, drag, *w)) * drag.torso_drag_turning
    return {
        "force": push * drag.torso_drag.multiply_elementwise(u),
        "moment": (turn + drag.torso_air_damping).multiply_elementwise(w),
    }


def torso_drag_power(let, drag: TorsoDrag, flow: Flow) -> dict:
    """Power of that under a virtual motion."""
    air = {name: let(name, x) for name, x in torso_drag(let, drag, flow.w, flow.u).items()}
    return {"power": [air["force"].dot(flow.u_virtual) + air["moment"].dot(flow.w_virtual)]}


def part_of_arc(let, angles: V2, section: V2, slice: V2) -> dict:
    """Bend, mass and length of the part of an arc up to a slice."""
    return {"angles": slice[0] * angles, "section": slice[0] * section}


def slice_drag(let, drag: Drag, section: V2, at: Slice, rates: V2, w: V3, u: V3) -> tuple:
    """Return minus the force of the air on a slice of an arc, in root axes, and how the slice moves
    with both rates.
    """
    share, weight = at.slice
    moves = [let("move", share * at.bend[k : k + 3, :]) for k in (3, 9)]
    v = let("v", u + w.cross(at.r) + rates[0] * moves[0] + rates[1] * moves[1])
    axis = at.E.col(1)
    along = let("along", v.dot(axis))
    across = let("across", v - along * axis)
    root, tip = drag.tail_widths
    width = root + share * (tip - root)
    push = let("push", drag.air_density[0] * section[1] * weight * width / 2)
    normal, axial = drag.tail_drag
    pull = push * normal * speed(let, drag, *across)
    return let("f", pull * across + push * axial * speed(let, drag, along) * along * axis), moves


def arc_drag(let, drag: Drag, section: V2, at: Slice, rates: V2, w: V3, u: V3) -> dict:
    """What a slice adds to minus the wrench of the air on an arc at its root, and to the
    generalised forces.
    """
    f, moves = slice_drag(let, drag, section, at, rates, w, u)
    return {"F": Matrix([f, at.r.cross(f)]), "torque_own": [f.dot(move) for move in moves]}


def arc_drag_power(
    let, drag: Drag, section: V2, at: Slice, rates: V2, virtual_rates: V2, flow: Flow
) -> dict:
    """Power of what a slice adds under a virtual motion."""
    f, moves = slice_drag(let, drag, section, at, rates, flow.w, flow.u)
    slide = flow.u_virtual + flow.w_virtual.cross(at.r)
    slide += virtual_rates[0] * moves[0] + virtual_rates[1] * moves[1]
    return {"power": [f.dot(slide)]}
