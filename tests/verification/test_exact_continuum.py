"""The 40-digit continuum obeys exact laws to the last bit, whatever digits and nodes it has."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.exact_continuum import ExactContinuum
from tests.references.metrics import block_error, equilibrated_condition
from tests.references.parameters import KINDS, TABLE_1
from tests.support.exact_continuum_states import (
    BENDS,
    ROUNDING,
    UPRIGHT,
    assert_same_float64,
    at_rest,
    states_of,
    torso_rotation,
)

STEP = 1e-6


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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_more_digits_and_nodes_give_the_same_float64(kind):
    few, many = ExactContinuum(TABLE_1, 3, 30, 24), ExactContinuum(TABLE_1, 3, 50, 32)
    assert_same_quantities(few, many, states_of(3, kind)[1])


@pytest.mark.slow
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


@pytest.mark.slow
def test_internal_dynamics_do_not_depend_on_the_pose_to_the_last_bit(exact, states):
    continuum = ExactContinuum({**TABLE_1, "gravity": 0.0}, exact.segments)
    q, v, *_ = states[0]
    upright, internal = np.concatenate([UPRIGHT, q[7:]]), np.concatenate([np.zeros(3), v[3:]])
    assert_same_float64(continuum.mass_matrix(q)[3:, 3:], continuum.mass_matrix(upright)[3:, 3:])
    assert_same_float64(continuum.bias_force(q, v)[3:], continuum.bias_force(upright, internal)[3:])


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
