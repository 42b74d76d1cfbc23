"""Dynamics of torso and links: SymPy vectors in, inertias, momenta and wrenches out (Sect. 2, Eqs.
2, 3, 16, 17).

A link is given by ``link`` = (m, L, m L / 2, I_x, I_y, I_z), the moments of inertia taken about its
joint.  A body set is given by its mass, first moment ``h`` = sum m r, and ``I`` = (xx, yy, zz, xy,
xz, yz) about the frame's origin.  A wrench or momentum ``F`` = (force or momentum, its moment about
the origin).
"""

from sympy import Matrix, eye

from .rotations import X, Y, Z, square, symmetric, world_acceleration


def without_translation(let, mass, h, I) -> dict:
    """Rotational block about the COM: I - (h . h 1 - h h^T) / M; COM from B, c = h / M; and 1 /
    M.
    """
    inverse = let("inverse", 1 / mass[0])
    c = let("c", h * inverse)
    block = symmetric(I) - (let("spread", c.dot(h)) * eye(3) - c * h.T)
    out = {"inverse_mass": [inverse], "com": c}
    return out | {f"A_{k}": block[k, 0 : k + 1].T for k in range(3)}


def column_without_translation(let, com, column) -> dict:
    """Coupling of omega with one tail coordinate about the COM: n_k - c x f_k."""
    return {"A_row": column[3:6, :] - com.cross(column[0:3, :])}


def pair_without_translation(let, inverse_mass, column, other) -> dict:
    """What eliminating translation takes from H_kl: f_k . f_l / M."""
    return {"A_entry": [-inverse_mass[0] * column[0:3, :].dot(other[0:3, :])]}


def rotational_load(let, com, force, moment, load_force, load_moment) -> dict:
    """Right-hand side for omega_dot: applied minus inertial moment about the COM; and the net
    force.
    """
    net = let("net", load_force - force)
    return {"net": net, "rhs": load_moment - moment - com.cross(net)}


def tail_load(let, inverse_mass, net, column, inertial, tau) -> dict:
    """Right-hand side for one tail coordinate, translation eliminated: tau - c_k - f_k . net /
    M.
    """
    return {"rhs": [tau[0] - inertial[0] - inverse_mass[0] * column[0:3, :].dot(net)]}


def column_acceleration(let, column, acceleration) -> dict:
    """f_k q_ddot_k: the momentum rate that one tail coordinate gives at rest of B."""
    return {"tail_force": column[0:3, :] * acceleration[0]}


def base_acceleration(let, R, gravity, inverse_mass, h, net, w_dot, tail_force) -> dict:
    """p_b_ddot = R_b (net - omega_dot x h - sum f_k q_ddot_k) / M - g z."""
    a = let("a", inverse_mass[0] * (net - w_dot.cross(h) - tail_force))
    return world_acceleration(let, R, gravity, a)


def free_acceleration(let, inverse_mass, com, net, w_dot) -> dict:
    """Acceleration of B, gravity taken off, of what a net force moves: net / M - omega_dot x c,
    torso axes.
    """
    return {"a": inverse_mass[0] * net - w_dot.cross(com)}


def coupling_torque(let, column, a, w_dot) -> dict:
    """What accelerations of the torso add to the torque of one tail coordinate."""
    return {"torque": [column[0:3, :].dot(a) + column[3:6, :].dot(w_dot)]}


def turned_acceleration(let, R, a) -> dict:
    """How p_b_ddot = R_b a - g z moves with a turn of the torso in body axes: columns R_b (e_k x
    a), row by row.
    """
    columns = [square(R) * axis.cross(a) for axis in (X, Y, Z)]
    return {f"row_{r}": Matrix([column[r] for column in columns]) for r in range(3)}


def turning_acceleration(let, R, a, turn, p_ddot) -> dict:
    """Add what a turn of the torso in body axes does to p_b_ddot = R_b a - g z."""
    return {"p_ddot": p_ddot + square(R) * let("swept", turn.cross(a))}
