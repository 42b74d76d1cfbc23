"""The continuum tail: bend components of constant-curvature segments in, poses, inertias and
wrenches out (Sect. 2.3).

A segment's bend is (a, b), its rotation Exp([a, 0, b]); z = a^2 + b^2 is the squared bend angle.
Slice x in [0, 1] lies at ``L (-sigma y + gamma u)`` from the segment's root, with u = (b, 0, -a),
sigma = x c1(x^2 z) and gamma = x^2 c2(x^2 z), c_k being Stumpff's functions.  These are entire
functions of z: nothing is singular or lost where the segment is straight.

The integrals over x of Eqs. 18, 19, which Appendix B writes in sines and powers of 1 / theta, are
here seven form factors, exact rational combinations of c_k(z) and c_k(4 z), and their
z-derivatives.
"""

from sympy import Matrix, eye

from .arc_shape import factors
from .rotations import X, Y, Z, entries, symmetric
from .shapes import M33, V1, V2, V3, V6, V8, V12, V16


def section_properties(let, tail_mass: V1, tail_length: V1, share: V1) -> dict:
    """Mass and length of one of m equal pieces, ``share`` = 1 / m (m_ct, L_ct)."""
    return {"section": Matrix([tail_mass[0], tail_length[0]]) * share[0]}


def geometry(let, angles) -> tuple:
    """Return a, b, k = (a, 0, b), u = (b, 0, -a), and du/da, du/db."""
    a, b = angles
    return a, b, Matrix([a, 0, b]), Matrix([b, 0, -a]), (-Z, X)


def segment_tip(let, angles: V2, tip: V8, section: V2) -> dict:
    """Rotation to the tip (Eq. 33), its position (Eq. 34), and how both move with a and b, in the
    root frame.

    ``E`` = 1 + c1 K + c2 K^2; the tip turns by (1 + c2 K + c3 K^2) (a_dot, 0, b_dot).
    """
    a, b, k, u, du = geometry(let, angles)
    c1, c2, c3, c1_z, c2_z, _, _, _ = tip
    length = section[1]
    K_squared = k * k.T - (a * a + b * b) * eye(3)
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


def segment_inertia(let, angles: V2, shape: V16, section: V2) -> dict:
    """A segment's first moment and inertia at its root, momentum columns of a and b, and 2 x 2
    block of H (Eq. 18).
    """
    a, b, _, u, du = geometry(let, angles)
    m, length = section
    f, (moment, spread) = factors(shape), let("mL", Matrix([m * length, m * length * length]))
    second = f["ss"] * Y * Y.T - f["sg"] * (Y * u.T + u * Y.T) + f["gg"] * u * u.T
    columns = []
    for q, d in zip((a, b), du, strict=True):
        linear = 2 * q * (f["g_z"] * u - f["s_z"] * Y) + f["g"] * d
        angular = 2 * q * f["side"] * Y.cross(u) - f["sg"] * Y.cross(d) + f["gg"] * u.cross(d)
        columns.append(Matrix([moment * let("p", linear), spread * let("L", angular)]))
    block = Matrix([f["gg"] + a * a * f["along"], a * b * f["along"], f["gg"] + b * b * f["along"]])
    return {
        "h_own": moment * let("h", f["g"] * u - f["s"] * Y),
        "I_own": entries(spread * let("I", 2 * f["g"] * eye(3) - second)),
        "pitch_own": columns[0],
        "yaw_own": columns[1],
        "H_own": spread * let("H", block),
    }


def bending_rates(let, angles, rates) -> tuple:
    """Return z_dot, z_ddot at constant rates, a_dot b - a b_dot, and u_dot."""
    a, b = angles
    z_dot = let("z_dot", 2 * (a * rates[0] + b * rates[1]))
    z_ddot = let("z_ddot", 2 * (rates[0] ** 2 + rates[1] ** 2))
    return z_dot, z_ddot, let("area", rates[0] * b - a * rates[1]), Matrix([rates[1], 0, -rates[0]])


def relative_wrench(let, angles, rates, shape, w) -> tuple[Matrix, Matrix]:
    """What bending adds at fixed rates: integrals of r_ddot over m L, of r x (2 w x r_dot + r_ddot)
    over m L^2.

    r = -sigma y + gamma u; with N the integral of r r_dot^T, that of r x (w x r_dot) is tr(N) w -
    N^T w.
    """
    f = factors(shape)
    _, _, _, u, _ = geometry(let, angles)
    z_dot, z_ddot, area, u_dot = bending_rates(let, angles, rates)
    square_rate, w_u, wy = let("square_rate", z_dot**2), let("w_u", w.dot(u)), w[1]
    on_y, on_u = (let("r_ddot", f[n + "_zz"] * square_rate + f[n + "_z"] * z_ddot) for n in "sg")
    force = on_u * u + 2 * let("lean", f["g_z"] * z_dot) * u_dot - on_y * Y
    N_y = let("N_y", z_dot * (f["ss_z"] / 2 * wy - f["sz_g"] * w_u))
    N_u = let("N_u", z_dot * (f["gg_z"] / 2 * w_u - f["s_gz"] * wy))
    coriolis = (
        let("trace", f["g_z"] * z_dot) * w
        - N_y * Y
        - N_u * u
        - let("N_d", f["gg"] * w_u - f["sg"] * wy) * u_dot
    )
    moment = let("side", f["side_z"] * square_rate + f["side"] * z_ddot) * Y.cross(u)
    moment += f["gg_z"] * z_dot * area * Y - let("tilt", 2 * f["s_gz"] * z_dot) * Y.cross(u_dot)
    return force, 2 * coriolis + moment


def relative_loads(let, angles, rates, shape, w) -> list:
    """Integrals of dr/da and dr/db times w x (w x r) + 2 w x r_dot + r_ddot at fixed rates, over m
    L^2.

    The last is Lagrange's: bending alone has the energy (gg (a_dot^2 + b_dot^2) + along (z_dot /
    2)^2) / 2.
    """
    f = factors(shape)
    a, b, _, u, du = geometry(let, angles)
    z_dot, z_ddot, area, _ = bending_rates(let, angles, rates)
    w_u, wy = let("w_u", w.dot(u)), w[1]
    quadratic = f["ss_z"] * wy**2 - 2 * f["sg_z"] * wy * w_u + f["gg_z"] * w_u**2
    gyro = 2 * f["sz_g"] * (rates[0] * w[0] + rates[1] * w[2]) + f["gg_z"] * area * wy
    own = f["along_z"] / 4 * z_dot**2 + (f["along"] - f["gg_z"]) / 2 * z_ddot
    common = let("common", quadratic - 2 * f["g_z"] * let("ww", w.dot(w)) - 2 * gyro + own)
    lever = let("lever", f["gg"] * w_u - f["sg"] * wy)
    tilt, turn = let("tilt", 2 * f["sz_g"] * z_dot), let("turn", f["gg_z"] * z_dot * wy)
    swing = let("swing", 2 * f["gg"] * wy)
    loads = []
    for k, (across, across_rate) in enumerate(((b, rates[1]), (-a, -rates[0]))):
        relative = (
            tilt * w[2 * k] + turn * across + swing * across_rate + f["gg_z"] * z_dot * rates[k]
        )
        loads.append(angles[k] * common + lever * w.dot(du[k]) + relative)
    return loads


def segment_wrench(
    let,
    angles: V2,
    rates: V2,
    accelerations: V2,
    shape: V16,
    section: V2,
    h_own: V3,
    I_own: V6,
    pitch_own: V6,
    yaw_own: V6,
    H_own: V3,
    w: V3,
    w_dot: V3,
    a: V3,
) -> dict:
    """Inertial wrench of a segment at its root and its two generalised forces (Eq. 19), in the root
    frame.

    ``w, w_dot, a`` are of the root frame.
    """
    m, length = section
    moment, spread = let("mL", Matrix([m * length, m * length * length]))
    force_r, moment_r = relative_wrench(let, angles, rates, shape, w)
    loads = relative_loads(let, angles, rates, shape, w)
    p = let("p", rates[0] * pitch_own[0:3, :] + rates[1] * yaw_own[0:3, :])
    bending = let("bending", accelerations[0] * pitch_own + accelerations[1] * yaw_own)
    force = (
        m * a
        + w_dot.cross(h_own)
        + w.cross(let("c", w.cross(h_own) + 2 * p))
        + bending[0:3, :]
        + moment * force_r
    )
    inertia = symmetric(I_own)
    torque = h_own.cross(a) + inertia * w_dot + w.cross(let("Iw", inertia * w)) + bending[3:6, :]
    own = []
    for k, column in enumerate((pitch_own, yaw_own)):
        inertial = (
            column[0:3, :].dot(a) + column[3:6, :].dot(w_dot) + spread * let("load", loads[k])
        )
        own.append(inertial + H_own[k] * accelerations[0] + H_own[k + 1] * accelerations[1])
    return {
        "F": Matrix([force, torque + spread * let("moment", moment_r)]),
        "torque_own": Matrix(own),
    }


def rotated_inertia(let, E, I) -> Matrix:
    """E I E^T."""
    return let("turned", entries(let("half", E * symmetric(I)) * E.T))


def segment_motion(
    let,
    angles: V2,
    rates: V2,
    accelerations: V2,
    section: V2,
    tip: V8,
    E: M33,
    r: V3,
    bend: V12,
    w: V3,
    w_dot: V3,
    a: V3,
) -> dict:
    """Angular velocity, its rate and acceleration of the tip, in its frame, from the root's in the
    root frame.
    """
    alpha, beta, _, u, du = geometry(let, angles)
    _, _, c3, c1_z, c2_z, c3_z, c1_zz, c2_zz = tip
    z_dot = let("z_dot", 2 * (alpha * rates[0] + beta * rates[1]))
    z_ddot = let("z_ddot", 2 * (rates[0] ** 2 + rates[1] ** 2))
    area = let("area", beta * rates[0] - alpha * rates[1])
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
    turn, r_dot = velocity_columns(let, bend, rates)
    turn_q, move_q = velocity_columns(let, bend, accelerations)
    w_r = let("w_r", w.cross(r))
    w_tip_dot = w_dot + w.cross(turn) + turn_rate + turn_q
    a_tip = a + w_dot.cross(r) + w.cross(let("v", w_r + 2 * r_dot)) + r_ddot + move_q
    E = E.T
    return {
        "w": E * let("w", w + turn),
        "w_dot": E * let("w_dot", w_tip_dot),
        "a": E * let("a", a_tip),
    }


def segment_power(
    let,
    angles: V2,
    rates: V2,
    accelerations: V2,
    virtual_rates: V2,
    shape: V16,
    section: V2,
    tip: V8,
    E: M33,
    r: V3,
    bend: V12,
    h_own: V3,
    I_own: V6,
    pitch_own: V6,
    yaw_own: V6,
    H_own: V3,
    w: V3,
    w_dot: V3,
    a: V3,
    w_virtual: V3,
    u_virtual: V3,
) -> dict:
    """Power of the inertial wrench of a segment and of its generalised forces (Eq. 19) under a
    virtual motion.
    """
    own = segment_wrench(
        let,
        angles,
        rates,
        accelerations,
        shape,
        section,
        h_own,
        I_own,
        pitch_own,
        yaw_own,
        H_own,
        w,
        w_dot,
        a,
    )
    F, torque = let("F", own["F"]), let("torque", own["torque_own"])
    power = F[0:3, :].dot(u_virtual) + F[3:6, :].dot(w_virtual) + torque.dot(virtual_rates)
    motion = segment_motion(
        let, angles, rates, accelerations, section, tip, E, r, bend, w, w_dot, a
    )
    virtual = segment_velocity(let, virtual_rates, E, r, bend, w_virtual, u_virtual)
    return {"power": [power], **motion, "w_virtual": virtual["w"], "u_virtual": virtual["u"]}


def velocity_columns(let, bend, rates) -> tuple[Matrix, Matrix]:
    """Angular and linear velocity of the tip relative to the root for rates of (a, b)."""
    total = let("relative", rates[0] * bend[0:6, :] + rates[1] * bend[6:12, :])
    return total[0:3, :], total[3:6, :]


def segment_pose(let, E: M33, r: V3, R: M33, P: V3) -> dict:
    """R_{i+1} = R_i E (Eq. 33) and p_{i+1} = p_i + R_i r (Eq. 34)."""
    return {"R": R * E, "P": P + R * r}


def segment_twist(let, E: M33, r: V3, bend: V12, R: M33, P: V3) -> dict:
    """Spatial columns at B of a segment's bend: angular, then the velocity of the point of the
    tip's body at B.
    """
    tip, out = let("tip", P + R * r), []
    for k in (0, 6):
        turn = let("turn", R * bend[k : k + 3, :])
        out += [turn, R * bend[k + 3 : k + 6, :] + tip.cross(turn)]
    return {"S": Matrix(out)}


def gather_segment_wrench(let, E: M33, r: V3, bend: V12, F: V6, torque_own: V2, F_next: V6) -> dict:
    """Add what the next segment passes on, in this segment's root frame; generalised forces of a
    and b.
    """
    force, moment = let("force", E * F_next[0:3, :]), let("moment", E * F_next[3:6, :])
    torque = [bend[k : k + 3, :].dot(moment) + bend[k + 3 : k + 6, :].dot(force) for k in (0, 6)]
    total = Matrix([F[0:3, :] + force, F[3:6, :] + moment + r.cross(force)])
    return {"F_next": total, "torque": torque_own + Matrix(torque)}


def gather_segment(
    let,
    section: V2,
    E: M33,
    r: V3,
    bend: V12,
    h_own: V3,
    I_own: V6,
    pitch_own: V6,
    yaw_own: V6,
    H_own: V3,
    mass: V1,
    h: V3,
    I: V6,
) -> dict:
    """Composite inertia at the root from what hangs at the tip, the momentum columns of a and b,
    their block of H.
    """
    h_tip, I_tip = let("h_tip", E * h), symmetric(rotated_inertia(let, E, I))
    h_root = let("h_root", h_tip + mass[0] * r)
    spread = let("spread", (h_tip + h_root).dot(r))
    I_root = entries(I_tip + spread * eye(3) - (h_tip * r.T + r * h_root.T))
    columns, twists = [], []
    for k, own in ((0, pitch_own), (6, yaw_own)):
        turn, move = bend[k : k + 3, :], bend[k + 3 : k + 6, :]
        p = let("p", mass[0] * move + turn.cross(h_tip))
        L = let("L", I_tip * turn + h_tip.cross(move))
        twists.append((turn, move, p, L))
        columns.append(Matrix([own[0:3, :] + p, own[3:6, :] + L + r.cross(p)]))
    beyond = [
        twists[i][0].dot(twists[j][3]) + twists[i][1].dot(twists[j][2])
        for i, j in ((0, 0), (1, 0), (1, 1))
    ]
    return {
        "mass": mass + Matrix([section[0]]),
        "h": h_own + h_root,
        "I": I_own + I_root,
        "pitch": columns[0],
        "yaw": columns[1],
        **{name: [H_own[k] + beyond[k]] for k, name in enumerate(("H_pp", "H_py", "H_yy"))},
    }


def gather_segment_moment(let, section: V2, E: M33, r: V3, h_own: V3, mass: V1, h: V3) -> dict:
    """Mass and first moment of a segment and all beyond, at its root."""
    return {"mass": mass + Matrix([section[0]]), "h": h_own + E * h + mass[0] * r}


def segment_velocity(let, rates: V2, E: M33, r: V3, bend: V12, w: V3, u: V3) -> dict:
    """Angular and linear velocity of the tip, in its frame."""
    turn, move = velocity_columns(let, bend, rates)
    E = E.T
    return {"w": E * let("w", w + turn), "u": E * let("u", u + w.cross(r) + move)}


def segment_momentum(
    let,
    rates: V2,
    section: V2,
    h_own: V3,
    I_own: V6,
    pitch_own: V6,
    yaw_own: V6,
    H_own: V3,
    w: V3,
    u: V3,
) -> dict:
    """Momentum of a segment, its moment about the root, and its kinetic energy."""
    relative = let("relative", rates[0] * pitch_own + rates[1] * yaw_own)
    p = let("p", section[0] * u + w.cross(h_own) + relative[0:3, :])
    L = let("L", symmetric(I_own) * w + h_own.cross(u) + relative[3:6, :])
    own = rates[0] ** 2 * H_own[0] + 2 * rates[0] * rates[1] * H_own[1] + rates[1] ** 2 * H_own[2]
    twice = let(
        "twice", u.dot(p) + w.dot(L) + u.dot(relative[0:3, :]) + w.dot(relative[3:6, :]) + own
    )
    return {"F": Matrix([p, L]), "kinetic": [twice / 2]}


def part_of_bend(let, angles: V2, fraction: V1) -> dict:
    """Bend of an n-th of a segment."""
    return {"part": angles * fraction[0]}


def columns_of_bend(let, bend: V12, fraction: V1) -> dict:
    """Columns for the rates of a whole segment from those for the rates of an n-th of it."""
    return {"bend": bend * fraction[0]}
