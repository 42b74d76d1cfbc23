"""Rates of airborne states are those of the full animal, to 40 digits."""

import numpy as np
import pytest

from serpentail import StateError
from serpentail.attitude import quaternion_rate
from tests.references.metrics import block_error, equilibrated_condition

from .states import airborne_arguments, airborne_model, exact_tail, moving_states, rates


def test_omega_and_accelerations_are_those_of_the_momentum(model, size, moving, calls):
    exact = exact_tail(*size[:2])
    for (q, v, tau), arguments in zip(moving, calls, strict=True):
        y = model.kernel("airborne_rates")(*rates(arguments))
        quaternion, rate, acceleration, omega = np.split(y, np.cumsum([4, len(tau), len(tau)]))
        condition = equilibrated_condition(exact.mass_matrix(q))
        scale = max(np.abs(v).max(), 1e-300)
        assert np.abs(omega - v[3:6]).max() <= 1e-14 * condition * scale
        expected = exact.forward_dynamics(q, v, tau)[6:]
        assert block_error(acceleration, expected) <= 5e-14 * condition
        np.testing.assert_array_equal(rate, v[6:])
        turning = np.array(quaternion_rate(q[3:7], omega))
        np.testing.assert_allclose(quaternion, turning, atol=1e-15 * np.abs(turning).max())


def test_all_three_functions_give_the_same_rates(model, calls):
    """With the same Jacobian; those that give more do not compute otherwise."""
    for arguments in calls:
        y = model.kernel("airborne_rates")(*rates(arguments))
        first, J = model.kernel("airborne_rates_derivatives")(*rates(arguments))
        second, same, _ = model.kernel("airborne_rates_hessian")(*arguments.values())
        for found, expected in ((first, y), (second, y), (same, J)):
            scale = np.abs(expected).max(axis=-1, keepdims=True)
            assert (np.abs(found - expected) <= 1e-11 * scale + 1e-300).all()


def test_the_norm_of_a_quaternion_is_a_factor_of_its_rate_alone():
    model = airborne_model(2, 2, "loops")
    ((q, v, tau),) = moving_states(2, "random", 1)
    arguments = airborne_arguments(q, v, tau, [1e-4, 2e-4, -3e-4])
    y = model.kernel("airborne_rates")(*rates(arguments))
    arguments["x"][:4] *= -3.7
    found = model.kernel("airborne_rates")(*rates(arguments))
    np.testing.assert_allclose(found[:4], -3.7 * y[:4], rtol=1e-13)
    np.testing.assert_allclose(found[4:], y[4:], rtol=1e-12)


def test_a_turn_of_state_and_momentum_changes_nothing_in_torso_axes():
    model = airborne_model(1, 3, "straight")
    ((q, v, tau),) = moving_states(1, "random", 1)
    arguments = airborne_arguments(q, v, tau, [1e-4, 2e-4, -3e-4])
    y = model.kernel("airborne_rates")(*rates(arguments))
    w, x, y_, z = arguments["x"][:4]
    arguments["x"][:4] = np.sqrt(0.5) * np.array([w - x, x + w, y_ - z, z + y_])  # about x
    a, b, c = arguments["angular"]
    arguments["angular"] = np.array([a, -c, b])
    found = model.kernel("airborne_rates")(*rates(arguments))
    np.testing.assert_allclose(found[4:], y[4:], rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("name", ["x", "tau", "angular", "weights"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(name, value):
    model = airborne_model(2, 2, "loops")
    ((q, v, tau),) = moving_states(2, "random", 1)
    arguments = airborne_arguments(q, v, tau, [1e-4, 0, 0])
    arguments[name] = arguments[name].copy()
    arguments[name][-1] = value
    with pytest.raises(StateError, match=f"airborne_rates_hessian: {name}"):
        model.kernel("airborne_rates_hessian")(*arguments.values())


@pytest.mark.parametrize("scale", [0.0, 1e-200, 1e200])
def test_a_quaternion_without_attitude_is_refused(scale):
    model = airborne_model(2, 2, "loops")
    ((q, v, tau),) = moving_states(2, "random", 1)
    arguments = airborne_arguments(q, v, tau, [1e-4, 0, 0])
    arguments["x"][:4] *= scale
    with pytest.raises(StateError, match=r"quaternion x\[0:4\]"):
        model.kernel("airborne_rates")(*rates(arguments))


def test_a_bend_beyond_the_range_is_refused():
    model = airborne_model(2, None, "loops")
    ((q, v, tau),) = moving_states(2, "random", 1)
    q[9:11] = 6, 6
    arguments = airborne_arguments(q, v, tau, [1e-4, 0, 0])
    with pytest.raises(StateError, match=r"segment 2 is bent by 8\.48528 rad"):
        model.kernel("airborne_rates")(*rates(arguments))
