"""The continuum tail: bend components of constant-curvature segments in, poses, inertias and wrenches out (Sect. 2.3).

A segment's bend is (a, b), its rotation Exp([a, 0, b]); z = a^2 + b^2 is the squared bend angle.  Slice x in [0, 1]
lies at ``L (-sigma y + gamma u)`` from the segment's root, with u = (b, 0, -a), sigma = x c1(x^2 z) and
gamma = x^2 c2(x^2 z), c_k being Stumpff's functions.  These are entire functions of z: nothing is singular or lost
where the segment is straight.

The integrals over x of Eqs. 18, 19, which Appendix B writes in sines and powers of 1 / theta, are here exact rational
combinations of c_k(z) and c_k(4 z), k <= 11.
"""

from math import factorial

from sympy import Matrix, Rational, eye

from .dynamics import entries, symmetric
from .kinematics import X, Y, Z, square

HIGHEST = 11  # of Stumpff's functions that the integrals need
SERIES_REACH = 6.4  # rad: up to there TERMS terms leave no more than rounding
TERMS = 16

# integral over x of a product of sigma, gamma and their z-derivatives (s, sz, szz; g, gz, gzz):
# (coefficients k: of c_k(z), coefficients k: of c_k(4 z))
INTEGRALS = {
    "s": ({2: 1}, {}),
    "g": ({3: 1}, {}),
    "sz": ({3: Rational(-1, 2), 4: 1}, {}),
    "gz": ({4: Rational(-1, 2), 5: Rational(3, 2)}, {}),
    "szz": ({4: Rational(1, 4), 5: Rational(-5, 4), 6: 2}, {}),
    "gzz": ({5: Rational(1, 4), 6: Rational(-7, 4), 7: Rational(15, 4)}, {}),
    "s_s": ({}, {3: 2}),
    "s_g": ({4: -1}, {4: 4}),
    "g_g": ({5: -2}, {5: 8}),
    "s_sz": ({}, {4: -2, 5: 6}),
    "s_gz": ({6: -1}, {5: -4, 6: 20}),
    "sz_g": ({5: Rational(1, 2), 6: -1}, {5: -4, 6: 12}),
    "g_gz": ({6: Rational(1, 2), 7: Rational(-5, 2)}, {6: -8, 7: 40}),
    "sz_sz": ({}, {5: 2, 6: -12, 7: 20}),
    "gz_gz": ({8: 1, 9: -3}, {7: 8, 8: -80, 9: 208}),
    "s_gzz": ({8: -2}, {6: 4, 7: -48, 8: 176}),
    "szz_g": ({6: Rational(-1, 4), 7: Rational(5, 4), 8: -2}, {6: 4, 7: -32, 8: 80}),
    "g_gzz": ({7: Rational(-1, 4), 8: Rational(7, 4), 9: Rational(-23, 4)}, {7: 8, 8: -96, 9: 352}),
    "sz_szz": ({}, {6: -2, 7: 22, 8: -92, 9: 140}),
    "gz_gzz": ({9: Rational(-1, 4), 10: Rational(11, 4), 11: Rational(-27, 4)}, {8: -8, 9: 136, 10: -848, 11: 1872}),
}


def section_properties(let, tail_mass, tail_length, share) -> dict:
    """Mass and length of one of m equal pieces, ``share`` = 1 / m (m_ct, L_ct)."""
    return {"section": Matrix([tail_mass[0], tail_length[0]]) * share[0]}


def series(let, k: int, w):
    """c_k(w) = sum over j of (-w)^j / (2 j + k)!: even and odd terms side by side, by Horner's rule in w^2."""
    square, halves = let("square", w * w), []
    for first in (0, 1):
        total = Rational(1, factorial(2 * (TERMS - 2 + first) + k))
        for j in range(TERMS - 4 + first, -1, -2):
            total = let("c", Rational(1, factorial(2 * j + k)) + square * total)
        halves.append(total)
    return let("c", halves[0] - w * halves[1])


def ladder(let, w) -> list:
    """c_0 to c_HIGHEST at an argument up to SERIES_REACH^2: series on top, then c_k = 1 / k! - w c_{k+2} downward."""
    c = [0] * (HIGHEST + 1)
    for k in (HIGHEST, HIGHEST - 1):
        c[k] = series(let, k, w)
    for k in range(HIGHEST - 2, -1, -1):
        c[k] = let("c", Rational(1, factorial(k)) - w * c[k + 2])
    return c


def quadrupled(let, c: list) -> list:
    """c_k(4 w) from c_k(w): the integral of (2 - s)^(k-1) cos(sqrt(w) s) / (k - 1)! over [0, 2], cut at 1."""
    out = [2 * c[0] * c[0] - 1]
    for k in range(1, HIGHEST + 1):
        near = sum(c[j] * Rational(1, factorial(k - j)) for j in range(1, k + 1))
        far = c[0] * c[k] + c[1] * (c[k - 1] - Rational(1, factorial(k - 1)))
        out.append(let("q", Rational(1, 2**k) * let("sum", near + far)))
    return out


def segment_shape(let, angles, levels: int = 1) -> dict:
    """What bend does to a segment: the integrals over x, and c_1, c_2, c_3 with z-derivatives at the tip.

    ``levels`` quadruplings carry the series from z / 4^levels to z, so bends up to SERIES_REACH * 2^levels are covered.
    """
    a, b = angles
    z = let("z", a * a + b * b)
    c = ladder(let, let("w", z * Rational(1, 4**levels)))
    for _ in range(levels):
        c = quadrupled(let, c)
    c4 = quadrupled(let, c)
    shape = [
        let(name, sum(f * c[k] for k, f in p.items()) + sum(f * c4[k] for k, f in q.items()))
        for name, (p, q) in INTEGRALS.items()
    ]
    first = [let("c_z", (k * c[k + 2] - c[k + 1]) / 2) for k in (1, 2, 3)]
    second = [let("c_zz", (k * (k + 2) * c[k + 4] - (2 * k + 1) * c[k + 3] + c[k + 2]) / 4) for k in (1, 2)]
    return {"tip": Matrix([c[1], c[2], c[3], *first, *second]), "shape": Matrix(shape)}


def bend_margin(let, angles, bend_range) -> dict:
    """Positive where a segment is bent by less than the declared range, up to rounding."""
    limit = let("limit", bend_range[0] * bend_range[0] * Rational(10**12 + 1, 10**12))
    return {"margin": [limit - angles[0] ** 2 - angles[1] ** 2]}


def geometry(let, angles) -> tuple:
    """Return a, b, k = (a, 0, b), u = (b, 0, -a), and du/da, du/db."""
    a, b = angles
    return a, b, Matrix([a, 0, b]), Matrix([b, 0, -a]), (-Z, X)


def segment_tip(let, angles, tip, section) -> dict:
    """Rotation to the tip (Eq. 33), its position (Eq. 34), and how both move with a and b, in the root frame.

    ``E`` = 1 + c1 K + c2 K^2; the tip turns by (1 + c2 K + c3 K^2) (a_dot, 0, b_dot).
    """
    a, b, k, u, du = geometry(let, angles)
    c1, c2, c3, c1_z, c2_z, _, _, _ = tip
    length = section[1]
    K_squared = k * k.T - (a * a + b * b) * eye(3)
    E = eye(3) + c1 * Matrix([[0, -b, 0], [b, 0, -a], [0, a, 0]]) + c2 * K_squared
    turn = Matrix([[1 - c3 * b * b, c3 * a * b], [c2 * b, -c2 * a], [c3 * a * b, 1 - c3 * a * a]])
    move = [let("move", length * (2 * q * (c2_z * u - c1_z * Y) + c2 * d)) for q, d in zip((a, b), du, strict=True)]
    return {
        "E": E,
        "r": length * (c2 * u - c1 * Y),
        "bend": Matrix([*turn.col(0), *move[0], *turn.col(1), *move[1]]),
    }


def profiles(let, angles) -> tuple:
    """r, dr/da and dr/db over L as functions of x -> vector (Eqs. 20, 25)."""
    a, b, _, u, du = geometry(let, angles)
    partial = [{"sz": -2 * q * Y, "gz": 2 * q * u, "g": d} for q, d in zip((a, b), du, strict=True)]
    return {"s": -Y, "g": u}, *partial


def integrate(let, shape, product, *factors):
    """Integral over x of a bilinear product of profiles, or of one profile (product None)."""
    value = dict(zip(INTEGRALS, shape, strict=True))
    if product is None:
        return let("integral", sum((value[f] * vector for f, vector in factors[0].items()), 0 * Y))
    terms: dict[str, object] = {}
    for f, p in factors[0].items():
        for g, q in factors[1].items():
            name = next((n for n in (f"{f}_{g}", f"{g}_{f}") if n in value), "_".join(sorted((f, g))))
            term = product(p, q)
            terms[name] = terms[name] + term if name in terms else term
    kept = [value[name] * term for name, term in terms.items() if any(e.expand() != 0 for e in Matrix([term]))]
    return let("integral", sum(kept[1:], kept[0]))


def cross(p, q) -> Matrix:
    """p x q."""
    return p.cross(q)


def dot(p, q):
    """p . q."""
    return p.dot(q)


def outer(p, q) -> Matrix:
    """p q^T."""
    return p * q.T


def segment_inertia(let, angles, shape, section) -> dict:
    """A segment's first moment and inertia at its root, momentum columns of a and b, and 2 x 2 block of H (Eq. 18)."""
    r, r_a, r_b = profiles(let, angles)
    m, length = section
    moment, spread = let("mL", m * length), let("mLL", m * length * length)
    second = integrate(let, shape, outer, r, r)
    inertia = let("trace", second.trace()) * eye(3) - second
    columns = [
        Matrix([moment * integrate(let, shape, None, p), spread * integrate(let, shape, cross, r, p)])
        for p in (r_a, r_b)
    ]
    block = [integrate(let, shape, dot, p, q) for p, q in ((r_a, r_a), (r_a, r_b), (r_b, r_b))]
    return {
        "h_own": moment * integrate(let, shape, None, r),
        "I_own": entries(spread * inertia),
        "pitch_own": columns[0],
        "yaw_own": columns[1],
        "H_own": spread * Matrix(block),
    }


def bending_rates(let, angles, rates) -> tuple:
    """Return z_dot, z_ddot at constant rates, a_dot b - a b_dot, and u_dot."""
    a, b = angles
    z_dot = let("z_dot", 2 * (a * rates[0] + b * rates[1]))
    z_ddot = let("z_ddot", 2 * (rates[0] ** 2 + rates[1] ** 2))
    return z_dot, z_ddot, let("area", rates[0] * b - a * rates[1]), Matrix([rates[1], 0, -rates[0]])


def relative_wrench(let, angles, rates, shape, w) -> tuple[Matrix, Matrix]:
    """What bending adds at fixed rates: integrals of r_ddot over m L, of r x (2 w x r_dot + r_ddot) over m L^2.

    r = -s y + g u; with N the integral of r r_dot^T, the integral of r x (w x r_dot) is tr(N) w - N^T w.
    """
    i = dict(zip(INTEGRALS, shape, strict=True))
    a, b, _, u, _ = geometry(let, angles)
    z_dot, z_ddot, area, u_dot = bending_rates(let, angles, rates)
    square_rate, w_u = let("square_rate", z_dot**2), let("w_u", w.dot(u))
    f_y = i["szz"] * square_rate + i["sz"] * z_ddot
    f_u = i["gzz"] * square_rate + i["gz"] * z_ddot
    force = let("f_u", f_u) * u + 2 * let("f_d", i["gz"] * z_dot) * u_dot - f_y * Y
    trace = z_dot * (i["s_sz"] + (a * a + b * b) * i["g_gz"]) + i["g_g"] * z_dot / 2
    on_y, on_u = i["s_sz"] * w[1] - i["sz_g"] * w_u, i["g_gz"] * w_u - i["s_gz"] * w[1]
    across = let("across", i["g_g"] * w_u - i["s_g"] * w[1])
    coriolis = let("trace", trace) * w - z_dot * let("on_y", on_y) * Y - let("on_u", z_dot * on_u) * u - across * u_dot
    # r x r_ddot: y x u = (-a, 0, -b), y x u_dot = (-a_dot, 0, -b_dot), u x u_dot = area y
    sidewise = (i["szz_g"] - i["s_gzz"]) * square_rate + (i["sz_g"] - i["s_gz"]) * z_ddot
    moment = let("sidewise", sidewise) * Matrix([-a, 0, -b])
    moment -= let("lean", 2 * i["s_gz"] * z_dot) * Matrix([-rates[0], 0, -rates[1]])
    moment += 2 * i["g_gz"] * z_dot * area * Y
    return force, 2 * coriolis + moment


def relative_loads(let, angles, rates, shape, w) -> list:
    """Integrals of dr/da and dr/db times w x (w x r) + 2 w x r_dot + r_ddot at fixed rates, over m L^2."""
    i = dict(zip(INTEGRALS, shape, strict=True))
    a, b, _, u, du = geometry(let, angles)
    z = a * a + b * b
    z_dot, z_ddot, area, _ = bending_rates(let, angles, rates)
    square_rate, w_u, wy = let("square_rate", z_dot**2), let("w_u", w.dot(u)), w[1]
    spread = let("spread", 2 * (i["s_sz"] + z * i["g_gz"]) + i["g_g"])
    quadratic = i["s_sz"] * wy**2 - (i["s_gz"] + i["sz_g"]) * wy * w_u + i["g_gz"] * w_u**2
    lever = let("lever", i["g_g"] * w_u - i["s_g"] * wy)
    # along z: dr/dz = -sz y + gz u; across it: g du
    gyro_z = -i["sz_g"] * (rates[0] * w[0] + rates[1] * w[2]) - i["g_gz"] * area * wy
    along = 2 * quadratic - let("ww", w.dot(w)) * spread + 4 * gyro_z
    rate_z = (
        (i["sz_szz"] + z * i["gz_gzz"]) * square_rate
        + (i["sz_sz"] + z * i["gz_gz"]) * z_ddot
        + i["gz_gz"] * square_rate
    )
    along += 2 * rate_z + i["g_gzz"] * square_rate + i["g_gz"] * z_ddot
    along = let("along", along)
    turn = [let("turn", z_dot * i["g_gz"] * wy), let("tilt", z_dot * i["sz_g"])]
    out = []
    for q, q_dot, d, swing, tilt in (
        (a, rates[0], du[0], (b, rates[1]), w[0]),
        (b, rates[1], du[1], (-a, -rates[0]), w[2]),
    ):
        across = lever * w.dot(d) + 2 * (tilt * turn[1] + turn[0] * swing[0] + i["g_g"] * wy * swing[1])
        out.append(q * along + across + 2 * i["g_gz"] * z_dot * q_dot)
    return out


def segment_wrench(
    let, angles, rates, accelerations, shape, section, h_own, I_own, pitch_own, yaw_own, H_own, w, w_dot, a
) -> dict:
    """Inertial wrench of a segment at its root and its two generalised forces (Eq. 19), in the root frame.

    ``w, w_dot, a`` are of the root frame.
    """
    m, length = section
    moment, spread = let("mL", m * length), let("mLL", m * length * length)
    force_r, moment_r = relative_wrench(let, angles, rates, shape, w)
    loads = relative_loads(let, angles, rates, shape, w)
    p = let("p", rates[0] * pitch_own[0:3, :] + rates[1] * yaw_own[0:3, :])
    bending = let("bending", accelerations[0] * pitch_own + accelerations[1] * yaw_own)
    force = m * a + w_dot.cross(h_own) + w.cross(let("c", w.cross(h_own) + 2 * p)) + bending[0:3, :] + moment * force_r
    inertia = symmetric(I_own)
    torque = h_own.cross(a) + inertia * w_dot + w.cross(let("Iw", inertia * w)) + bending[3:6, :]
    own = []
    for k, column in enumerate((pitch_own, yaw_own)):
        inertial = column[0:3, :].dot(a) + column[3:6, :].dot(w_dot) + spread * let("load", loads[k])
        own.append(inertial + H_own[k] * accelerations[0] + H_own[k + 1] * accelerations[1])
    return {"F": Matrix([force, torque + spread * let("moment", moment_r)]), "torque_own": Matrix(own)}


def rotated_inertia(let, E, I) -> Matrix:
    """E I E^T."""
    return let("turned", entries(let("half", E * symmetric(I)) * E.T))


def segment_motion(let, angles, rates, accelerations, section, tip, E, r, bend, w, w_dot, a) -> dict:
    """Angular velocity, its rate and acceleration of the tip, in its frame, from the root's in the root frame."""
    alpha, beta, _, u, du = geometry(let, angles)
    _, _, c3, c1_z, c2_z, c3_z, c1_zz, c2_zz = tip
    z_dot = let("z_dot", 2 * (alpha * rates[0] + beta * rates[1]))
    z_ddot = let("z_ddot", 2 * (rates[0] ** 2 + rates[1] ** 2))
    area = let("area", beta * rates[0] - alpha * rates[1])
    swing = let("swing", c3_z * z_dot * area)
    turn_rate = Matrix(
        [-swing * beta - c3 * rates[1] * area, c2_z * z_dot * area, swing * alpha + c3 * rates[0] * area]
    )
    along = let("along", c1_zz * z_dot**2 + c1_z * z_ddot)
    across = let("across", c2_zz * z_dot**2 + c2_z * z_ddot)
    r_ddot = section[1] * let("r_v", across * u - along * Y + 2 * c2_z * z_dot * (rates[0] * du[0] + rates[1] * du[1]))
    turn, r_dot = velocity_columns(let, bend, rates)
    turn_q, move_q = velocity_columns(let, bend, accelerations)
    w_r = let("w_r", w.cross(r))
    w_tip_dot = w_dot + w.cross(turn) + turn_rate + turn_q
    a_tip = a + w_dot.cross(r) + w.cross(let("v", w_r + 2 * r_dot)) + r_ddot + move_q
    E = square(E).T
    return {"w": E * let("w", w + turn), "w_dot": E * let("w_dot", w_tip_dot), "a": E * let("a", a_tip)}


def velocity_columns(let, bend, rates) -> tuple[Matrix, Matrix]:
    """Angular and linear velocity of the tip relative to the root for rates of (a, b)."""
    total = let("relative", rates[0] * bend[0:6, :] + rates[1] * bend[6:12, :])
    return total[0:3, :], total[3:6, :]


def segment_pose(let, E, r, R, P) -> dict:
    """R_{i+1} = R_i E (Eq. 33) and p_{i+1} = p_i + R_i r (Eq. 34)."""
    return {"R": square(R) * square(E), "P": P + square(R) * r}


def segment_twist(let, E, r, bend, R, P) -> dict:
    """Spatial columns at B of a segment's bend: angular, then the velocity of the point of the tip's body at B."""
    R = square(R)
    tip, out = let("tip", P + R * r), []
    for k in (0, 6):
        turn = let("turn", R * bend[k : k + 3, :])
        out += [turn, R * bend[k + 3 : k + 6, :] + tip.cross(turn)]
    return {"S": Matrix(out)}


def gather_segment_wrench(let, E, r, bend, F, torque_own, F_next) -> dict:
    """Add what the next segment passes on, in this segment's root frame; generalised forces of a and b."""
    E = square(E)
    force, moment = let("force", E * F_next[0:3, :]), let("moment", E * F_next[3:6, :])
    torque = [bend[k : k + 3, :].dot(moment) + bend[k + 3 : k + 6, :].dot(force) for k in (0, 6)]
    total = Matrix([F[0:3, :] + force, F[3:6, :] + moment + r.cross(force)])
    return {"F_next": total, "torque": torque_own + Matrix(torque)}


def gather_segment(let, section, E, r, bend, h_own, I_own, pitch_own, yaw_own, H_own, mass, h, I) -> dict:
    """Composite inertia at the root from what hangs at the tip, the momentum columns of a and b, their block of H."""
    E = square(E)
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
    beyond = [twists[i][0].dot(twists[j][3]) + twists[i][1].dot(twists[j][2]) for i, j in ((0, 0), (1, 0), (1, 1))]
    return {
        "mass": mass + Matrix([section[0]]),
        "h": h_own + h_root,
        "I": I_own + I_root,
        "pitch": columns[0],
        "yaw": columns[1],
        **{name: [H_own[k] + beyond[k]] for k, name in enumerate(("H_pp", "H_py", "H_yy"))},
    }


def gather_segment_moment(let, section, E, r, h_own, mass, h) -> dict:
    """Mass and first moment of a segment and all beyond, at its root."""
    return {"mass": mass + Matrix([section[0]]), "h": h_own + square(E) * h + mass[0] * r}


def segment_velocity(let, rates, E, r, bend, w, u) -> dict:
    """Angular and linear velocity of the tip, in its frame."""
    turn, move = velocity_columns(let, bend, rates)
    E = square(E).T
    return {"w": E * let("w", w + turn), "u": E * let("u", u + w.cross(r) + move)}


def segment_momentum(let, rates, section, h_own, I_own, pitch_own, yaw_own, H_own, w, u) -> dict:
    """Momentum of a segment, its moment about the root, and its kinetic energy."""
    relative = let("relative", rates[0] * pitch_own + rates[1] * yaw_own)
    p = let("p", section[0] * u + w.cross(h_own) + relative[0:3, :])
    L = let("L", symmetric(I_own) * w + h_own.cross(u) + relative[3:6, :])
    own = rates[0] ** 2 * H_own[0] + 2 * rates[0] * rates[1] * H_own[1] + rates[1] ** 2 * H_own[2]
    twice = let("twice", u.dot(p) + w.dot(L) + u.dot(relative[0:3, :]) + w.dot(relative[3:6, :]) + own)
    return {"F": Matrix([p, L]), "kinetic": [twice / 2]}


def part_of_bend(let, angles, fraction) -> dict:
    """Bend of an n-th of a segment."""
    return {"part": angles * fraction[0]}


def columns_of_bend(let, bend, fraction) -> dict:
    """Columns for the rates of a whole segment from those for the rates of an n-th of it."""
    return {"bend": bend * fraction[0]}
