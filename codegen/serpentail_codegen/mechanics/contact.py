"""A point that can touch the ground: how it moves, what the ground does to it (Sect. 2.4).

Points are given by ``arm``, from B in world axes, and ``velocity``, in the world.  The ground is z
= 0.  A bristle is what the friction spring of a point is stretched by, in the world's x and y.
"""

from functools import partial

from sympy import Matrix, Piecewise, sqrt

from .shapes import M33, V1, V2, V3, V6, V12


def point_on_torso(let, R: M33, p_dot: V3, omega: V3, place: V3, drift: V3) -> dict:
    """Arm and velocity of a point at ``place`` in the torso frame, which moves there at
    ``drift``.
    """
    return {"arm": R * place, "velocity": p_dot + R * let("relative", omega.cross(place) + drift)}


def lowest_point(let, R: M33, torso_semi_axes: V3) -> dict:
    """The lowest point of the torso, an ellipsoid about B: place = -D^2 n / |D n|, n = R_b^T z, D
    its semi-axes.
    """
    scaled = let("D_n", torso_semi_axes.multiply_elementwise(R.row(2).T))
    length = let("length", sqrt(let("square", scaled.dot(scaled))))
    return {"place": -torso_semi_axes.multiply_elementwise(scaled) * let("inverse", 1 / length)}


def torso_twist(let, R: M33, p_dot: V3, omega: V3) -> dict:
    """Angular velocity and velocity at B of the torso, world axes: the twists of the tail start
    from it.
    """
    return {"turn": R * omega, "slide": p_dot}


def carried_twist(let, S: V12, rates: V2) -> dict:
    """Contribution of one joint or bend to the twist about B of everything beyond."""
    each = [rate * S[6 * k : 6 * k + 6, :] for k, rate in enumerate(rates)]
    total = sum(each[1:], each[0])
    return {"turn": total[0:3, :], "slide": total[3:6, :]}


def point_on_tail(let, P: V3, turn: V3, slide: V3) -> dict:
    """Arm and velocity of a point at ``P`` from B of a body with a twist about B."""
    return {"arm": P, "velocity": slide + turn.cross(P)}


def position(let, p: V3, arm: V3) -> dict:
    """A point in the world."""
    return {"position": p + arm}


def height(let, p: V3, arm: V3, velocity: V3) -> dict:
    """Height of a point above the ground, and the rate at which it rises."""
    return {"height": [p[2] + arm[2], velocity[2]]}


def ground_power(let, velocity: V3, force: V3) -> dict:
    """Power of the ground on a point that moves in the world."""
    return {"power": [velocity.dot(force)]}


def leg_power(let, R: M33, drift: V3, force: V3) -> dict:
    """Power of the drive that moves a point in the torso at ``drift`` against a force on it."""
    return {"power": [-(R * drift).dot(force)]}


def bristle_properties(let, K_f: V1, D_f: V1) -> dict:
    """Damping D_f K_f of a bristle, and its inverse."""
    return {"drag": D_f * K_f[0], "mobility": [let("mobility", 1 / (D_f[0] * K_f[0]))]}


def guarded(let, value, positive):
    """Return a value if a condition number is positive, else 1, so that roots and quotients are
    defined.
    """
    return let("safe", Piecewise((value, positive > 0), (1, True)))


def normal_force(let, depth, rate, K_n, D_n, side=None):
    """max(K_n z^(3/2) + D_n K_n z^(1/2) z_dot, 0) (Eq. 36); the text's z^3/2 is z^(3/2)."""
    root = let("root", sqrt(guarded(let, depth, depth)))
    push = let("push", K_n[0] * root * (depth + D_n[0] * rate))
    none = push < 0 if side is None else side <= 0
    pressing = let("pressing", Piecewise((0, none), (push, True)))  # a NaN stays one
    return let("f_n", Piecewise((pressing, depth > 0), (0, True)))


def cone(let, trial, limit, side=None) -> Matrix:
    """The trial force, shortened to the limit in any direction: Coulomb's law."""
    length = let("t_t", trial.dot(trial))
    excess = let("excess", length - limit**2) if side is None else side
    present = excess if side is None else length  # where it slides, but the trial force is none
    shorter = let("shorter", limit / let("length", sqrt(guarded(let, length, present))))
    return trial * let("scale", Piecewise((shorter, excess > 0), (1, True)))


def clamped(let, trial, limit) -> Matrix:
    """The trial force, each component clamped to the limit (Eq. 37)."""
    low = let("low", trial.applyfunc(lambda t: Piecewise((limit, t > limit), (t, True))))
    return low.applyfunc(lambda t: Piecewise((-limit, t < -limit), (t, True)))


def smooth(let, trial, limit) -> Matrix:
    """A smooth cone, f = t / sqrt(1 + |t|^2 / limit^2): for derivatives."""
    total = let("total", sqrt(guarded(let, let("sum", limit**2 + trial.dot(trial)), limit)))
    return trial * let("scale", limit / total)


FRICTION = {"cone": cone, "smooth": smooth, "paper": clamped}


def bristle_rate(let, K_f, mobility, bristle, sliding, friction: str, depth, force) -> Matrix:
    """-(f + K_f u) / (D_f K_f): slip while the point sticks, what keeps f while it slides,
    relaxation in the air.

    ``paper``: slip as long as the point is in the ground, the anchor of Eq. 37 staying where it
    was.
    """
    relaxing = -(force + K_f[0] * bristle) * mobility[0]
    if friction != "paper":
        return relaxing
    return Matrix([Piecewise((sliding[k], depth > 0), (relaxing[k], True)) for k in (0, 1)])


def contact_force(
    let,
    K_n: V1,
    D_n: V1,
    K_f: V1,
    mu: V1,
    drag: V1,
    mobility: V1,
    p: V3,
    arm: V3,
    velocity: V3,
    bristle: V2,
    side: V2,
    friction: str = "cone",
    sided: bool = False,
) -> dict:
    """Force of the ground on one point (Eqs. 35 to 37), world axes, and the rate of its bristle.

    The friction spring restores toward the anchor and opposes slip: Eq. 37 lacks that sign. sided:
    ``side`` is positive where the point presses, and where it slides; then nothing has a kink.
    """
    depth, sliding = let("z", -(p[2] + arm[2])), velocity[0:2, :]
    f_n = normal_force(let, depth, -velocity[2], K_n, D_n, side[0] if sided else None)
    trial = let("trial", -(K_f[0] * bristle + drag[0] * sliding))
    law = partial(cone, side=side[1]) if sided and friction == "cone" else FRICTION[friction]
    force = let("f_t", law(let, trial, let("limit", mu[0] * f_n)))
    rate = bristle_rate(let, K_f, mobility, bristle, sliding, friction, depth, force)
    return {"force": Matrix([force, Matrix([f_n])]), "rate": rate}


def point_margins(
    let,
    K_n: V1,
    D_n: V1,
    K_f: V1,
    mu: V1,
    drag: V1,
    p: V3,
    arm: V3,
    velocity: V3,
    bristle: V2,
) -> dict:
    """What changes sign where the force of a point has a kink: its height, where it touches; z +
    D_n z_dot, where it ceases to press in the ground; |t|^2 - (mu f_n)^2, where it begins to slide.
    """
    depth = let("z", -(p[2] + arm[2]))
    trial = let("trial", K_f[0] * bristle + drag[0] * velocity[0:2, :])
    limit = let("limit", mu[0] * normal_force(let, depth, -velocity[2], K_n, D_n))
    return {"margin": [-depth, depth - D_n[0] * velocity[2], trial.dot(trial) - limit**2]}


def load_about_torso(let, arm: V3, force: V3) -> dict:
    """Force and moment at B of the force on a point, world axes (Eq. 10)."""
    return {"load": Matrix([force, arm.cross(force)])}


def load_in_torso(let, R: M33, load: V6) -> dict:
    """Force and moment at B in torso axes."""
    R = R.T
    return {"load_force": R * load[0:3, :], "load_moment": R * load[3:6, :]}


def load_power(let, load_force: V3, load_moment: V3, u_virtual: V3, w_virtual: V3) -> dict:
    """Minus the power of a load at B, all in torso axes."""
    return {"power": [-load_force.dot(u_virtual) - load_moment.dot(w_virtual)]}


def taken_power(let, torque: V2, rate: V2) -> dict:
    """Minus the power of two torques, or of the rates of a bristle with their weights."""
    return {"power": [-torque.dot(rate)]}
