"""Contact linearised, for implicit integrators: the stiffness of a point, and its responses.

A W-method solves with 1 - w J, J from contact, damping and gains alone.  Of one point that moves by
dx and dv, the normal force changes by df_n = -k_n dx - d_n dv, friction by g df_n - P (K_f du + D_f
K_f dv), and the bristle's rate by P dv - ((1 - P) K_f du + g df_n) / (D_f K_f) (by dv with
``paper``): P, symmetric, is how friction follows the trial force, g how it follows the load, which
bounds it while the point slides.  With the bristle eliminated, ``spring`` holds all that factoring
and solving need: w k_n and a = w (d_n + w k_n), then (xx, xy, yy) of B and C, w times the force for
a velocity and for a bristle's right-hand side, and of M and N, the bristle for its right-hand side
and for a velocity; then h and e, friction and bristle for w df_n.
"""

from collections.abc import Callable
from functools import partial
from itertools import accumulate

from sympy import Matrix, MatrixBase, Piecewise, eye, ordered, sympify, zeros

from .contact import FRICTION, normal_force
from .rotations import X, Y, Z
from .shapes import M33, V1, V2, V3, V6, V18


def plane(entries) -> Matrix:
    """The symmetric 2 x 2 matrix of (xx, xy, yy)."""
    xx, xy, yy = entries
    return Matrix([[xx, xy], [xy, yy]])


def plane_entries(matrix) -> list:
    """(xx, xy, yy) of a symmetric 2 x 2 matrix."""
    return [matrix[0, 0], matrix[0, 1], matrix[1, 1]]


def slopes(let, law: Callable, *values) -> list[Matrix]:
    """Return the derivatives of ``law(let, *values)`` by each value: a name, or a column
    of names.
    """
    # every named result is differentiated by the names in it, from those of the values on
    columns = [Matrix([value]) for value in values]
    symbols = [symbol for column in columns for symbol in column]
    rates = {s: Matrix([[int(s == other) for other in symbols]]) for s in symbols}

    def rate(value) -> Matrix:
        moving = value.free_symbols & rates.keys()
        return sum((value.diff(s) * rates[s] for s in ordered(moving)), zeros(1, len(symbols)))

    def named(name, value):
        if isinstance(value, MatrixBase):
            return value.applyfunc(lambda entry: named(name, entry))
        result = let(name, value)
        if result not in rates:
            rates[result] = let("slope", rate(sympify(value)))
        return result

    results = Matrix([law(named, *values)])
    jacobian = Matrix.vstack(*(rate(result) for result in results))
    ends = accumulate(column.rows for column in columns)
    return [jacobian[:, e - c.rows : e] for c, e in zip(columns, ends, strict=True)]


def following_load(let, bound, pressing, mu, share) -> Matrix:
    """g = mu df/d(bound), 0 if no force presses; ``share`` 0 leaves it out: S is symmetric."""
    return let(
        "g", (bound * mu * share).applyfunc(lambda e: Piecewise((e, pressing > 0), (0, True)))
    )


def linearised_contact(
    let,
    K_n: V1,
    D_n: V1,
    K_f: V1,
    D_f: V1,
    mu: V1,
    drag: V1,
    weight: V1,
    bound_share: V1,
    p: V3,
    arm: V3,
    velocity: V3,
    bristle: V2,
    friction: str = "cone",
) -> dict:
    """Compute ``spring`` of a point in the ground (Eqs. 35 to 37)."""
    w, depth, rate = weight[0], let("z", -(p[2] + arm[2])), let("rate", -velocity[2])
    f_n = normal_force(let, depth, rate, K_n, D_n)
    k_n, d_n = slopes(let, partial(normal_force, K_n=K_n, D_n=D_n), depth, rate)

    # how friction depends on the trial force, and on its bound
    trial = let("trial", -(K_f[0] * bristle + drag[0] * velocity[0:2, :]))
    limit = let("limit", mu[0] * f_n)
    P, g = slopes(let, FRICTION[friction], trial, limit)
    g = following_load(let, g, f_n, mu[0], bound_share[0])
    P = plane([let("P", Piecewise((e, f_n > 0), (0, True))) for e in plane_entries(P)])

    # the bristle eliminated
    following = eye(2) if friction == "paper" else P
    M = let("M", inverted(let, eye(2) + let("relax", w / D_f[0]) * (eye(2) - following)))
    N = let("N", w * M * following)
    B = w * P * let("K_N", K_f[0] * N + drag[0] * eye(2))

    # everything that factoring and solving need
    spring = [w * k_n[0], w * (d_n[0] + w * k_n[0])]
    for matrix in (B, let("w_K_f", w * K_f[0]) * P * M, M, N):
        spring += plane_entries(matrix)
    e = Matrix([0, 0]) if friction == "paper" else let("e", -M * g / drag[0])
    return {"spring": Matrix([*spring, *(g - w * K_f[0] * P * e), *e])}


def inverted(let, A) -> Matrix:
    """The inverse of a symmetric positive definite 2 x 2 matrix."""
    a, b, c = let("A", Matrix(plane_entries(A)))
    inverse = let("inverse", 1 / let("det", a * c - b * b))
    return Matrix([[c, -b], [-b, a]]) * inverse


def depth_of_point(let, p: V3, arm: V3) -> dict:
    """Depth of a point in the ground."""
    return {"depth": [-(p[2] + arm[2])]}


def stiffened(let, spring, velocity) -> Matrix:
    """Force for a velocity: B across the ground, a along its normal."""
    across = plane(spring[2:5]) * velocity[0:2, :]
    return Matrix([across[0], across[1], spring[1] * velocity[2]])


def stiffened_torso(let, R: M33, arm: V3, spring: V18) -> dict:
    """J^T G J of one point for (p_dot, omega): lower triangle, row by row."""
    turning = [let("J", (R * axis).cross(arm)) for axis in (X, Y, Z)]
    columns = [*(eye(3).col(k) for k in range(3)), *turning]
    forces = [let("G_J", stiffened(let, spring, column)) for column in columns]
    return {f"S_{r}": Matrix([columns[k].dot(forces[r]) for k in range(r + 1)]) for r in range(6)}


def stiffened_column(let, R: M33, arm: V3, spring: V18, J_k: V3) -> dict:
    """G J_k of one tail coordinate, and its coupling with (p_dot, omega)."""
    force = let("G_J", stiffened(let, spring, J_k))
    return {"force": force, "S_row": Matrix([force, R.T * let("moment", arm.cross(force))])}


def coupled_columns(let, J_k: V3, force: V3) -> dict:
    """J_l . G J_k."""
    return {"S_entry": [J_k.dot(force)]}


def sliding(let, spring: V18) -> dict:
    """|h|^2: positive if friction follows the load."""
    return {"slip": [spring[14] ** 2 + spring[15] ** 2]}


def sheared_torso(let, R: M33, arm: V3, spring: V18) -> dict:
    """J^T h and a J_z of one point for (p_dot, omega). Their product is part of S, which is
    therefore not symmetric.
    """
    R, h, lift = R.T, Matrix([spring[14], spring[15], 0]), Matrix([0, 0, spring[1]])
    push = Matrix([h, R * let("moment", arm.cross(h))])
    return {"push": push, "lift": Matrix([lift, R * let("turning", arm.cross(lift))])}


def sheared_column(let, spring: V18, J_k: V3) -> dict:
    """h . J_k and a J_z,k of one tail coordinate k."""
    return {"push": [spring[14] * J_k[0] + spring[15] * J_k[1]], "lift": [spring[1] * J_k[2]]}


def sheared_entries(let, push_k: V1, push_l: V1, lift_k: V1, lift_l: V1) -> dict:
    """push_k lift_l, and the entry opposite to it."""
    return {"entry": [push_k[0] * lift_l[0]], "turned": [lift_k[0] * push_l[0]]}


def torso_turn(let, R: M33, rotation: V3) -> dict:
    """A turn or turning rate from torso axes to world axes."""
    return {"turn": R * rotation}


def point_shift(let, shift: V3, turn: V3, arm: V3) -> dict:
    """Motion of a point of the torso: J (shift, rotation)."""
    return {"motion": shift + turn.cross(arm)}


def tail_shift(let, J_k: V3, coupling: V1) -> dict:
    """Contribution of one tail coordinate to the motion of a point."""
    return {"motion": J_k * coupling[0]}


def contact_response(let, spring: V18, motion_q: V3, motion_v: V3, lag: V2) -> dict:
    """Force on a point, w df, for right-hand sides of its place, velocity and bristle; ``pressed``
    is the part of its place.
    """
    across = plane(spring[2:5]) * motion_v[0:2, :] + plane(spring[5:8]) * lag
    pressed = let("pressed", -spring[0] * motion_q[2])
    load = let("load", pressed - spring[1] * motion_v[2])
    return {
        "force": Matrix([load * spring[14] - across[0], load * spring[15] - across[1], load]),
        "pressed": [pressed],
    }


def tail_response(let, J_k: V3, force: V3) -> dict:
    """Contribution of a force to one tail coordinate."""
    return {"rhs": [J_k.dot(force)]}


def torso_response(let, R: M33, load: V6) -> dict:
    """A load about B as forces on (p_dot, omega)."""
    return {"rhs": Matrix([load[0:3, :], R.T * load[3:6, :]])}


def bristle_response(let, spring: V18, motion: V3, lag: V2, pressed: V1) -> dict:
    """M r_u + N J k_v + e w df_n: a bristle in the ground."""
    load = let("load", pressed[0] - spring[1] * motion[2])
    return {
        "k_u": plane(spring[8:11]) * lag
        + plane(spring[11:14]) * motion[0:2, :]
        + load * spring[16:18, :]
    }


def relaxation(let, D_f: V1, weight: V1) -> dict:
    """1 / (1 + w / D_f): a bristle in the air."""
    return {"relax": [1 / (1 + let("lag", weight[0] / D_f[0]))]}


def relaxed(let, relax: V1, lag: V2) -> dict:
    """Bristle in the air for a right-hand side: the relaxation times it."""
    return {"k_u": lag * relax[0]}


def gain_weights(let, weight: V1, gains: V2) -> dict:
    """w K_p, and w (K_d + w K_p), which is 0 where there are no gains."""
    w = weight[0]
    proportional = let("w_K_p", w * gains[0])
    return {"gain_q": [proportional], "gain_v": [w * gains[1] + w * proportional]}


def damped(let, weight: V1, damping: V1) -> dict:
    """w times the damping of one tail coordinate."""
    return {"damped": [weight[0] * damping[0]]}


def damped_response(let, damped: V1, rate: V1) -> dict:
    """Force of the damping of one tail coordinate for a right-hand side."""
    return {"rhs": [-damped[0] * rate[0]]}


def gained(let, gain: V1, entry: V1) -> dict:
    """Gain times an entry of H_tt."""
    return {"S_entry": [gain[0] * entry[0]]}


def gain_response(let, gain_q: V1, gain_v: V1, entry: V1, angle: V1, rate: V1) -> dict:
    """The force of one coordinate's gains on another: -H_kl (w K_p r_q + w (K_d + w K_p) r_v)."""
    return {"rhs": [-entry[0] * (gain_q[0] * angle[0] + gain_v[0] * rate[0])]}


def total_rate(let, change: V1, rate: V1) -> dict:
    """k_v = r_v + change."""
    return {"k_v": change + rate}


def total_place(let, weight: V1, k_v: V1, angle: V1) -> dict:
    """k_q = r_q + w k_v."""
    return {"k_q": angle + weight[0] * k_v}
