"""Airborne motion reduced to the tail: the angular momentum about the centre of mass gives omega,
and the torso's rows of Eq. 1 its acceleration, so that the tail's rows alone remain.

``coupling`` is N_k, the angular momentum about the COM per unit rate of tail coordinate k at rest
of the torso; ``gain`` is B_k = I^-1 N_k, by which that rate turns the torso back.  ``turn_load`` is
the moment about the COM that is left for omega_dot, ``net`` the force.
"""

from sympy import Matrix, eye

from .shapes import M33, V1, V3, V4, V6, V3x4

# ---- the torso from the tail ---------------------------------------------------------------------


def momentum_in_torso(let, R: M33, angular: V3) -> dict:
    """The conserved angular momentum in torso axes, R^T h."""
    return {"momentum": R.T * angular}


def pair_without_torso(
    let, inverse_mass: V1, column: V6, other: V6, coupling: V3, gain: V3
) -> dict:
    """What elimination of the torso subtracts from H_kl: f_k . f_l / M + N_k . B_l."""
    moved = inverse_mass[0] * column[0:3, :].dot(other[0:3, :])
    return {"entry": [-(moved + coupling.dot(gain))]}


def torque_without_torso(
    let, inverse_mass: V1, net: V3, turn_load: V3, column: V6, gain: V3, inertial: V1
) -> dict:
    """Load on one tail coordinate: minus its inertial force, f_k . net / M and B_k . turn_load."""
    moved = inverse_mass[0] * column[0:3, :].dot(net)
    return {"load": [-(inertial[0] + moved + gain.dot(turn_load))]}


def torso_load(let, com: V3, force: V3, moment: V3) -> dict:
    """Net force, and moment about the COM, of an inertial force and moment at B."""
    return {"net": -force, "turn_load": com.cross(force) - moment}


def taken_back(let, gain: V3, rate: V1) -> dict:
    """Part of a rotation of the torso, or of its momentum, that a rate of a tail coordinate takes:
    minus B_k, or N_k, times it.
    """
    return {"part": -rate[0] * gain}


def moved_back_by(let, inverse_mass: V1, column: V6, rate: V1) -> dict:
    """Motion of B by it: minus f_k times it over M."""
    return {"shift": -(inverse_mass[0] * rate[0]) * column[0:3, :]}


def pushed(let, inverse_mass: V1, net: V3) -> dict:
    """Acceleration of the COM by a net force; its velocity by a momentum."""
    return {"shift": inverse_mass[0] * net}


def drift_of_turn(let, com: V3, turn: V3) -> dict:
    """Motion of B that keeps the COM at rest while the torso rotates: minus turn x c."""
    return {"shift": com.cross(turn)}


# ---- attitude ------------------------------------------------------------------------------------


def turn_of_quaternion(let, quaternion: V4, momentum: V3) -> dict:
    """How the momentum in torso axes moves with the quaternion's numbers, column by column.

    A turn of the torso by e changes it by momentum x e.
    """
    w, x, y, z = quaternion
    twice = let("twice", 2 / quaternion.dot(quaternion))
    turns = Matrix([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
    return {f"column_{k}": twice * momentum.cross(turns.col(k)) for k in range(4)}


def turning_by_quaternion(let, omega: V3) -> dict:
    """Derivative of quaternion times (0, omega) / 2 by the quaternion, row by row."""
    a, b, c = let("half", omega / 2)
    rows = [[0, -a, -b, -c], [a, 0, c, -b], [b, -c, 0, a], [c, b, -a, 0]]
    return {f"row_{k}": Matrix(row) for k, row in enumerate(rows)}


def weighted_turning(let, weight: V4) -> dict:
    """Second derivatives of weight . (quaternion times (0, omega) / 2): by omega (rows), by each
    number of the quaternion (columns).
    """
    gw, gx, gy, gz = let("half", weight / 2)
    columns = [[gx, gy, gz], [-gw, gz, -gy], [-gz, -gw, gx], [gy, -gx, -gw]]
    return {f"column_{k}": Matrix(column) for k, column in enumerate(columns)}


def turned_twice(let, quaternion: V4, angular: V3, weight: V3) -> dict:
    """Second derivatives of weight . R^T h by the quaternion's numbers, row by row.

    It is c^T S c / c^T c, of which the gradient is g = 2 (S c - value c) / c^T c, and the Hessian
    2 (S - value 1 - c g^T - g c^T) / c^T c.
    """
    across, along = let("across", weight.cross(angular)), let("along", weight.dot(angular))
    outer = angular * weight.T
    block = outer + outer.T - along * eye(3)
    S = Matrix.vstack(Matrix([[along, *across]]), Matrix.hstack(across, block))
    S = let("S", S)
    inverse = let("inverse", 1 / quaternion.dot(quaternion))
    S_c = let("S_c", S * quaternion)
    value = let("value", inverse * S_c.dot(quaternion))
    gradient = let("gradient", 2 * inverse * (S_c - value * quaternion))
    outer = quaternion * gradient.T
    hessian = 2 * inverse * (S - value * eye(4) - outer - outer.T)
    return {f"row_{k}": hessian.row(k).T for k in range(4)}


# ---- slopes --------------------------------------------------------------------------------------


def momentum_slope(
    let,
    inverse_mass: V1,
    com: V3,
    w: V3,
    column: V6,
    coupling: V3,
    force: V3,
    moment: V3,
    row: V3,
    row_x: V3,
    row_y: V3,
    row_z: V3,
) -> dict:
    """Minus how the angular momentum at fixed rates moves with tail coordinate k.

    With A(q) = H without translation, its torso rows A_r, and v = (omega, q_t_dot), the bias is
    b_r = omega x A_r v + A_r_dot v, b_k = A_k_dot v - v^T (dA/dq_k) v / 2.  So twice d(A_r v)/dq_k
    is db_r/dq_dot_k - omega x N_k - db_k/domega.  ``force, moment`` are the changes of C along
    q_dot_k; ``row`` and ``row_x`` to ``row_z`` those of the rows of q_k and of the force along
    omega.
    """
    by_rate = moment - com.cross(force)
    moved = column[0] * row_x + column[1] * row_y + column[2] * row_z
    by_omega = row - inverse_mass[0] * moved
    return {"momentum": (by_omega + w.cross(coupling) - by_rate) / 2}


def chained_row(let, omega_0: V1, omega_1: V1, omega_2: V1, by_omega: V3) -> dict:
    """Contribution of a change of omega to a row of slopes."""
    return {"row": [by_omega[0] * omega_0[0] + by_omega[1] * omega_1[0] + by_omega[2] * omega_2[0]]}


def weighted(let, weight: V1, by_omega: V3) -> dict:
    """Minus a weight times a row's slopes along omega."""
    return {"gradient": -weight[0] * by_omega}


def by_quaternion(let, row: V3, turn: V3x4) -> dict:
    """Slopes by the quaternion's numbers from those by the momentum in torso axes."""
    return {"row": Matrix([row.dot(column) for column in turn])}


# ---- curvature -----------------------------------------------------------------------------------


def torso_weights(let, inverse_mass: V1, com: V3, move: V3, turn: V3) -> dict:
    """Weights of net force and turn_load that replace those of the acceleration of B and of
    omega_dot.
    """
    return {"move": inverse_mass[0] * move, "turn": turn - com.cross(move)}


def tail_weight(let, weight: V1, move: V3, turn: V3, column: V6, gain: V3) -> dict:
    """Weight of the second derivative of a tail coordinate, with the torso following it."""
    return {"weight": [weight[0] - column[0:3, :].dot(move) - gain.dot(turn)]}


def crossed(let, weight: V3, change: V3) -> dict:
    """Sum of three changes times their weights."""
    return {"sum": [weight.dot(change)]}


def crossed_by_rate(let, weight: V1, change: V1) -> dict:
    """A change times its weight."""
    return {"sum": [weight[0] * change[0]]}


def curvature_by_omega(let, row_0: V3, row_1: V3, row_2: V3, omega: V3) -> dict:
    """Half the second derivatives by omega, times a change of omega."""
    return {"share": Matrix([row_0.dot(omega), row_1.dot(omega), row_2.dot(omega)]) / 2}


def both_by_omega(let, share: V3, other: V3, turn: V3, other_turn: V3) -> dict:
    """Second derivative along two directions through omega."""
    return {"entry": [share.dot(other_turn) + turn.dot(other)]}
