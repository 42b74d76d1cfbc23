"""Where the points of a leg are, in torso axes (Sect. 2.1).

A leg moves in a plane parallel to the torso's y and z axes; two angles, gamma and delta, place all
its points.
"""

from sympy import Matrix, cos, sin

from .shapes import V1, V2, V3


def direction(let, angle, rate) -> tuple[Matrix, Matrix]:
    """u_h of Eq. 9 and its rate."""
    c, s = let("c", cos(angle)), let("s", sin(angle))
    return Matrix([0, c, s]), let("u_dot", Matrix([0, -s * rate, c * rate]))


def foot_points(
    let,
    hip: V3,
    side: V1,
    L_h2d: V1,
    L_d2k: V1,
    L_k2a: V1,
    L_a2m: V1,
    L_m2t: V1,
    delta_m: V1,
    leg: V2,
    leg_rates: V2,
) -> dict:
    """A, M and T from B, and their rates in B (Eqs. 5 to 9); ``side`` is 1 on the right, -1 on the
    left.

    The sole keeps the angle delta_m to the thigh: Eq. 8's gamma - delta is gamma - delta_m.
    """
    upper, upper_rate = direction(let, leg[0], leg_rates[0])
    lower, lower_rate = direction(let, leg[1], leg_rates[1])
    sole, sole_rate = direction(let, let("sole", leg[0] - delta_m[0]), leg_rates[0])
    thigh = let("thigh", L_h2d[0] + L_k2a[0])
    ankle = let("A", Matrix([side[0] * hip[0], hip[1], hip[2]]) + thigh * upper + L_d2k[0] * lower)
    ankle_rate = let("A_dot", thigh * upper_rate + L_d2k[0] * lower_rate)
    middle, middle_rate = (
        let("M", ankle + L_a2m[0] * lower),
        let("M_dot", ankle_rate + L_a2m[0] * lower_rate),
    )
    toe, toe_rate = middle - L_m2t[0] * sole, middle_rate - L_m2t[0] * sole_rate
    return {
        "foot": Matrix([ankle, middle, toe]),
        "foot_rate": Matrix([ankle_rate, middle_rate, toe_rate]),
    }


def leg_points(
    let,
    hip: V3,
    side: V1,
    L_h2d: V1,
    L_d2k: V1,
    L_k2a: V1,
    L_a2m: V1,
    L_m2t: V1,
    delta_m: V1,
    leg: V2,
) -> dict:
    """Hip, D, knee, A, M and T of one leg from B (Eqs. 5 to 9); ``side`` is 1 on the right, -1 on
    the left.
    """
    upper, _ = direction(let, leg[0], 0)
    lower, _ = direction(let, leg[1], 0)
    sole, _ = direction(let, let("sole", leg[0] - delta_m[0]), 0)
    points = [Matrix([side[0] * hip[0], hip[1], hip[2]])]
    for link in (L_h2d * upper.T, L_d2k * lower.T, L_k2a * upper.T, L_a2m * lower.T):
        points.append(let("joint", points[-1] + link.T))
    return {"joints": Matrix([*points, points[-1] - L_m2t[0] * sole])}
