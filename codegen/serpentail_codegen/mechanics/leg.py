"""Where the points of a leg are, in torso axes (Sect. 2.1).

A leg moves in a plane parallel to the torso's y and z axes; two angles, gamma and delta, place all
its points.
"""

from sympy import Matrix, cos, sin, zeros

from .shapes import V1, V2, V3


def direction(let, angle, rate) -> Matrix:
    """u_h of Eq. 9; the second column is its rate."""
    c, s = let("c", cos(angle)), let("s", sin(angle))
    return Matrix.hstack(Matrix([0, c, s]), let("u_dot", Matrix([0, -s * rate, c * rate])))


def chain(let, hip, directions, lengths) -> Matrix:
    """A, M and T, one below the other (Eqs. 5 to 8); linear, so that columns of rates give rates.

    The directions are those of the thigh, the shank and the sole.
    """
    upper, lower, sole = directions
    thigh, L_d2k, L_a2m, L_m2t = lengths
    A = let("A", (hip + thigh * upper + L_d2k * lower).T).T  # one column after the other
    M = let("M", (A + L_a2m * lower).T).T
    return Matrix([A, M, M - L_m2t * sole])


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
    upper = direction(let, leg[0], leg_rates[0])
    lower = direction(let, leg[1], leg_rates[1])
    sole = direction(let, let("sole", leg[0] - delta_m[0]), leg_rates[0])
    thigh = let("thigh", L_h2d[0] + L_k2a[0])
    start = Matrix([side[0] * hip[0], hip[1], hip[2]]).row_join(zeros(3, 1))
    lengths = thigh, L_d2k[0], L_a2m[0], L_m2t[0]
    points = chain(let, start, (upper, lower, sole), lengths)
    return {"foot": points[:, 0], "foot_rate": points[:, 1]}


def leg_joints(
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
    upper, lower = (direction(let, angle, 0)[:, 0] for angle in leg)
    sole = direction(let, let("sole", leg[0] - delta_m[0]), 0)[:, 0]
    thigh = let("thigh", L_h2d[0] + L_k2a[0])
    start = Matrix([side[0] * hip[0], hip[1], hip[2]])
    D = let("D", start + L_h2d[0] * upper)
    lengths = thigh, L_d2k[0], L_a2m[0], L_m2t[0]
    foot = chain(let, start, (upper, lower, sole), lengths)
    return {"joints": Matrix([start, D, D + L_d2k[0] * lower, foot])}
