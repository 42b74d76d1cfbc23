"""How a segment of the continuum tail is bent, and how its tip moves (Sect. 2.3).

A segment's bend is (a, b), its rotation Exp([a, 0, b]); z = a^2 + b^2 is the squared bend angle.
Slice x in [0, 1] lies at ``L (-sigma y + gamma u)`` from the segment's root, with u = (b, 0, -a),
sigma = x c1(x^2 z) and gamma = x^2 c2(x^2 z), c_k being Stumpff's functions.  These are entire
functions of z: nothing is singular or lost where the segment is straight.
"""

from dataclasses import dataclass

from sympy import Matrix, eye

from .rotations import X, Y, Z
from .shapes import M33, V1, V2, V3, V8, V12, FrameMotion


@dataclass(frozen=True)
class ArcTip:
    """Rotation to the tip of a segment, its position, and how both move with a and b."""

    E: M33
    r: V3
    bend: V12


def section_properties(let, tail_mass: V1, tail_length: V1, share: V1) -> dict:
    """Mass and length of one of m equal pieces, ``share`` = 1 / m (m_ct, L_ct)."""
    return {"section": Matrix([tail_mass[0], tail_length[0]]) * share[0]}


def own_section_properties(let, arc_masses: V1, arc_lengths: V1, share: V1) -> dict:
    """Mass and length of a share of a segment by itself."""
    return {"section": Matrix([arc_masses[0], arc_lengths[0]]) * share[0]}


def geometry(let, angles) -> tuple:
    """Return a, b, k = (a, 0, b), u = (b, 0, -a), and du/da, du/db."""
    a, b = angles
    return a, b, Matrix([a, 0, b]), Matrix([b, 0, -a]), (-Z, X)


def segment_tip(let, angles: V2, tip: V8, section: V2) -> dict:
    """Rotation to the tip (Eq. 33), its position (Eq. 34), and how both move with a and b, in the
    root frame.

    ``E`` = 1 + c1 K + c2 K^2; the tip turns by (1 + c2 K + c3 K^2) (a_dot, 0, b_dot).
    """
    # r is Eq. 20 at x = 1, less the root: L (-sigma y + gamma u)
    a, b, k, u, du = geometry(let, angles)
    c1, c2, c3, c1_z, c2_z, _, _, _ = tip
    length = section[1]
    K_squared = k * k.T - (a * a + b * b) * eye(3)

    # the rotation, and how the tip turns and moves with the bend
    E = eye(3) + c1 * Matrix([[0, -b, 0], [b, 0, -a], [0, a, 0]]) + c2 * K_squared
    turn = Matrix([[1 - c3 * b * b, c3 * a * b], [c2 * b, -c2 * a], [c3 * a * b, 1 - c3 * a * a]])
    move = [
        let("move", length * (2 * q * (c2_z * u - c1_z * Y) + c2 * d))
        for q, d in zip((a, b), du, strict=True)
    ]
    return {
        "E": E,
        "r": length * (c2 * u - c1 * Y),
        "bend": Matrix([*turn.col(0), *move[0], *turn.col(1), *move[1]]),
    }


def velocity_columns(let, bend, rates) -> tuple[Matrix, Matrix]:
    """Angular and linear velocity of the tip relative to the root for rates of (a, b)."""
    total = let("relative", rates[0] * bend[0:6, :] + rates[1] * bend[6:12, :])
    return total[0:3, :], total[3:6, :]


def segment_velocity(let, rates: V2, end: ArcTip, w: V3, u: V3) -> dict:
    """Angular and linear velocity of the tip, in its frame."""
    turn, move = velocity_columns(let, end.bend, rates)
    E = end.E.T
    return {"w": E * let("w", w + turn), "u": E * let("u", u + w.cross(end.r) + move)}


def segment_motion(
    let,
    angles: V2,
    rates: V2,
    accelerations: V2,
    section: V2,
    tip: V8,
    end: ArcTip,
    root: FrameMotion,
) -> dict:
    """Angular velocity, its rate and acceleration of the tip, in its frame, from the root's in the
    root frame.
    """
    # a_tip is Eq. 29 at x = 1, in bend components
    alpha, beta, _, u, du = geometry(let, angles)
    _, _, c3, c1_z, c2_z, c3_z, c1_zz, c2_zz = tip

    # derivatives of the squared bend angle
    z_dot = let("z_dot", 2 * (alpha * rates[0] + beta * rates[1]))
    z_ddot = let("z_ddot", 2 * (rates[0] ** 2 + rates[1] ** 2))
    area = let("area", beta * rates[0] - alpha * rates[1])

    # how the tip's rotation and place change at fixed rates
    swing = let("swing", c3_z * z_dot * area)
    turn_rate = Matrix(
        [
            -swing * beta - c3 * rates[1] * area,
            c2_z * z_dot * area,
            swing * alpha + c3 * rates[0] * area,
        ]
    )
    along = let("along", c1_zz * z_dot**2 + c1_z * z_ddot)
    across = let("across", c2_zz * z_dot**2 + c2_z * z_ddot)
    r_ddot = section[1] * let(
        "r_v", across * u - along * Y + 2 * c2_z * z_dot * (rates[0] * du[0] + rates[1] * du[1])
    )

    # the tip in the root frame, then in its own
    r, w = end.r, root.w
    turn, r_dot = velocity_columns(let, end.bend, rates)
    turn_q, move_q = velocity_columns(let, end.bend, accelerations)
    w_r = let("w_r", w.cross(r))
    w_tip_dot = root.w_dot + w.cross(turn) + turn_rate + turn_q
    a_tip = root.a + root.w_dot.cross(r) + w.cross(let("v", w_r + 2 * r_dot)) + r_ddot + move_q
    E = end.E.T
    return {
        "w": E * let("w", w + turn),
        "w_dot": E * let("w_dot", w_tip_dot),
        "a": E * let("a", a_tip),
    }


def segment_pose(let, E: M33, r: V3, R: M33, P: V3) -> dict:
    """R_{i+1} = R_i E (Eq. 33) and p_{i+1} = p_i + R_i r (Eq. 34)."""
    return {"R": R * E, "P": P + R * r}


def segment_twist(let, end: ArcTip, R: M33, P: V3) -> dict:
    """Spatial columns at B of a segment's bend: angular, then the velocity of the point of the
    tip's body at B.
    """
    bend, tip, out = end.bend, let("tip", P + R * end.r), []
    for k in (0, 6):
        turn = let("turn", R * bend[k : k + 3, :])
        out += [turn, R * bend[k + 3 : k + 6, :] + tip.cross(turn)]
    return {"S": Matrix(out)}


def part_of_bend(let, angles: V2, fraction: V1) -> dict:
    """Bend of an n-th of a segment."""
    return {"part": angles * fraction[0]}


def columns_of_bend(let, bend: V12, fraction: V1) -> dict:
    """Columns for the rates of a whole segment from those for the rates of an n-th of it."""
    return {"bend": bend * fraction[0]}
