"""The continuum tail as the paper writes it, in polar angles, for comparison only.

Sect. 2.3 in the frame of a segment's root: slice x in [0, 1] lies at p_q + s_x a - c_x b with s_x =
sin(theta x), c_x = cos(theta x), a = -r y, b = r (sin(phi) x + cos(phi) z) and r = L / theta (Eqs.
20 to 23).  What depends on x is integrated once and for all, which leaves the matrices E and Q of
Appendix B: sines, cosines and powers of 1 / theta.  They are kept as printed, without series,
switch or smoothing: digits cancel as theta tends to 0, and there is no value at theta = 0.  `arc`
and its companions are the same tail without these faults.
"""

from sympy import Matrix, Rational, cos, eye, sin, zeros

from .rotations import X, Y, Z, entries
from .shapes import M33, V1, V2, V3, V4, V10, V12, V15, V27

UPPER = tuple((k, j) for k in range(5) for j in range(k, 5))  # entries of E that Appendix B lists


def segment_trigonometry(let, angles: V2) -> dict:
    """Sine and cosine of phi, then of theta."""
    return {"trig": [sin(angles[0]), cos(angles[0]), sin(angles[1]), cos(angles[1])]}


def polar_margins(let, angles: V2, bend_range: V1) -> dict:
    """Positive if a segment is bent, and if it is bent by less than the declared range, up to
    rounding.
    """
    square = let("square", angles[1] ** 2)
    limit = let("limit", bend_range[0] * bend_range[0] * Rational(10**12 + 1, 10**12))
    return {"bent": [square], "margin": [limit - square]}


def slice_integrals(let, angles: V2, trig: V4) -> dict:
    """E of Eq. 28, its upper triangle, and columns 5 and 9 of Q of Eq. 30; the others are E's
    (Appendix B).
    """
    t, s, c = angles[1], trig[2], trig[3]
    s2, c2, t2 = let("s2", sin(2 * t)), let("c2", cos(2 * t)), let("t2", t * t)
    t3, t4, six = let("t3", t2 * t), let("t4", t2 * t2), let("six", 6 * t2 - 3)
    E22, E23 = Rational(1, 2) - s2 / (4 * t), (-2 * t * c2 + s2) / (8 * t2)
    E25 = (1 - c2 - 2 * t * s2 + 2 * t2) / (8 * t2)
    E33 = (4 * t3 + 6 * t * c2 + six * s2) / (24 * t3)
    E35 = (-1 + (1 - 2 * t2) * c2 + 2 * t * s2) / (8 * t3)
    E55 = (4 * t3 - 6 * t * c2 - six * s2) / (24 * t3)
    first = [1, (1 - c) / t, (-1 + c + t * s) / t2, -s / t, (-t * c + s) / t2]
    rest = [E22, E23, (c2 - 1) / (4 * t), E25, E33, E25 - Rational(1, 2), E35, 1 - E22, -E23, E55]
    Q35 = (2 * t * (2 * t2 - 3) * c2 - six * s2) / (16 * t4)
    Q55 = (3 + 2 * t * (2 * t2 - 3) * s2 + six * c2 - 2 * t4) / (16 * t4)
    Q_5 = [(2 + (t2 - 2) * c - 2 * t * s) / t3, E33 - Rational(1, 3), Q35, E35, Q55]
    Q_9 = [((t2 - 2) * s + 2 * t * c) / t3, E35, Q55 + Rational(1, 4), -E33, -Q35]
    return {"E_v": let("E_v", Matrix(first + rest)), "Q_v": let("Q_v", Matrix(Q_5 + Q_9))}


def matrix_E(E_v) -> Matrix:
    """E_{i,v}, the integral of f_v f_v^T over x (Eq. 28), f_v as in Eq. 27."""
    E = zeros(5, 5)
    for (k, j), value in zip(UPPER, E_v, strict=True):
        E[k, j] = E[j, k] = value
    return E


def matrix_Q(E_v, Q_v) -> Matrix:
    """Q_{i,v}, the integral of f_v f_a over x (Eq. 30), f_a as in Eq. 32."""
    E = matrix_E(E_v)
    one, s, xc, c, xs = (E.col(k) for k in range(5))
    return Matrix.hstack(one, s, 2 * xc, xc, Q_v[0:5, :], c, 2 * xs, xs, Q_v[5:10, :])


def intermediate_vectors(let, angles, trig, section) -> tuple:
    """a_i, b_i of Eqs. 22, 23, and the derivative of b_i with respect to phi."""
    s, c = trig[0], trig[1]
    r = let("r", section[1] / angles[1])
    return -r * Y, let("b", r * (s * X + c * Z)), let("b_phi", r * (c * X - s * Z))


def slice_jacobian(let, angles, a, b, b_phi) -> list:
    """J_v of Eq. 26, five blocks 3 x 8: columns for velocity and angular velocity of the root,
    phi_dot, theta_dot.
    """
    # blocks times f_v(x) sum to Eq. 25, that times the rates is Eq. 24 (x c_x a theta_dot)
    a_theta, b_theta = let("a_theta", -a / angles[1]), let("b_theta", -b / angles[1])
    J_a = Matrix.hstack(zeros(3, 3), -skew(a), zeros(3, 1), a_theta)
    J_b = Matrix.hstack(zeros(3, 3), -skew(b), b_phi, b_theta)
    J_q = Matrix.hstack(eye(3), -skew(b), b_phi, b_theta)  # of p_q = p_o + b, Eq. 21
    none = zeros(3, 7)
    return [J_q, J_a, Matrix.hstack(none, a), J_b, Matrix.hstack(none, b)]


def skew(v) -> Matrix:
    """v~, so that v~ u = v x u."""
    return Matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def segment_inertia(let, angles: V2, trig: V4, E_v: V15, section: V2) -> dict:
    """H_i = m J_v^T o E o J_v (Eq. 28): first moment, inertia, columns of phi and theta and their
    block of H.
    """
    J, E = (
        slice_jacobian(let, angles, *intermediate_vectors(let, angles, trig, section)),
        matrix_E(E_v),
    )
    H = zeros(8, 8)
    for k in range(5):
        row = let("E_J", sum((E[k, j] * J[j] for j in range(5)), zeros(3, 8)))
        H += J[k].T * row
    H = let("H", section[0] * H)
    return {
        "h_own": Matrix([H[1, 5], H[2, 3], H[0, 4]]),  # H[0:3, 3:6] = -skew(h)
        "I_own": entries(H[3:6, 3:6]),
        "pitch_own": H[0:6, 6],
        "yaw_own": H[0:6, 7],
        "H_own": Matrix([H[6, 6], H[6, 7], H[7, 7]]),
    }


def segment_loading(
    let, angles: V2, rates: V2, accelerations: V2, trig: V4, section: V2, w: V3, w_dot: V3, a: V3
) -> dict:
    """h_v of Eq. 31, nine vectors: p_q_ddot (+ g), a_ddot, a_dot theta_dot, ..., b theta_dot^2, in
    the root frame.

    ``w, w_dot, a`` are of the root; the paper's second block reads p_q, its first entry is the
    acceleration of p_q.
    """
    a_i, b_i, b_phi = intermediate_vectors(let, angles, trig, section)

    # r = L / theta and its derivatives, over r
    theta_dot, theta_ddot = rates[1], accelerations[1]
    shrink = let("shrink", -theta_dot / angles[1])  # r_dot / r
    shrink_rate = let("shrink_rate", 2 * shrink * shrink - theta_ddot / angles[1])  # r_ddot / r

    # derivatives of a and b: relative to the root, then with its rotation
    b_rate = shrink * b_i + rates[0] * b_phi
    b_bend = (
        shrink_rate * b_i - rates[0] ** 2 * b_i + (2 * shrink * rates[0] + accelerations[0]) * b_phi
    )
    a_dot, a_ddot = turning(let, a_i, shrink * a_i, shrink_rate * a_i, w, w_dot)
    b_dot, b_ddot = turning(let, b_i, b_rate, b_bend, w, w_dot)

    # the nine vectors
    square = let("square", theta_dot**2)
    along = [a_ddot, a_dot * theta_dot, a_i * theta_ddot, a_i * square]
    across = [b_ddot, b_dot * theta_dot, b_i * theta_ddot, b_i * square]
    return {"loading": Matrix([a + b_ddot, *along, *across])}


def turning(let, vector, rate, rate_rate, w, w_dot) -> tuple:
    """First and second derivative of a vector in a frame that turns by ``w``, from those relative
    to the frame.
    """
    v, rate = let("spun", w.cross(vector)), let("rate", rate)
    second = rate_rate + w_dot.cross(vector) + w.cross(let("swept", v + 2 * rate))
    return let("dot", v + rate), let("ddot", second)


def segment_wrench(
    let, angles: V2, trig: V4, E_v: V15, Q_v: V10, section: V2, loading: V27
) -> dict:
    """tau_i = m J_v^T o Q o h_v (Eq. 30): inertial wrench at the root and generalised forces of phi
    and theta.
    """
    J, Q = (
        slice_jacobian(let, angles, *intermediate_vectors(let, angles, trig, section)),
        matrix_Q(E_v, Q_v),
    )
    h = loading.reshape(9, 3)
    Q_h = let("Q_h", Q * h)
    force = let("tau", section[0] * sum((J[k].T * Q_h[k, :].T for k in range(5)), zeros(8, 1)))
    return {"F": force[0:6, :], "torque_own": force[6:8, :]}


def segment_tip(let, angles: V2, trig: V4, section: V2) -> dict:
    """Rotation to the tip (Eq. 33), its position (Eq. 34), and how both move with phi and theta, in
    the root frame.
    """
    # r is Eq. 20 at x = 1, less the root
    a, b, b_phi = intermediate_vectors(let, angles, trig, section)
    (s_phi, c_phi, s, c), lift = trig, let("lift", 1 - trig[3])
    about = Matrix([[c_phi, 0, s_phi], [0, 1, 0], [-s_phi, 0, c_phi]])
    E = let("E", about * Matrix([[1, 0, 0], [0, c, s], [0, -s, c]]) * about.T)
    r = let("r_tip", s * a + lift * b)
    phi_turn, theta_turn = let("turn", Y - E * Y), Matrix([-c_phi, 0, s_phi])
    theta_move = c * a + s * b - r / angles[1]
    return {"E": E, "r": r, "bend": Matrix([*phi_turn, *(lift * b_phi), *theta_turn, *theta_move])}


def segment_motion(
    let, rates: V2, accelerations: V2, trig: V4, E: M33, bend: V12, loading: V27, w: V3, w_dot: V3
) -> dict:
    """Angular velocity, its rate and acceleration of the tip, in its frame; Eq. 29 at x = 1 is its
    acceleration.
    """
    s_phi, c_phi, s, c = trig
    phi_turn, theta_turn = bend[0:3, :], bend[6:9, :]
    turn = let("turn", rates[0] * phi_turn + rates[1] * theta_turn)
    # the rates of phi_turn = y - E y and theta_turn = (-cos(phi), 0, sin(phi))
    change = rates[0] * (turn.cross(phi_turn - Y) + rates[1] * Matrix([s_phi, 0, c_phi]))
    driven = accelerations[0] * phi_turn + accelerations[1] * theta_turn
    w_tip_dot = w_dot + w.cross(turn) + change + driven
    f_a = Matrix([1, s, 2 * c, c, -s, -c, 2 * s, s, c])  # Eq. 32 at x = 1
    a_tip = loading.reshape(9, 3).T * f_a
    E = E.T
    return {
        "w": E * let("w", w + turn),
        "w_dot": E * let("w_dot", w_tip_dot),
        "a": E * let("a", a_tip),
    }


def part_of_arc(let, angles: V2, fraction: V1) -> dict:
    """Polar angles of an n-th of a segment."""
    return {"part": [angles[0], angles[1] * fraction[0]]}


def columns_of_arc(let, bend: V12, fraction: V1) -> dict:
    """Columns for the rates of a whole segment from those for the rates of an n-th of it."""
    return {"bend": Matrix([bend[0:6, :], bend[6:12, :] * fraction[0]])}
