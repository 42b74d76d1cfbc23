"""Eliminating translation from the equation of motion, and what follows for accelerations.

A column is the momentum of the animal, at rest of B, per unit rate of one tail coordinate: f_k, and
its moment n_k about B.
"""

from sympy import Matrix, eye

from .rotations import X, Y, Z, symmetric, world_acceleration, world_acceleration_sloped
from .shapes import M33, V1, V3, V6


def without_translation(let, mass: V1, h: V3, I: V6) -> dict:
    """Rotational block about the COM: I - (h . h 1 - h h^T) / M; COM from B, c = h / M; and 1 /
    M.
    """
    inverse = let("inverse", 1 / mass[0])
    c = let("c", h * inverse)
    block = symmetric(I) - (let("spread", c.dot(h)) * eye(3) - c * h.T)
    out = {"inverse_mass": [inverse], "com": c}
    return out | {f"A_{k}": block[k, 0 : k + 1].T for k in range(3)}


def column_without_translation(let, com: V3, column: V6) -> dict:
    """Coupling of omega with one tail coordinate about the COM: n_k - c x f_k."""
    return {"A_row": column[3:6, :] - com.cross(column[0:3, :])}


def pair_without_translation(let, inverse_mass: V1, column: V6, other: V6) -> dict:
    """Term that elimination of translation subtracts from H_kl: f_k . f_l / M."""
    return {"A_entry": [-inverse_mass[0] * column[0:3, :].dot(other[0:3, :])]}


def rotational_load(let, com: V3, force: V3, moment: V3, load_force: V3, load_moment: V3) -> dict:
    """Right-hand side for omega_dot: applied minus inertial moment about the COM; and the net
    force.
    """
    net = let("net", load_force - force)
    return {"net": net, "rhs": load_moment - moment - com.cross(net)}


def tail_load(let, inverse_mass: V1, net: V3, column: V6, inertial: V1, tau: V1) -> dict:
    """Right-hand side for one tail coordinate, translation eliminated: tau - c_k - f_k . net /
    M.
    """
    return {"rhs": [tau[0] - inertial[0] - inverse_mass[0] * column[0:3, :].dot(net)]}


def column_acceleration(let, column: V6, acceleration: V1) -> dict:
    """f_k q_ddot_k: the momentum rate that one tail coordinate gives at rest of B."""
    return {"tail_force": column[0:3, :] * acceleration[0]}


def base_acceleration(
    let, R: M33, gravity: V1, inverse_mass: V1, h: V3, net: V3, w_dot: V3, tail_force: V3
) -> dict:
    """p_b_ddot = R_b (net - omega_dot x h - sum f_k q_ddot_k) / M - g z."""
    a = let("a", inverse_mass[0] * (net - w_dot.cross(h) - tail_force))
    return world_acceleration(let, R, gravity, a)


def base_acceleration_sloped(
    let, R: M33, gravity_vector: V3, inverse_mass: V1, h: V3, net: V3, w_dot: V3, tail_force: V3
) -> dict:
    """p_b_ddot = R_b (net - omega_dot x h - sum f_k q_ddot_k) / M + g."""
    a = let("a", inverse_mass[0] * (net - w_dot.cross(h) - tail_force))
    return world_acceleration_sloped(let, R, gravity_vector, a)


def free_acceleration(let, inverse_mass: V1, com: V3, net: V3, w_dot: V3) -> dict:
    """Acceleration of B without gravity under a net force: net / M - omega_dot x c, torso axes."""
    return {"a": inverse_mass[0] * net - w_dot.cross(com)}


def coupling_torque(let, column: V6, a: V3, w_dot: V3) -> dict:
    """Contribution of accelerations of the torso to the torque of one tail coordinate."""
    return {"torque": [column[0:3, :].dot(a) + column[3:6, :].dot(w_dot)]}


def turned_acceleration(let, R: M33, a: V3) -> dict:
    """Derivative of p_b_ddot = R_b a - g z by a turn of the torso in body axes: columns R_b (e_k x
    a), row by row.
    """
    columns = [R * axis.cross(a) for axis in (X, Y, Z)]
    return {f"row_{r}": Matrix([column[r] for column in columns]) for r in range(3)}


def turning_acceleration(let, R: M33, a: V3, turn: V3, p_ddot: V3) -> dict:
    """Add the change of p_b_ddot = R_b a - g z with a turn of the torso in body axes."""
    return {"p_ddot": p_ddot + R * let("swept", turn.cross(a))}
