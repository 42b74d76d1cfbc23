"""The 40-digit continuum agrees with closed forms, chains of points and Lagrange's equations."""

from fractions import Fraction
from itertools import product

import casadi as ca
import mpmath
import numpy as np
from scipy.spatial.transform import Rotation

from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, mass_matrix_error
from tests.references.parameters import KINDS, TABLE_1
from tests.support.exact_states import (
    BENDS,
    ROUNDING,
    UPRIGHT,
    assert_same_float64,
    at_rest,
    states_of,
    torso_rotation,
)
from tests.support.rows import row

SIZES = (1, 2)


def test_straight_tail_is_rational_to_the_last_bit():
    continuum = ExactContinuum(TABLE_1, 1)
    q, (a_dot, b_dot) = np.array([*UPRIGHT, 0.0, 0.0]), (3.0, -5.0)
    torso, mass, length, gravity = (
        Fraction(TABLE_1[name]) for name in ("torso_mass", "tail_mass", "tail_length", "gravity")
    )
    coupling = float(mass * length / 6)  # the mean of L x^2 / 2
    mass_matrix, bias = continuum.mass_matrix(q), continuum.bias_force(q, at_rest([a_dot, b_dot]))
    assert_same_float64(mass_matrix[:3, 6:], [[0, coupling], [0, 0], [-coupling, 0]])
    assert_same_float64(mass_matrix[6:, 6:], float(mass * length**2 / 20) * np.eye(2))
    # the slice rises by L x^3 (a^2 + b^2) / 6 along y
    rise = mass * length / 12 * Fraction(a_dot**2 + b_dot**2)
    assert_same_float64(bias[:3], [0, float(rise), float((torso + mass) * gravity)])
    assert_same_float64(bias[6:], [float(-mass * gravity * length / 6), 0])


def test_planar_bend_is_the_closed_form_to_the_last_bit():
    rates = (3.0, -5.0)
    for gravity, bend in product([0.0, 9.8], BENDS):
        with row(gravity, bend):
            parameters = {**TABLE_1, "gravity": gravity}
            continuum = ExactContinuum(parameters, 1)
            mass, bias, potential = arc(parameters, bend, rates)
            q, v = np.array([*UPRIGHT, bend, 0.0]), at_rest(rates)
            assert_same_float64(continuum.mass_matrix(q)[6:, 6:], mass)
            assert_same_float64(continuum.bias_force(q, v)[6:], bias)
            assert continuum.energy(q, v)[1] == potential


@mpmath.workdps(2000)
def arc(parameters, bend, rates):
    """H_tt, C_t and the potential of one segment bent by (a, 0) on a torso at rest, in sines and
    cosines of a.
    """
    names = ("tail_mass", "tail_length", "gravity")
    mass, length, gravity = (mpmath.mpf(parameters[name]) for name in names)
    a, (a_dot, b_dot) = mpmath.mpf(bend), (mpmath.mpf(rate) for rate in rates)
    (c, s), (c2, s2) = mpmath.cos_sin(a), mpmath.cos_sin(2 * a)
    pitch = 1 / (3 * a**2) + 2 * (1 + c) / a**4 - 4 * s / a**5
    pitch_slope = -2 / (3 * a**3) - 2 * s / a**4 - (8 + 12 * c) / a**5 + 20 * s / a**6
    yaw = mpmath.mpf(3) / 2 / a**4 + (s2 / 4 - 2 * s) / a**5
    yaw_slope = (c2 / 2 - 2 * c - 6) / a**5 + (10 * s - 5 * s2 / 4) / a**6
    height, slope = -(a - s) / a**2, -(1 - c) / a**2 + 2 * (a - s) / a**3  # of the COM, over L
    moment, weight = mass * length**2, mass * gravity * length
    whirl = (
        pitch - yaw
    ) / a - yaw_slope / 2  # of the yaw rate into the pitch: the mean of p_a . p_bb
    bias = [
        moment * (pitch_slope * a_dot**2 / 2 + whirl * b_dot**2) + weight * slope,
        moment * yaw_slope * a_dot * b_dot,
    ]
    potential = weight * height + mass * gravity * mpmath.mpf(parameters["tail_mount"][2])
    inertia = np.array([[moment * pitch, 0], [0, moment * yaw]], dtype=float)
    return inertia, np.array(bias, dtype=float), float(potential)


def test_small_bend_tends_to_the_straight_tail():
    exact, (q, v, v_dot, _) = ExactContinuum(TABLE_1, 1), states_of(1, "random")[0]
    for bend in BENDS[:4]:
        with row(bend):
            straight, bent = (np.concatenate([q[:7], size * q[7:]]) for size in (0.0, bend))
            H, H_bent = exact.mass_matrix(straight), exact.mass_matrix(bent)
            assert mass_matrix_error(H_bent, H) <= ROUNDING + bend
            force, other = (exact.inverse_dynamics(x, v, v_dot) for x in (straight, bent))
            assert block_error(other, force) <= ROUNDING + 10 * bend


def test_two_halves_are_one_segment():
    whole, halves = (ExactContinuum(TABLE_1, segments) for segments in (1, 2))
    T = np.vstack([np.eye(8), np.eye(8)[6:]]) / np.r_[np.ones(6), 2 * np.ones(4)][:, None]
    for kind in KINDS:
        for q, v, v_dot, _ in states_of(1, kind):
            with row(kind):
                q_halves = np.concatenate([q[:7], q[7:] / 2, q[7:] / 2])
                mass = T.T @ halves.mass_matrix(q_halves) @ T
                force = T.T @ halves.inverse_dynamics(q_halves, T @ v, T @ v_dot)
                assert mass_matrix_error(mass, whole.mass_matrix(q)) <= 1e-15
                assert block_error(force, whole.inverse_dynamics(q, v, v_dot)) <= 1e-15
                assert_same_float64(halves.energy(q_halves, T @ v), whole.energy(q, v))
                assert_same_float64(halves.tail_points(q_halves, 3), whole.tail_points(q, 6))


def lagrange(segments):
    """H and C of Lagrange's equations at x = [p, xi, q_t] with xi = 0, by automatic
    differentiation.
    """
    nv = 6 + 2 * segments
    x, x_dot, axes = ca.SX.sym("x", nv), ca.SX.sym("x_dot", nv), ca.SX.sym("R", 3, 3)
    half = ca.skew(x[3:6] / 2)
    # R_b = R Exp(xi) up to xi^2, so omega = xi_dot and omega_dot = xi_ddot at xi = 0
    turn = ca.DM.eye(3) + 2 / (1 + ca.sumsqr(x[3:6]) / 4) * (half + half @ half)
    points, masses = paper_slices(x, axes @ turn, segments)
    turn_rate = ca.reshape(ca.jtimes(ca.vec(turn), x, x_dot), 3, 3)
    omega, inertia = ca.inv_skew(turn.T @ turn_rate), ca.diag(ca.DM(TABLE_1["torso_inertia"]))
    velocities = ca.jtimes(points, x, x_dot)
    kinetic = (velocities.T @ (masses * velocities) + omega.T @ inertia @ omega) / 2
    potential = TABLE_1["gravity"] * ca.dot(masses[2::3], points[2::3])
    mass, momenta = ca.hessian(kinetic, x_dot)
    bias = ca.jtimes(momenta, x, x_dot) - ca.gradient(kinetic - potential, x)
    return ca.Function("lagrange", [x, x_dot, axes], [mass, bias])


def paper_slices(x, axes, segments):
    """Coordinates of B and of the slices at nodes, each with its mass, in polar form (Eqs. 20 to
    23, 33).
    """
    nodes, weights = np.polynomial.legendre.leggauss(20)
    length, mass = TABLE_1["tail_length"] / segments, TABLE_1["tail_mass"] / segments
    points, masses = [x[:3]], [TABLE_1["torso_mass"], *np.tile(weights * mass / 2, segments)]
    root = x[:3] + axes @ ca.DM(TABLE_1["tail_mount"])
    for i in range(segments):
        a, b = x[6 + 2 * i], x[7 + 2 * i]
        theta, phi = ca.hypot(a, b), ca.atan2(b, -a)
        across, along = radial(axes, phi, length / theta), -length / theta * axes[:, 1]
        slices = [
            root + across + ca.sin(theta * s) * along - ca.cos(theta * s) * across
            for s in (1 + nodes) / 2
        ]
        points += slices
        root = root + across + ca.sin(theta) * along - ca.cos(theta) * across
        axes = axes @ about_y(phi) @ about_x(-theta) @ about_y(-phi)
    return ca.vertcat(*points), ca.DM(np.repeat(masses, 3))


def radial(axes, phi, radius):
    """b_i = r (sin(phi) x + cos(phi) z) (Eq. 23)."""
    return radius * (ca.sin(phi) * axes[:, 0] + ca.cos(phi) * axes[:, 2])


def about_x(angle):
    """R_x."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, c, -s), ca.horzcat(0, s, c))


def about_y(angle):
    """R_y."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, 0, s), ca.horzcat(0, 1, 0), ca.horzcat(-s, 0, c))


def test_lagrange_s_equations_of_the_paper_s_polar_form_agree():
    for segments, kind in product(SIZES, ["random", "folded"]):
        exact, equations = ExactContinuum(TABLE_1, segments), lagrange(segments)
        for q, v, *_ in states_of(segments, kind):
            with row(segments, kind):
                x = np.concatenate([q[:3], np.zeros(3), q[7:]])
                mass, bias = (np.array(value) for value in equations(x, v, torso_rotation(q)))
                assert mass_matrix_error(mass, exact.mass_matrix(q)) <= 1e-13
                assert block_error(bias[:, 0], exact.bias_force(q, v)) <= 1e-13


def test_tip_of_a_planar_bend_is_the_arc_s_to_the_last_bit():
    continuum = ExactContinuum({**TABLE_1, "tail_mount": (0, 0, 0)}, 1)
    for bend in (*BENDS, 300.0):
        with row(bend):
            mount, tip = continuum.tail_points([*UPRIGHT, bend, 0.0], 1)
            with mpmath.workdps(700):
                a, length = mpmath.mpf(bend), mpmath.mpf(TABLE_1["tail_length"])
                expected = [0, -length * mpmath.sin(a) / a, -length * (1 - mpmath.cos(a)) / a]
            np.testing.assert_array_equal(mount, np.zeros(3))
            assert_same_float64(tip, np.array(expected, dtype=float))


def test_tail_points_integrate_the_turning_tangent():
    for segments, kind in product(SIZES, KINDS):
        exact = ExactContinuum(TABLE_1, segments)
        for q, *_ in states_of(segments, kind):
            with row(segments, kind):
                points = exact.tail_points(q, 4)
                assert points.shape == (4 * segments + 1, 3)
                integrals = tangent_integrals(q, segments, 4)
                np.testing.assert_allclose(points, integrals, rtol=0, atol=1e-14)
                np.testing.assert_array_equal(points, exact.tail_points(q, 8)[::2])


def tangent_integrals(q, segments, samples):
    """Points p_x = root - L R_i (int_0^x Exp(s [a, 0, b]) ds) y of a rod of constant curvature."""
    axes, length = torso_rotation(q), TABLE_1["tail_length"] / segments
    points = [q[:3] + axes @ TABLE_1["tail_mount"]]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for a, b in q[7:].reshape(-1, 2):
        bend, root = np.array([a, 0.0, b]), points[-1]
        for x in np.arange(1, samples + 1) / samples:
            turns = Rotation.from_rotvec(np.outer(x * (1 + nodes) / 2, bend)).as_matrix()
            points.append(root - length * axes @ (x / 2 * weights @ turns[:, :, 1]))
        axes = axes @ Rotation.from_rotvec(bend).as_matrix()
    return np.array(points)
