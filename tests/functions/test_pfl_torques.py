"""Generated partial feedback linearisation: the tail gets the accelerations asked for, wherever the
torso is.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation.pfl import Pfl
from tests.references.parameters import random_states
from tests.support.models import model_folder

CASES = [
    (1, 3, {"emission": "straight"}),
    (2, 3, {"emission": "loops"}),
    (3, None, {}),
    (2, None, {"emission": "loops"}),
]


def model_of(segments, links, functions, **options):
    return st.load(model_folder(segments, links, functions=functions, name="rat", **options))


@pytest.mark.parametrize(("segments", "links", "options"), CASES)
def test_forward_dynamics_has_the_accelerations_asked_for(segments, links, options):
    """Eqs. 44 to 46, in flight."""
    model = model_of(segments, links, ["pfl", "forward_dynamics"], **options)
    q, v, v_dot, _ = random_states(segments, 3, 20, "random")
    wanted = v_dot[:, 6:]
    found = model.forward_dynamics(q, v, model.pfl(q, v, wanted))[:, 6:]
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-10 * np.abs(wanted).max())


@pytest.mark.parametrize(("segments", "links", "options"), CASES)
def test_torques_are_those_of_eliminating_in_h_and_c(segments, links, options):
    model = model_of(segments, links, ["pfl", "mass_matrix", "inverse_dynamics"], **options)
    for q, v, any_dot, _ in zip(*random_states(segments, 5, 10, "random"), strict=True):
        v_dot = np.concatenate([np.zeros(6), any_dot[6:]])
        H, force = model.mass_matrix(q), model.inverse_dynamics(q, v, v_dot)
        expected = force[6:] - H[6:, :6] @ np.linalg.solve(H[:6, :6], force[:6])
        found = model.pfl(q, v, v_dot[6:])
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_torques_depend_on_neither_place_nor_attitude_nor_gravity():
    model = model_of(2, 2, ["pfl"])
    q, v, v_dot, _ = (rows[0] for rows in random_states(2, 3, 1, "random"))
    tau = model.pfl(q, v, v_dot[6:])
    q[:7], v[:3] = [5, 6, 7, 0.1, 0.2, 0.3, 0.4], [8, 9, 10]
    assert np.array_equal(model.pfl(q, v, v_dot[6:]), tau)
    assert np.array_equal(model.with_parameters(gravity=0).pfl(q, v, v_dot[6:]), tau)


def test_tracking_by_it_is_tracking_without_it():
    reference = np.linspace(0, 1, 9), 0.2 * np.sin(np.linspace(0, 3, 9))[:, None] * np.ones(4)
    own, other = (model_of(2, 3, names) for names in (["pfl"], ["mass_matrix", "inverse_dynamics"]))
    q, v, _, _ = (rows[0] for rows in random_states(2, 3, 1, "random"))
    expected = Pfl(other, reference)(0.3, q, v)
    np.testing.assert_allclose(
        Pfl(own, reference)(0.3, q, v), expected, atol=1e-10 * np.abs(expected).max()
    )


def test_operations_are_those_of_the_function():
    model = model_of(2, None, ["pfl"])
    q, v, v_dot, _ = (rows[0] for rows in random_states(2, 3, 1, "random"))
    found = np.array(model.casadi.pfl(q, v, v_dot[6:])).ravel()
    np.testing.assert_allclose(found, model.pfl(q, v, v_dot[6:]), rtol=1e-10)


@pytest.mark.filterwarnings("ignore::serpentail.UnusualSize")
def test_under_a_torso_that_stays_a_link_needs_its_own_inertia():
    """One link on a torso so heavy that it stays: tau = (I + m (L / 2)^2) alpha_ddot."""
    parameters = {"torso_mass": 1e9, "torso_inertia": [1e9, 1e9, 1e9]}
    model = model_of(1, 1, ["pfl"], parameters=parameters)
    m, length, inertia = (
        model.parameters[name] for name in ("tail_mass", "tail_length", "link_inertia")
    )
    tau = model.pfl([0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), [3.0, 5.0])
    np.testing.assert_allclose(
        tau, np.array([3, 5]) * (np.array(inertia)[[0, 2]] + m * length**2 / 4), rtol=1e-9
    )


@pytest.mark.parametrize(("segments", "links", "options"), CASES)
def test_its_accelerations_are_those_of_forward_dynamics(segments, links, options):
    model = model_of(segments, links, ["pfl", "rollout", "energy", "momentum"], **options)
    q, v, v_dot, _ = random_states(segments, 3, 20, "random")
    tau, found = model.kernel("tracked_dynamics")(q, v, v_dot[:, 6:])
    np.testing.assert_array_equal(found[:, 6:], v_dot[:, 6:])
    np.testing.assert_allclose(tau, model.pfl(q, v, v_dot[:, 6:]), rtol=1e-12, atol=1e-14)
    expected = model.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())
