"""The 40-digit reference agrees with the float64 ones, and to the last bit with exact laws."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from tests.references.exact_chain import ExactChain
from tests.references.metrics import block_error, equilibrated_condition, mass_matrix_error
from tests.references.mujoco_chain import MujocoChain
from tests.references.parameters import KINDS, TABLE_1, random_states
from tests.references.pinocchio_chain import PinocchioChain

SIZES = [(1, 1), (1, 3), (3, 4)]
LIBRARIES = (PinocchioChain, MujocoChain)
ROUNDING = np.finfo(float).eps
RESIDUE = 1e-25


@pytest.fixture(scope="module", params=SIZES, ids=lambda size: f"m{size[0]}_n{size[1]}")
def exact(request):
    """The exact chain of one size."""
    return ExactChain(TABLE_1, *request.param)


@pytest.fixture(scope="module", params=LIBRARIES)
def library(request, exact):
    """A float64 chain of the same size."""
    return request.param(TABLE_1, exact.segments, exact.links)


@pytest.fixture(params=KINDS)
def states(request, exact):
    """Two tuples (q, v, v_dot, tau) of one kind."""
    return states_of(exact.segments, request.param)


def states_of(segments, kind):
    """Two tuples (q, v, v_dot, tau)."""
    return list(zip(*random_states(segments, 11, 2, kind), strict=True))


def assert_same_float64(x, x_ref):
    """Every entry is the same float64, but for zeros that come out as what is left of many
    digits.
    """
    x, x_ref = np.asarray(x), np.asarray(x_ref)
    floor = RESIDUE * np.max(np.abs(x_ref))
    np.testing.assert_array_equal(
        *(np.where(np.abs(values) < floor, 0.0, values) for values in (x, x_ref))
    )


def assert_same_quantities(chain, other, state):
    """Every quantity of two chains is the same float64 at one state."""
    q, v, v_dot, tau = state
    assert_same_float64(chain.mass_matrix(q), other.mass_matrix(q))
    assert_same_float64(chain.bias_force(q, v), other.bias_force(q, v))
    assert_same_float64(chain.inverse_dynamics(q, v, v_dot), other.inverse_dynamics(q, v, v_dot))
    assert_same_float64(chain.forward_dynamics(q, v, tau), other.forward_dynamics(q, v, tau))
    assert_same_float64(chain.energy(q, v), other.energy(q, v))
    assert_same_float64(chain.momentum(q, v), other.momentum(q, v))


def test_mass_matrix_agrees(exact, library, states):
    for q, *_ in states:
        assert mass_matrix_error(library.mass_matrix(q), exact.mass_matrix(q)) <= 1e-13


def test_bias_force_agrees(exact, library, states):
    for q, v, *_ in states:
        assert block_error(library.bias_force(q, v), exact.bias_force(q, v)) <= 1e-13


def test_inverse_dynamics_agrees(exact, library, states):
    for q, v, v_dot, _ in states:
        force = exact.inverse_dynamics(q, v, v_dot)
        assert block_error(library.inverse_dynamics(q, v, v_dot), force) <= 1e-13


def test_forward_dynamics_agrees(exact, library, states):
    for q, v, _, tau in states:
        limit = 1e-13 * equilibrated_condition(exact.mass_matrix(q))
        assert (
            block_error(library.forward_dynamics(q, v, tau), exact.forward_dynamics(q, v, tau))
            <= limit
        )


def test_energy_agrees(exact, library, states):
    for q, v, *_ in states:
        assert library.energy(q, v) == pytest.approx(exact.energy(q, v), rel=1e-13, abs=1e-14)


def test_center_of_mass_agrees(exact, library, states):
    for q, v, *_ in states:
        pairs = zip(library.center_of_mass(q, v), exact.center_of_mass(q, v), strict=True)
        for found, expected in pairs:
            assert np.max(np.abs(found - expected)) <= 1e-13 * np.max(np.abs(expected))


def test_momentum_agrees(exact, library, states):
    for q, v, *_ in states:
        for momentum, momentum_ref in zip(
            library.momentum(q, v), exact.momentum(q, v), strict=True
        ):
            assert np.max(np.abs(momentum - momentum_ref)) <= 1e-13 * np.max(np.abs(momentum_ref))


@pytest.mark.parametrize("library_class", LIBRARIES)
def test_given_link_inertia_replaces_the_ellipsoid(library_class):
    parameters = {key: value for key, value in TABLE_1.items() if key != "link_radius"}
    parameters["link_inertia"] = (4.9e-8, 2e-9, 5e-8)
    q, v, v_dot, _ = states_of(2, "random")[0]
    ours, theirs = ExactChain(parameters, 2, 3), library_class(parameters, 2, 3)
    assert mass_matrix_error(theirs.mass_matrix(q), ours.mass_matrix(q)) <= 1e-13
    assert mass_matrix_error(ours.mass_matrix(q), ExactChain(TABLE_1, 2, 3).mass_matrix(q)) >= 1e-3
    assert (
        block_error(theirs.inverse_dynamics(q, v, v_dot), ours.inverse_dynamics(q, v, v_dot))
        <= 1e-13
    )


def test_inverse_dynamics_is_mass_times_acceleration_plus_bias(exact, states):
    for q, v, v_dot, _ in states:
        mass, bias = exact.mass_matrix(q), exact.bias_force(q, v)
        error = np.abs(exact.inverse_dynamics(q, v, v_dot) - (mass @ v_dot + bias))
        # no more than the rounding of H, C and of this sum in float64
        assert np.all(error <= exact.nv * ROUNDING * (np.abs(mass) @ np.abs(v_dot) + np.abs(bias)))


def test_forward_dynamics_inverts_inverse_dynamics(exact, states):
    for q, v, v_dot, tau in states:
        external = exact.inverse_dynamics(q, v, v_dot) - np.concatenate([np.zeros(6), tau])
        limit = 1e-14 * equilibrated_condition(exact.mass_matrix(q))
        assert block_error(exact.forward_dynamics(q, v, tau, external), v_dot) <= limit


def test_kinetic_energy_is_the_mass_matrix_form(exact, states):
    for q, v, *_ in states:
        mass = exact.mass_matrix(q)
        limit = exact.nv * ROUNDING * (np.abs(v) @ np.abs(mass) @ np.abs(v))
        assert abs(exact.energy(q, v)[0] - v @ mass @ v / 2) <= limit


def test_linear_momentum_is_the_upper_rows_of_mass_times_velocity(exact, states):
    for q, v, *_ in states:
        rows = exact.mass_matrix(q)[:3]
        limit = exact.nv * ROUNDING * (np.abs(rows) @ np.abs(v))
        assert np.all(np.abs(exact.momentum(q, v)[0] - rows @ v) <= limit)


def test_translational_mass_is_the_nearest_float64_of_the_total(exact, states):
    total = float(Fraction(TABLE_1["torso_mass"]) + Fraction(TABLE_1["tail_mass"]))
    np.testing.assert_array_equal(exact.mass_matrix(states[0][0])[:3, :3], total * np.eye(3))


@pytest.mark.slow
def test_more_digits_give_the_same_float64(exact, states):
    few, many = (ExactChain(TABLE_1, exact.segments, exact.links, digits) for digits in (30, 50))
    assert_same_quantities(few, many, states[0])
    assert_same_quantities(exact, many, states[1])


@pytest.mark.slow
def test_internal_dynamics_do_not_depend_on_the_pose_to_the_last_bit(exact, states):
    chain = ExactChain({**TABLE_1, "gravity": 0.0}, exact.segments, exact.links)
    for q, v, *_ in states:
        upright = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0], q[7:]])
        internal = np.concatenate([np.zeros(3), v[3:]])
        assert_same_float64(chain.mass_matrix(q)[3:, 3:], chain.mass_matrix(upright)[3:, 3:])
        assert_same_float64(chain.bias_force(q, v)[3:], chain.bias_force(upright, internal)[3:])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_one_link_is_the_universal_pendulum_to_the_last_bit(kind):
    chain = ExactChain(TABLE_1, 1, 1)
    for q, v, *_ in states_of(1, kind):
        upright = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0], q[7:]])
        coupling, mass, bias = pendulum(q[7:], v[6:])
        assert_same_float64(chain.mass_matrix(upright)[:3, 6:], coupling)
        assert_same_float64(chain.mass_matrix(upright)[6:, 6:], mass)
        assert_same_float64(
            chain.bias_force(upright, np.concatenate([np.zeros(6), v[6:]]))[6:], bias
        )


@mpmath.workdps(50)
def pendulum(angles, rates):
    """H_pt, H_tt and C_t of one link on a torso at rest in the world's axes, by Lagrange's
    equations.
    """
    mass, gravity, half, across, along = one_link()
    (ca, sa), (cb, sb) = (mpmath.cos_sin(angle) for angle in angles)
    pitch = [0, half * cb * sa, -half * cb * ca]  # d p_com / d alpha
    yaw = [half * cb, half * sb * ca, half * sb * sa]  # d p_com / d beta
    spread = mass * half**2 + across - along  # H_aa = along + spread cos(beta)^2
    alpha_dot, beta_dot = (mpmath.mpf(rate) for rate in rates)
    coupling = [[mass * x, mass * y] for x, y in zip(pitch, yaw, strict=True)]
    inertia = [[along + spread * cb**2, 0], [0, across + mass * half**2]]
    bias = [
        mass * gravity * pitch[2] - 2 * spread * cb * sb * alpha_dot * beta_dot,
        mass * gravity * yaw[2] + spread * cb * sb * alpha_dot**2,
    ]
    return tuple(np.array(values, dtype=float) for values in (coupling, inertia, bias))


def one_link():
    """m, g, L/2 and the moments of an ellipsoid (r, L/2, r) across and along its axis."""
    names = ("tail_mass", "gravity", "tail_length", "link_radius")
    mass, gravity, length, radius = (mpmath.mpf(TABLE_1[name]) for name in names)
    half = length / 2
    return mass, gravity, half, mass * (half**2 + radius**2) / 5, mass * 2 * radius**2 / 5


@pytest.mark.parametrize("links", range(1, 9))
def test_straight_tail_has_the_rational_inertia_to_the_last_bit(links):
    chain = ExactChain({**TABLE_1, "link_radius": 0.1}, 1, links)
    mass_matrix = chain.mass_matrix(np.eye(chain.nq)[3])
    coupling, inertia = straight_tail(Fraction(0.1), links)
    assert_same_float64(mass_matrix[:3, 6:], [[0, coupling], [0, 0], [-coupling, 0]])
    assert_same_float64(mass_matrix[6:, 6:], inertia * np.eye(2))


def straight_tail(radius, links):
    """Sums of m l j^2 / 2 and m (l j^2 / 2)^2 + I j^2 over links that turn at j times the rate."""
    mass, length = (Fraction(TABLE_1[name]) / links for name in ("tail_mass", "tail_length"))
    across = mass * (radius**2 + (length / 2) ** 2) / 5
    arms = [(rate, length * rate**2 / 2) for rate in range(1, links + 1)]
    inertia = sum(mass * arm**2 + across * rate**2 for rate, arm in arms)
    return float(mass * sum(arm for _, arm in arms)), float(inertia)


def test_digits_are_the_chain_s_own(exact, states):
    digits = mpmath.mp.dps
    expected = ExactChain(TABLE_1, exact.segments, exact.links).bias_force(*states[0][:2])
    with mpmath.workdps(5):
        chain = ExactChain(TABLE_1, exact.segments, exact.links)
        np.testing.assert_array_equal(chain.bias_force(*states[0][:2]), expected)
    assert mpmath.mp.dps == digits


def test_quaternion_is_normalised_and_arguments_are_left_alone(exact, states):
    for q, v, v_dot, tau in states:
        scaled = q.copy()
        scaled[3:7] *= 2
        given = [x.copy() for x in (scaled, v, v_dot, tau)]
        np.testing.assert_array_equal(exact.bias_force(scaled, v), exact.bias_force(q, v))
        exact.forward_dynamics(scaled, v, tau, exact.inverse_dynamics(scaled, v, v_dot))
        for x, x_given in zip((scaled, v, v_dot, tau), given, strict=True):
            np.testing.assert_array_equal(x, x_given)
