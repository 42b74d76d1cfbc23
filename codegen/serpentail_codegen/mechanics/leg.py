"""Where the points of a leg are, in torso axes (Sect. 2.1).

A leg moves in a plane parallel to the torso's y and z axes; two angles, gamma and delta, place all
its points.
"""

from dataclasses import dataclass

from sympy import Matrix, cos, sin, zeros

from .shapes import V1, V2, V3


def direction(let, angle, rate) -> Matrix:
    """u_h of Eq. 9; the second column is its rate."""
    c, s = let("c", cos(angle)), let("s", sin(angle))
    return Matrix.hstack(Matrix([0, c, s]), let("u_dot", Matrix([0, -s * rate, c * rate])))


@dataclass(frozen=True)
class LegLengths:
    """The distances between the points of a leg, and the angle of its sole to its thigh."""

    L_h2d: V1
    L_d2k: V1
    L_k2a: V1
    L_a2m: V1
    L_m2t: V1
    delta_m: V1


def chain(let, hip, directions, thigh, leg: LegLengths) -> Matrix:
    """A, M and T, one below the other (Eqs. 5 to 8); linear, so that columns of rates give rates.

    The directions are those of the thigh, the shank and the sole.
    """
    upper, lower, sole = directions
    A = let("A", (hip + thigh * upper + leg.L_d2k[0] * lower).T).T  # one column after the other
    M = let("M", (A + leg.L_a2m[0] * lower).T).T
    return Matrix([A, M, M - leg.L_m2t[0] * sole])


def foot_points(let, hip: V3, side: V1, lengths: LegLengths, leg: V2, leg_rates: V2) -> dict:
    """A, M and T from B, and their rates in B (Eqs. 5 to 9); ``side`` is 1 on the right, -1 on the
    left.

    The sole keeps the angle delta_m to the thigh: Eq. 8's gamma - delta is gamma - delta_m.
    """
    upper = direction(let, leg[0], leg_rates[0])
    lower = direction(let, leg[1], leg_rates[1])
    sole = direction(let, let("sole", leg[0] - lengths.delta_m[0]), leg_rates[0])
    thigh = let("thigh", lengths.L_h2d[0] + lengths.L_k2a[0])
    start = Matrix([side[0] * hip[0], hip[1], hip[2]]).row_join(zeros(3, 1))
    points = chain(let, start, (upper, lower, sole), thigh, lengths)
    return {"foot": points[:, 0], "foot_rate": points[:, 1]}


def leg_joints(let, hip: V3, side: V1, lengths: LegLengths, leg: V2) -> dict:
    """Hip, D, knee, A, M and T of one leg from B (Eqs. 5 to 9); ``side`` is 1 on the right, -1 on
    the left.
    """
    upper, lower = (direction(let, angle, 0)[:, 0] for angle in leg)
    sole = direction(let, let("sole", leg[0] - lengths.delta_m[0]), 0)[:, 0]
    thigh = let("thigh", lengths.L_h2d[0] + lengths.L_k2a[0])
    start = Matrix([side[0] * hip[0], hip[1], hip[2]])
    D = let("D", start + lengths.L_h2d[0] * upper)
    foot = chain(let, start, (upper, lower, sole), thigh, lengths)
    return {"joints": Matrix([start, D, D + lengths.L_d2k[0] * lower, foot])}
