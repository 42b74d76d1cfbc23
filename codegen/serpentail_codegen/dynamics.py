"""Dynamics of torso and links: SymPy vectors in, inertias, momenta and wrenches out (Sect. 2, Eqs. 2, 3, 16, 17).

A link is given by ``link`` = (m, L, m L / 2, I_x, I_y, I_z), the moments of inertia taken about its joint.  A body set
is given by its mass, first moment ``h`` = sum m r, and ``I`` = (xx, yy, zz, xy, xz, yz) about the frame's origin.  A
wrench or momentum ``F`` = (force or momentum, its moment about the origin).
"""

from sympy import Matrix, eye, zeros

from .kinematics import X, Y, Z, joint_turns, link_angular_velocity, link_linear_velocity, link_motion, square


def symmetric(I) -> Matrix:
    """Return the symmetric 3 x 3 matrix of (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = I
    return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def entries(tensor) -> Matrix:
    """Return (xx, yy, zz, xy, xz, yz) of a symmetric matrix."""
    return Matrix([tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])


def link_properties(let, tail_mass, tail_length, link_inertia, share) -> dict:
    """Properties of one of N equal links, ``share`` = 1 / N: m_at = m_t / N, L_j2c = L_j2j / 2 (Sect. 4)."""
    m, length = let("even", Matrix([tail_mass[0], tail_length[0]]) * share[0])
    half_moment = let("b", m * length / 2)
    steiner = let("steiner", half_moment * length / 2)
    Ix, Iy, Iz = link_inertia
    return {"link": Matrix([m, length, half_moment, Ix + steiner, Iy, Iz + steiner])}


def link_wrench(let, link, w, w_dot, a_joint, swing) -> dict:
    """Inertial wrench of one link at its joint (Eq. 17), Newton and Euler in the link frame."""
    m, _, b, Ix, Iy, Iz = link
    force = m * a_joint - b * swing
    euler = Matrix(
        [
            Ix * w_dot[0] + (Iz - Iy) * w[1] * w[2],
            Iy * w_dot[1] + (Ix - Iz) * w[0] * w[2],
            Iz * w_dot[2] + (Iy - Ix) * w[0] * w[1],
        ]
    )
    return {"F": Matrix([force, euler + b * Matrix([-a_joint[2], 0, a_joint[0]])])}


def link_power(let, joint, rates, accelerations, virtual_rates, link, w, w_dot, a, w_virtual, u_virtual) -> dict:
    """Power of the inertial wrench of one link (Eq. 17) under a virtual motion; both motions carried on."""
    motion = {k: let(k, x) for k, x in link_motion(let, joint, rates, accelerations, link, w, w_dot, a).items()}
    F = let("F", link_wrench(let, link, motion["w"], motion["w_dot"], motion["a_joint"], motion["swing"])["F"])
    turn = let("turn", link_angular_velocity(let, joint, virtual_rates, w_virtual)["w"])
    slide = {k: let(k, x) for k, x in link_linear_velocity(let, joint, link, turn, u_virtual).items()}
    power = F[0:3, :].dot(slide["u_joint"]) + F[3:6, :].dot(turn)
    carried = {name: motion[name] for name in ("w", "w_dot", "a")}
    return {"power": [power], **carried, "w_virtual": turn, "u_virtual": slide["u"]}


def torso_power(let, torso_mass, torso_inertia, w, w_dot, a, w_virtual, u_virtual) -> dict:
    """Power of the torso's inertial wrench at B (Eq. 3) under a virtual motion, torso axes."""
    euler = torso_inertia.multiply_elementwise(w_dot) + w.cross(let("I_w", torso_inertia.multiply_elementwise(w)))
    return {"power": [torso_mass[0] * let("a_u", a.dot(u_virtual)) + w_virtual.dot(let("euler", euler))]}


def along_link(let, length, F) -> Matrix:
    """Move a wrench from the next joint to this one: n' = n + (-L y) x f."""
    return let("moved", Matrix([F[0], F[1], F[2], F[3] - length * F[2], F[4], F[5] + length * F[0]]))


def turned(let, name, turn, F) -> Matrix:
    """Rotate force and moment."""
    return let(name, Matrix([turn * F[0:3, :], turn * F[3:6, :]]))


def gather_wrench(let, joint, link, F, F_next) -> dict:
    """Add what the next link passes on, read the joint torques (A5 on Eq. 17), pass on to the parent frame."""
    turn_x, turn_z = joint_turns(joint)
    total = let("total", F + along_link(let, link[1], F_next))
    mid = turned(let, "mid", turn_z, total)
    return {"F_next": turned(let, "out", turn_x, mid), "torque": Matrix([mid[3], total[5]])}


def turned_inertia(let, axes, turn, twice, I) -> Matrix:
    """R I R^T for a turn in the plane of axes (i, j), k normal to it, by the double angle."""
    i, j, k = axes
    c, s = turn[i, i], turn[j, i]
    sine_squared, product, double_product, cosine, cosine_squared = twice
    tensor = symmetric(I)
    d = let("d", tensor[i, i] - tensor[j, j])
    t = let("t", double_product * tensor[i, j])
    out = zeros(3, 3)
    # sums, not I_ii - s^2 d: a thin link turned by 90 degrees would be the difference of two thick ones
    out[i, i] = cosine_squared * tensor[i, i] + sine_squared * tensor[j, j] - t
    out[j, j] = sine_squared * tensor[i, i] + cosine_squared * tensor[j, j] + t
    out[k, k] = tensor[k, k]
    out[i, j] = product * d + cosine * tensor[i, j]
    out[i, k] = c * tensor[i, k] - s * tensor[j, k]
    out[j, k] = s * tensor[i, k] + c * tensor[j, k]
    out[j, i], out[k, i], out[k, j] = out[i, j], out[i, k], out[j, k]
    return entries(out)


def with_link(let, mass, link, h, I) -> tuple[Matrix, Matrix]:
    """First moment and inertia about this joint of one link and what hangs at its end, ``mass, h, I`` at that end."""
    _, length, b, Ix, Iy, Iz = link
    moment = let("moment", h[1] - mass[0] * length)
    steiner = let("steiner", length * (h[1] + moment))
    h_sum = Matrix([h[0], moment - b, h[2]])
    I_sum = [I[0] - steiner + Ix, I[1] + Iy, I[2] - steiner + Iz, I[3] + length * h[0], I[4], I[5] + length * h[2]]
    return let("h_sum", h_sum), let("I_sum", Matrix(I_sum))


def gather_links(let, joint, twice, link, mass, h, I, pitch, yaw) -> dict:
    """One link of the tip-to-base sweep of Eq. 16: composite inertia and the momentum columns of the segment.

    ``pitch`` and ``yaw`` are momenta, at this frame's origin, of everything beyond per unit alpha_dot and beta_dot of
    the segment's joints passed so far; ``H_pp, H_py, H_yy`` are what this joint adds to the segment's own block.
    """
    turn_x, turn_z = joint_turns(joint)
    h, I = with_link(let, mass, link, h, I)
    pitch, yaw = along_link(let, link[1], pitch), along_link(let, link[1], yaw)
    H_yy, H_py = 2 * yaw[5] + I[2], pitch[5]
    yaw = let("yaw_here", yaw + Matrix([Z.cross(h), symmetric(I) * Z]))

    h, I = let("h_mid", turn_z * h), let("I_mid", turned_inertia(let, (0, 1, 2), turn_z, twice[5:10], I))
    pitch, yaw = turned(let, "pitch_mid", turn_z, pitch), turned(let, "yaw_mid", turn_z, yaw)
    H_pp, H_py = 2 * pitch[3] + I[0], H_py + yaw[3]
    pitch = let("pitch_here", pitch + Matrix([X.cross(h), symmetric(I) * X]))

    return {
        "mass": mass + Matrix([link[0]]),
        "h": turn_x * h,
        "I": turned_inertia(let, (1, 2, 0), turn_x, twice[0:5], I),
        "pitch": turned(let, "pitch_out", turn_x, pitch),
        "yaw": turned(let, "yaw_out", turn_x, yaw),
        "H_pp": [H_pp],
        "H_py": [H_py],
        "H_yy": [H_yy],
    }


def gather_moment(let, joint, link, mass, h) -> dict:
    """Mass and first moment of one link and all beyond, about its joint, in the parent's frame."""
    turn_x, turn_z = joint_turns(joint)
    here = Matrix([h[0], h[1] - mass[0] * link[1] - link[2], h[2]])
    return {"mass": mass + Matrix([link[0]]), "h": turn_x * let("mid", turn_z * here)}


def column_at_torso(let, R, P, pitch, yaw) -> dict:
    """Momentum columns of a segment, from its root frame at ``P`` to the torso frame at B."""
    R = square(R)
    out = []
    for column in (pitch, yaw):
        force = let("force", R * column[0:3, :])
        out += [force, R * column[3:6, :] + P.cross(force)]
    return {"columns": Matrix(out)}


def segment_coupling(let, S, columns) -> dict:
    """Block of H between a segment and one beyond it: spatial columns at B times momentum columns at B (Eq. 16)."""
    block = [
        S[a : a + 3, :].dot(columns[b + 3 : b + 6, :]) + S[a + 3 : a + 6, :].dot(columns[b : b + 3, :])
        for b in (0, 6)
        for a in (0, 6)
    ]
    return {"H_pitch": Matrix(block[0:2]), "H_yaw": Matrix(block[2:4])}


def torso_composite(let, tail_mount, torso_mass, torso_inertia, mass, h, I) -> dict:
    """Mass, first moment and inertia of the whole animal at B, from the tail's at its mount (Eq. 2)."""
    r = tail_mount
    h_B = let("h_B", h + mass[0] * r)
    total = symmetric(I) + let("spread", (h + h_B).dot(r)) * eye(3) - (h * r.T + r * h_B.T)
    diagonal = Matrix([*torso_inertia, 0, 0, 0])
    return {"mass": mass + torso_mass, "h": h_B, "I": entries(total) + diagonal}


def torso_moment(let, tail_mount, torso_mass, mass, h) -> dict:
    """Mass and first moment of the whole animal at B, from the tail's at its mount."""
    return {"mass": mass + torso_mass, "h": h + mass[0] * tail_mount}


def torso_wrench(let, tail_mount, torso_mass, torso_inertia, w, w_dot, a, F_next) -> dict:
    """Inertial wrench of torso and tail at B (Eq. 3), ``F_next`` being the tail's at its mount."""
    force, moment = F_next[0:3, :], F_next[3:6, :]
    I_w = let("I_w", torso_inertia.multiply_elementwise(w))
    euler = torso_inertia.multiply_elementwise(w_dot) + w.cross(I_w)
    return {"force": force + torso_mass[0] * a, "moment": moment + tail_mount.cross(force) + euler}


def torso_momentum(let, tail_mount, torso_mass, torso_inertia, w, u_torso, F_next) -> dict:
    """Momentum and angular momentum of torso and tail at B, torso axes; kinetic energy of the torso alone."""
    force, moment = F_next[0:3, :], F_next[3:6, :]
    p = let("p", torso_mass[0] * u_torso)
    L = let("L", torso_inertia.multiply_elementwise(w))
    return {
        "force": force + p,
        "moment": moment + tail_mount.cross(force) + L,
        "kinetic": [let("twice", u_torso.dot(p) + w.dot(L)) / 2],
    }


def link_momentum(let, link, w, u_joint) -> dict:
    """Momentum of one link, its moment about the joint, and the kinetic energy (u . p + omega . L) / 2."""
    m, _, b, Ix, Iy, Iz = link
    p = let("p", m * u_joint + b * Matrix([w[2], 0, -w[0]]))
    L = let("L", Matrix([Ix * w[0] - b * u_joint[2], Iy * w[1], Iz * w[2] + b * u_joint[0]]))
    return {"F": Matrix([p, L]), "kinetic": [let("twice", u_joint.dot(p) + w.dot(L)) / 2]}


def potential_energy(let, gravity, R, p, mass, h) -> dict:
    """g (M z_b + z . R_b h)."""
    return {"potential": [gravity[0] * (mass[0] * p[2] + square(R).row(2).dot(h))]}


def momentum_at_com(let, R, p_dot, mass, h, force, moment) -> dict:
    """Momentum, and angular momentum about the COM, world axes; ``force, moment`` taken at rest of B."""
    R = square(R)
    return {"linear": mass[0] * p_dot + R * force, "angular": R * (moment - h.cross(force) / mass[0])}


def world_vector(let, R, vector) -> dict:
    """Turn a vector from torso axes to world axes."""
    return {"vector": square(R) * vector}


def mass_matrix_base(let, R, mass, h, I) -> dict:
    """The 6 x 6 block of H for (p_dot world, omega body): M 1, -R skew(h), I."""
    skewed = square(R) * Matrix([[0, h[2], -h[1]], [-h[2], 0, h[0]], [h[1], -h[0], 0]])
    upper, lower = Matrix.hstack(mass[0] * eye(3), skewed), Matrix.hstack(skewed.T, symmetric(I))
    return {f"H_{k}": Matrix.vstack(upper, lower).row(k).T for k in range(6)}


def mass_matrix_column(let, R, column) -> dict:
    """Coupling of one tail coordinate with (p_dot world, omega body)."""
    values = Matrix([square(R) * column[0:3, :], column[3:6, :]])
    return {"H_column": values, "H_row": values}


def world_composite(let, R, h, I) -> dict:
    """First moment and inertia turned from torso axes to world axes (Eq. A14)."""
    R = square(R)
    half = let("half", R * symmetric(I))
    return {"h": R * h, "I": entries(half * R.T)}


def without_translation(let, mass, h, I) -> dict:
    """Rotational block about the COM: I - (h . h 1 - h h^T) / M; COM from B, c = h / M; and 1 / M."""
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
    """Right-hand side for omega_dot: applied minus inertial moment about the COM; and the net force."""
    net = let("net", load_force - force)
    return {"net": net, "rhs": load_moment - moment - com.cross(net)}


def tail_load(let, inverse_mass, net, column, inertial, tau) -> dict:
    """Right-hand side for one tail coordinate, translation eliminated: tau - c_k - f_k . net / M."""
    return {"rhs": [tau[0] - inertial[0] - inverse_mass[0] * column[0:3, :].dot(net)]}


def column_acceleration(let, column, acceleration) -> dict:
    """f_k q_ddot_k: the momentum rate that one tail coordinate gives at rest of B."""
    return {"tail_force": column[0:3, :] * acceleration[0]}


def base_acceleration(let, R, gravity, inverse_mass, h, net, w_dot, tail_force) -> dict:
    """p_b_ddot = R_b (net - omega_dot x h - sum f_k q_ddot_k) / M - g z."""
    a = let("a", inverse_mass[0] * (net - w_dot.cross(h) - tail_force))
    return world_acceleration(let, R, gravity, a)


def free_acceleration(let, inverse_mass, com, net, w_dot) -> dict:
    """Acceleration of B, gravity taken off, of what a net force moves: net / M - omega_dot x c, torso axes."""
    return {"a": inverse_mass[0] * net - w_dot.cross(com)}


def world_acceleration(let, R, gravity, a) -> dict:
    """p_b_ddot = R_b a - g z."""
    return {"p_ddot": square(R) * a - gravity[0] * Z}


def coupling_torque(let, column, a, w_dot) -> dict:
    """What accelerations of the torso add to the torque of one tail coordinate."""
    return {"torque": [column[0:3, :].dot(a) + column[3:6, :].dot(w_dot)]}


def turned_acceleration(let, R, a) -> dict:
    """How p_b_ddot = R_b a - g z moves with a turn of the torso in body axes: columns R_b (e_k x a), row by row."""
    columns = [square(R) * axis.cross(a) for axis in (X, Y, Z)]
    return {f"row_{r}": Matrix([column[r] for column in columns]) for r in range(3)}


def turning_acceleration(let, R, a, turn, p_ddot) -> dict:
    """Add what a turn of the torso in body axes does to p_b_ddot = R_b a - g z."""
    return {"p_ddot": p_ddot + square(R) * let("swept", turn.cross(a))}


def load_at_torso(let, R, f_torso, F_beyond) -> dict:
    """All loads at B in torso axes; ``f_torso`` is a force in world axes and a moment in torso axes."""
    force = square(R).T * f_torso[0:3, :] + F_beyond[0:3, :]
    return {"load_force": force, "load_moment": f_torso[3:6, :] + F_beyond[3:6, :]}


def load_at_point(let, R, P, f_point, F_beyond) -> dict:
    """Add a world force at a tail point to the wrench at B of all forces from this point to the tip."""
    force = let("force", square(R).T * f_point)
    return {"F_beyond": F_beyond + Matrix([force, P.cross(force)])}


def joint_load(let, S, F_beyond) -> dict:
    """Generalised force of the tail loads on one joint: J^T f by its spatial columns (Eq. 10)."""
    force, moment = F_beyond[0:3, :], F_beyond[3:6, :]
    pitch = S[0:3, :].dot(moment) + S[3:6, :].dot(force)
    return {"torque": Matrix([pitch, S[6:9, :].dot(moment) + S[9:12, :].dot(force)])}
