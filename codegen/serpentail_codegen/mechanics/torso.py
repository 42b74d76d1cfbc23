"""The steps of the torso: what it adds to the tail's inertia, wrench and momentum, and how the tail
mount moves with it (Eqs. 2, 3, 14, 16).

``mass``, ``h`` and ``I`` are mass, first moment and inertia about B; ``F_next`` is a wrench or a
momentum at the tail mount.
"""

from sympy import Matrix, eye

from .rotations import Z, entries, symmetric
from .shapes import M33, V1, V3, V6, V12


def torso_power(
    let, torso_mass: V1, torso_inertia: V3, w: V3, w_dot: V3, a: V3, w_virtual: V3, u_virtual: V3
) -> dict:
    """Power of the torso's inertial wrench at B (Eq. 3) under a virtual motion, torso axes."""
    euler = torso_inertia.multiply_elementwise(w_dot) + w.cross(
        let("I_w", torso_inertia.multiply_elementwise(w))
    )
    return {
        "power": [torso_mass[0] * let("a_u", a.dot(u_virtual)) + w_virtual.dot(let("euler", euler))]
    }


def column_at_torso(let, R: M33, P: V3, pitch: V6, yaw: V6) -> dict:
    """Momentum columns of a segment, from its root frame at ``P`` to the torso frame at B."""
    out = []
    for column in (pitch, yaw):
        force = let("force", R * column[0:3, :])
        out += [force, R * column[3:6, :] + P.cross(force)]
    return {"columns": Matrix(out)}


def segment_coupling(let, S: V12, columns: V12) -> dict:
    """Block of H between a segment and one beyond it: spatial columns at B times momentum columns
    at B (Eq. 16).
    """
    starts = range(0, len(columns), 6)  # of the columns of two coordinates, or of one
    rows = [
        [
            S[a : a + 3, :].dot(columns[b + 3 : b + 6, :])
            + S[a + 3 : a + 6, :].dot(columns[b : b + 3, :])
            for a in starts
        ]
        for b in starts
    ]
    return {name: Matrix(row) for name, row in zip(("H_pitch", "H_yaw"), rows, strict=False)}


def torso_composite(
    let, tail_mount: V3, torso_mass: V1, torso_inertia: V3, mass: V1, h: V3, I: V6
) -> dict:
    """Mass, first moment and inertia of the whole animal at B, from the tail's at its mount (Eq.
    2).
    """
    r = tail_mount
    h_B = let("h_B", h + mass[0] * r)
    total = symmetric(I) + let("spread", (h + h_B).dot(r)) * eye(3) - (h * r.T + r * h_B.T)
    diagonal = Matrix([*torso_inertia, 0, 0, 0])
    return {"mass": mass + torso_mass, "h": h_B, "I": entries(total) + diagonal}


def torso_moment(let, tail_mount: V3, torso_mass: V1, mass: V1, h: V3) -> dict:
    """Mass and first moment of the whole animal at B, from the tail's at its mount."""
    return {"mass": mass + torso_mass, "h": h + mass[0] * tail_mount}


def torso_wrench(
    let, tail_mount: V3, torso_mass: V1, torso_inertia: V3, w: V3, w_dot: V3, a: V3, F_next: V6
) -> dict:
    """Inertial wrench of torso and tail at B (Eq. 3), ``F_next`` being the tail's at its mount."""
    force, moment = F_next[0:3, :], F_next[3:6, :]
    I_w = let("I_w", torso_inertia.multiply_elementwise(w))
    euler = torso_inertia.multiply_elementwise(w_dot) + w.cross(I_w)
    return {"force": force + torso_mass[0] * a, "moment": moment + tail_mount.cross(force) + euler}


def wrench_on_torso(let, F_next: V6) -> dict:
    """What the tail exerts on the torso at its mount."""
    return {"mount_force": -F_next[0:3, :], "mount_moment": -F_next[3:6, :]}


def torso_momentum(
    let, tail_mount: V3, torso_mass: V1, torso_inertia: V3, w: V3, u_torso: V3, F_next: V6
) -> dict:
    """Momentum and angular momentum of torso and tail at B, torso axes; kinetic energy of the torso
    alone.
    """
    force, moment = F_next[0:3, :], F_next[3:6, :]
    p = let("p", torso_mass[0] * u_torso)
    L = let("L", torso_inertia.multiply_elementwise(w))
    return {
        "force": force + p,
        "moment": moment + tail_mount.cross(force) + L,
        "kinetic": [let("twice", u_torso.dot(p) + w.dot(L)) / 2],
    }


def potential_energy(let, gravity: V1, R: M33, p: V3, mass: V1, h: V3) -> dict:
    """g (M z_b + z . R_b h)."""
    return {"potential": [gravity[0] * (mass[0] * p[2] + R.row(2).dot(h))]}


def potential_energy_sloped(let, gravity_vector: V3, R: M33, p: V3, mass: V1, h: V3) -> dict:
    """-g . (M p_b + R_b h)."""
    return {"potential": [-gravity_vector.dot(mass[0] * p + R * h)]}


def momentum_at_com(let, R: M33, p_dot: V3, mass: V1, h: V3, force: V3, moment: V3) -> dict:
    """Momentum, and angular momentum about the COM, world axes; ``force, moment`` taken at rest of
    B.
    """
    return {
        "linear": mass[0] * p_dot + R * force,
        "angular": R * (moment - h.cross(force) / mass[0]),
    }


def com_at_base(let, R: M33, p: V3, p_dot: V3, omega: V3, mass: V1, h: V3) -> dict:
    """Position and velocity of the COM while the tail does not bend: p + R c, p_dot + R (omega x
    c), c = h / M; and its Jacobian [1, -R skew(c)], row by row.
    """
    inverse = let("inverse", 1 / mass[0])
    c = let("c", h * inverse)
    skewed = let("skewed", R * Matrix([[0, c[2], -c[1]], [-c[2], 0, c[0]], [c[1], -c[0], 0]]))
    rows = {f"J_{name}": Matrix([*eye(3).row(k), *skewed.row(k)]) for k, name in enumerate("xyz")}
    motion = {"position": p + R * c, "velocity": p_dot + skewed * omega}
    return motion | {"inverse_mass": [inverse]} | rows


def com_of_coordinate(let, R: M33, inverse_mass: V1, column: V6, rate: V1) -> dict:
    """Velocity of the COM per rate of one tail coordinate, R f_k / M, and the contribution of its
    rate.
    """
    J = let("J", R * column[0:3, :] * inverse_mass[0])
    return {"J_column": J, "velocity": J * rate[0]}


def com_velocity(let, inverse_mass: V1, linear: V3) -> dict:
    """Velocity of the COM from the animal's momentum."""
    return {"velocity": linear * inverse_mass[0]}


def mass_matrix_base(let, R: M33, mass: V1, h: V3, I: V6) -> dict:
    """The 6 x 6 block of H for (p_dot world, omega body): M 1, -R skew(h), I."""
    skewed = R * Matrix([[0, h[2], -h[1]], [-h[2], 0, h[0]], [h[1], -h[0], 0]])
    upper, lower = Matrix.hstack(mass[0] * eye(3), skewed), Matrix.hstack(skewed.T, symmetric(I))
    return {f"H_{k}": Matrix.vstack(upper, lower).row(k).T for k in range(6)}


def mass_matrix_column(let, R: M33, column: V6) -> dict:
    """Coupling of one tail coordinate with (p_dot world, omega body)."""
    values = Matrix([R * column[0:3, :], column[3:6, :]])
    return {"H_column": values, "H_row": values}


def mount_position(let, R: M33, p: V3, tail_mount: V3) -> dict:
    """p_1,jnt = p_b + R_b p_b2t (Eq. 14)."""
    return {"P": p + R * tail_mount}


def torso_velocity(let, R: M33, p_dot: V3) -> dict:
    """v_b in the torso frame."""
    return {"u": R.T * p_dot}


def mount_velocity(let, u: V3, w: V3, tail_mount: V3) -> dict:
    """v_1,jnt = v_b + omega_b x p_b2t (Eq. A3) in the torso frame."""
    return {"u": u + w.cross(tail_mount)}


def mount_acceleration(let, w: V3, w_dot: V3, a: V3, tail_mount: V3) -> dict:
    """v_dot_1,jnt of A11 in the torso frame; ``a`` is R_b^T (p_b_ddot + g), gravity being an
    acceleration of B.
    """
    return {"a_mount": a + w_dot.cross(tail_mount) + w.cross(let("r", w.cross(tail_mount)))}


def torso_acceleration(let, R: M33, p_ddot: V3, gravity: V1) -> dict:
    """a = R_b^T (p_b_ddot + g z): all that gravity and translation do in flight (Eqs. 3, 17)."""
    return {"a": R.T * (p_ddot + gravity[0] * Z)}


def torso_acceleration_sloped(let, R: M33, p_ddot: V3, gravity_vector: V3) -> dict:
    """a = R_b^T (p_b_ddot - g)."""
    return {"a": R.T * (p_ddot - gravity_vector)}
