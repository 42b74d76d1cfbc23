"""The 40-digit continuum agrees with exact laws to the last bit, with Lagrange's equations and with
fine chains.
"""

from fractions import Fraction
from math import pi

import casadi as ca
import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.exact_chain import ExactChain
from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.parameters import KINDS, TABLE_1, random_states

SIZES = [1, 2]
BENDS = [1e-300, 1e-16, 1e-8, 1e-3, 1.0, pi, 2 * pi, 10.0]
ROUNDING = np.finfo(float).eps
RESIDUE = 1e-25
UPRIGHT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
STEP = 1e-6


@pytest.fixture(scope="module", params=SIZES, ids=lambda segments: f"m{segments}")
def exact(request):
    """The exact continuum tail of one size."""
    return ExactContinuum(TABLE_1, request.param)


@pytest.fixture(params=KINDS)
def states(request, exact):
    """Two tuples (q, v, v_dot, tau) of one kind."""
    return states_of(exact.segments, request.param)


def states_of(segments, kind):
    """Two tuples (q, v, v_dot, tau)."""
    return list(zip(*random_states(segments, 17, 2, kind), strict=True))


def torso_rotation(q):
    """R_b, in float64."""
    return Rotation.from_quat(q[3:7], scalar_first=True).as_matrix()


def at_rest(tail_rates):
    """v of a tail that moves on a torso at rest."""
    return np.concatenate([np.zeros(6), tail_rates])


def assert_same_float64(x, x_ref):
    """Every entry is the same float64, but for zeros that come out as what is left of many
    digits.
    """
    x, x_ref = np.asarray(x), np.asarray(x_ref)
    floor = RESIDUE * np.max(np.abs(x_ref))
    np.testing.assert_array_equal(
        *(np.where(np.abs(values) < floor, 0.0, values) for values in (x, x_ref))
    )


def assert_same_quantities(continuum, other, state):
    """Every quantity of two continuum tails is the same float64 at one state."""
    q, v, v_dot, tau = state
    assert_same_float64(continuum.mass_matrix(q), other.mass_matrix(q))
    assert_same_float64(
        continuum.inverse_dynamics(q, v, v_dot), other.inverse_dynamics(q, v, v_dot)
    )
    assert_same_float64(continuum.forward_dynamics(q, v, tau), other.forward_dynamics(q, v, tau))
    assert_same_float64(continuum.energy(q, v), other.energy(q, v))
    assert_same_float64(continuum.momentum(q, v), other.momentum(q, v))
    assert_same_float64(continuum.tail_points(q, 3), other.tail_points(q, 3))


def test_inverse_dynamics_is_mass_times_acceleration_plus_bias(exact, states):
    for q, v, v_dot, _ in states:
        mass, bias = exact.mass_matrix(q), exact.bias_force(q, v)
        error = np.abs(exact.inverse_dynamics(q, v, v_dot) - (mass @ v_dot + bias))
        # no more than the rounding of H, C and of this sum in float64
        assert np.all(error <= exact.nv * ROUNDING * (np.abs(mass) @ np.abs(v_dot) + np.abs(bias)))


def test_forward_dynamics_inverts_inverse_dynamics(exact, states):
    for q, v, v_dot, tau in states:
        external = exact.inverse_dynamics(q, v, v_dot) - at_rest(tau)
        limit = 1e-14 * equilibrated_condition(exact.mass_matrix(q))
        assert block_error(exact.forward_dynamics(q, v, tau, external), v_dot) <= limit


def test_kinetic_energy_is_the_mass_matrix_form(exact, states):
    for q, v, *_ in states:
        mass = exact.mass_matrix(q)
        limit = exact.nv * ROUNDING * (np.abs(v) @ np.abs(mass) @ np.abs(v))
        assert abs(exact.energy(q, v)[0] - v @ mass @ v / 2) <= limit


def test_momentum_is_the_upper_rows_of_mass_times_velocity(exact, states):
    for q, v, *_ in states:
        mass, axes, (linear, angular) = (
            exact.mass_matrix(q),
            torso_rotation(q),
            exact.momentum(q, v),
        )
        momentum = mass @ v
        np.testing.assert_allclose(linear, momentum[:3], atol=1e-14)
        # H_p,omega = -M (c - p)~ R_b
        about_torso = angular - mass[:3, 3:6] @ axes.T @ linear / mass[0, 0]
        np.testing.assert_allclose(axes @ momentum[3:6], about_torso, atol=1e-15)


def test_power_is_the_rate_of_energy(exact, states):
    for q, v, v_dot, _ in states:
        after, before = (
            sum(exact.energy(displaced(q, v, time), v + time * v_dot)) for time in (STEP, -STEP)
        )
        power = v * exact.inverse_dynamics(q, v, v_dot)
        assert abs((after - before) / (2 * STEP) - sum(power)) <= 1e-8 * sum(abs(power))


def displaced(q, v, time):
    """The configuration reached from q in a time at the constant velocity v."""
    turned = Rotation.from_quat(q[3:7], scalar_first=True) * Rotation.from_rotvec(time * v[3:6])
    return np.concatenate(
        [q[:3] + time * v[:3], turned.as_quat(scalar_first=True), q[7:] + time * v[6:]]
    )


def test_translational_mass_is_the_nearest_float64_of_the_total(exact, states):
    total = float(Fraction(TABLE_1["torso_mass"]) + Fraction(TABLE_1["tail_mass"]))
    assert_same_float64(exact.mass_matrix(states[0][0])[:3, :3], total * np.eye(3))


@pytest.mark.parametrize("kind", KINDS)
def test_more_digits_and_nodes_give_the_same_float64(kind):
    few, many = ExactContinuum(TABLE_1, 3, 30, 24), ExactContinuum(TABLE_1, 3, 50, 32)
    assert_same_quantities(few, many, states_of(3, kind)[1])


@pytest.mark.parametrize("bend", [0.0, *BENDS])
def test_every_bend_is_the_same_float64_with_more_digits_and_nodes(bend):
    q, v, v_dot, tau = states_of(1, "random")[0]
    state = np.concatenate([q[:7], [0.6 * bend, -0.8 * bend]]), v, v_dot, tau
    assert_same_quantities(
        *(ExactContinuum(TABLE_1, 1, *size) for size in [(40, 24), (60, 32)]), state
    )


@pytest.mark.parametrize("count", [1, 2, 15, 24])
def test_nodes_integrate_polynomials(count):
    continuum = ExactContinuum(TABLE_1, 1, nodes=count)
    shares = continuum.masses[1:] / continuum.mp.mpf(TABLE_1["tail_mass"])
    for power in range(2 * count):
        assert abs(np.dot(shares, continuum.nodes**power) * (power + 1) - 1) <= 1e-37


def test_internal_dynamics_do_not_depend_on_the_pose_to_the_last_bit(exact, states):
    continuum = ExactContinuum({**TABLE_1, "gravity": 0.0}, exact.segments)
    q, v, *_ = states[0]
    upright, internal = np.concatenate([UPRIGHT, q[7:]]), np.concatenate([np.zeros(3), v[3:]])
    assert_same_float64(continuum.mass_matrix(q)[3:, 3:], continuum.mass_matrix(upright)[3:, 3:])
    assert_same_float64(continuum.bias_force(q, v)[3:], continuum.bias_force(upright, internal)[3:])


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


@pytest.mark.parametrize("gravity", [0.0, 9.8])
@pytest.mark.parametrize("bend", BENDS)
def test_planar_bend_is_the_closed_form_to_the_last_bit(bend, gravity):
    parameters = {**TABLE_1, "gravity": gravity}
    continuum, rates = ExactContinuum(parameters, 1), (3.0, -5.0)
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


@pytest.mark.parametrize("bend", BENDS[:4])
def test_small_bend_tends_to_the_straight_tail(exact, bend):
    q, v, v_dot, _ = states_of(exact.segments, "random")[0]
    straight, bent = (np.concatenate([q[:7], size * q[7:]]) for size in (0.0, bend))
    assert (
        mass_matrix_error(exact.mass_matrix(bent), exact.mass_matrix(straight)) <= ROUNDING + bend
    )
    force = exact.inverse_dynamics(straight, v, v_dot)
    assert block_error(exact.inverse_dynamics(bent, v, v_dot), force) <= ROUNDING + 10 * bend


@pytest.mark.parametrize("kind", KINDS)
def test_two_halves_are_one_segment(kind):
    whole, halves = (ExactContinuum(TABLE_1, segments) for segments in (1, 2))
    reduction = np.vstack([np.eye(8), np.eye(8)[6:]]) / np.r_[np.ones(6), 2 * np.ones(4)][:, None]
    for q, v, v_dot, _ in states_of(1, kind):
        q_halves = np.concatenate([q[:7], q[7:] / 2, q[7:] / 2])
        mass = reduction.T @ halves.mass_matrix(q_halves) @ reduction
        force = reduction.T @ halves.inverse_dynamics(q_halves, reduction @ v, reduction @ v_dot)
        assert mass_matrix_error(mass, whole.mass_matrix(q)) <= 1e-15
        assert block_error(force, whole.inverse_dynamics(q, v, v_dot)) <= 1e-15
        assert_same_float64(halves.energy(q_halves, reduction @ v), whole.energy(q, v))
        assert_same_float64(halves.tail_points(q_halves, 3), whole.tail_points(q, 6))


@pytest.mark.parametrize(("segments", "counts"), [(1, (16, 32, 64)), (2, (16, 32))])
def test_chain_of_massive_points_converges_at_first_order(segments, counts):
    q, v, v_dot, _ = states_of(segments, "random")[0]
    continuum = ExactContinuum(TABLE_1, segments)
    reference = [
        continuum.mass_matrix(q),
        continuum.inverse_dynamics(q, v, v_dot),
        *continuum.momentum(q, v),
    ]
    errors = []
    for links in counts:
        values = chain_quantities(segments, links, (q, v, v_dot))
        errors.append(
            [np.linalg.norm(x - x_ref) for x, x_ref in zip(values, reference, strict=True)]
        )
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 2.0, atol=0.1)


def chain_quantities(segments, links, state):
    """H, H v_dot + C and momenta of links without inertia of their own, each turned by 1/n of its
    segment's bend.
    """
    chain = ExactChain({**TABLE_1, "link_inertia": (0.0, 0.0, 0.0)}, segments, links)
    share = np.concatenate([np.ones(6), np.full(2 * segments, 1 / links)])
    (q, v, v_dot), scale = state, np.concatenate([[1.0], share])
    q, v, v_dot = scale * q, share * v, share * v_dot
    mass = chain.mass_matrix(q) * np.outer(share, share)
    return [mass, share * chain.inverse_dynamics(q, v, v_dot), *chain.momentum(q, v)]


@pytest.fixture(scope="module")
def lagrange(exact):
    """H and C of Lagrange's equations at x = [p, xi, q_t] with xi = 0, by automatic
    differentiation.
    """
    nv = exact.nv
    x, x_dot, axes = ca.SX.sym("x", nv), ca.SX.sym("x_dot", nv), ca.SX.sym("R", 3, 3)
    half = ca.skew(x[3:6] / 2)
    # R_b = R Exp(xi) up to xi^2, so omega = xi_dot and omega_dot = xi_ddot at xi = 0
    turn = ca.DM.eye(3) + 2 / (1 + ca.sumsqr(x[3:6]) / 4) * (half + half @ half)
    points, masses = paper_slices(x, axes @ turn, exact.segments)
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


@pytest.mark.parametrize("kind", ["random", "folded"])
def test_lagrange_s_equations_of_the_paper_s_polar_form_agree(exact, lagrange, kind):
    for q, v, *_ in states_of(exact.segments, kind):
        x = np.concatenate([q[:3], np.zeros(3), q[7:]])
        mass, bias = (np.array(value) for value in lagrange(x, v, torso_rotation(q)))
        assert mass_matrix_error(mass, exact.mass_matrix(q)) <= 1e-13
        assert block_error(bias[:, 0], exact.bias_force(q, v)) <= 1e-13


@pytest.mark.parametrize("bend", [*BENDS, 300.0])
def test_tip_of_a_planar_bend_is_the_arc_s_to_the_last_bit(bend):
    mount, tip = ExactContinuum({**TABLE_1, "tail_mount": (0, 0, 0)}, 1).tail_points(
        [*UPRIGHT, bend, 0.0], 1
    )
    with mpmath.workdps(700):
        a, length = mpmath.mpf(bend), mpmath.mpf(TABLE_1["tail_length"])
        expected = [0, -length * mpmath.sin(a) / a, -length * (1 - mpmath.cos(a)) / a]
    np.testing.assert_array_equal(mount, np.zeros(3))
    assert_same_float64(tip, np.array(expected, dtype=float))


def test_tail_points_integrate_the_turning_tangent(exact, states):
    for q, *_ in states:
        points = exact.tail_points(q, 4)
        assert points.shape == (4 * exact.segments + 1, 3)
        np.testing.assert_allclose(
            points, tangent_integrals(q, exact.segments, 4), rtol=0, atol=1e-14
        )
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


def test_digits_are_the_continuum_s_own(exact):
    digits, (q, v, *_) = mpmath.mp.dps, states_of(exact.segments, "random")[0]
    with mpmath.workdps(5):
        continuum = ExactContinuum(TABLE_1, exact.segments)
        np.testing.assert_array_equal(continuum.bias_force(q, v), exact.bias_force(q, v))
    assert (mpmath.mp.dps, continuum.mp.dps) == (digits, 40)


def test_quaternion_is_normalised_and_arguments_are_left_alone(exact, states):
    q, v, v_dot, tau = states[0]
    scaled = q.copy()
    scaled[3:7] *= 2
    given = [x.copy() for x in (scaled, v, v_dot, tau)]
    np.testing.assert_array_equal(exact.bias_force(scaled, v), exact.bias_force(q, v))
    exact.forward_dynamics(scaled, v, tau, exact.inverse_dynamics(scaled, v, v_dot))
    for x, x_given in zip((scaled, v, v_dot, tau), given, strict=True):
        np.testing.assert_array_equal(x, x_given)
