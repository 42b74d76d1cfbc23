"""Functions for JAX: the model's values, exact derivatives, in every transformation."""

from contextlib import contextmanager

import numpy as np
import pytest

import serpentail as st

from ..support import zoo
from ..support.rows import row
from .conftest import FUNCTIONS, REFUSED, RUNS, arguments, assert_near, by_differences, jacobians

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)


@pytest.fixture(scope="session")
def functions(model):
    return st.jax_functions(model)


@contextmanager
def of_32_bits():
    """Let JAX compute with floats."""
    jax.config.update("jax_enable_x64", False)
    try:
        yield
    finally:
        jax.config.update("jax_enable_x64", True)


def test_values_are_the_models(model, functions, states):
    """Of one state, of few, and of batches that are made in lanes and threads."""
    for name in FUNCTIONS:
        function, given = getattr(functions, name), arguments(states, name)
        expected, jitted = getattr(model, name)(*given), jax.jit(function)
        assert_near(function(*(array[0] for array in given)), expected[0], 1e-12)
        for runs in (1, 3, RUNS):
            with row(name, runs):
                few = [array[:runs] for array in given]
                for found in (function, jitted, jax.vmap(function)):
                    assert_near(found(*few), expected[:runs], 1e-12)
        many = (np.tile(array, (200, 1)) for array in given)
        assert_near(jitted(*many), np.tile(expected, (200, 1)), 1e-12)


def test_derivatives_are_those_by_differences(model, functions, states):
    """The quaternion is not kept at norm 1: a change along it changes nothing."""
    for name in FUNCTIONS:
        function, given = getattr(functions, name), [a[2] for a in arguments(states, name)]
        forward = jax.jacfwd(function, (0, 1, 2))(*given)
        backward = jax.jacrev(function, (0, 1, 2))(*given)
        wanted = jacobians(getattr(model, name), given)
        for one, other, expected in zip(forward, backward, wanted, strict=True):
            with row(name, expected.shape):
                assert_near(one, expected, 1e-9)
                assert_near(other, one, 1e-12)
        along = np.abs(forward[0][:, 3:7] @ given[0][3:7]).max()
        assert along < 1e-12 * np.abs(forward[0]).max()


def test_gradients_of_many_are_those_of_each(functions, states):
    def loss(q, v, tau):
        return jax.numpy.sum(jax.numpy.sin(1e-3 * functions.forward_dynamics(q, v, tau)))

    at_once = jax.jit(jax.grad(loss, (0, 1, 2)))(*states)
    mapped = jax.jit(jax.vmap(jax.grad(loss, (0, 1, 2))))(*states)
    for one, other in zip(at_once, mapped, strict=True):
        assert_near(one, other, 1e-12)


def test_one_state_is_repeated_over_leading_axes(functions, model, states):
    q, v, tau = states
    found = functions.forward_dynamics(q[0], v[:12].reshape(3, 4, -1), tau[5])
    expected = model.forward_dynamics(q[0], v[:12], tau[5])
    assert_near(found, expected.reshape(3, 4, -1), 1e-12)


def test_x_dot_and_its_derivatives_are_the_models(model, functions, states):
    x, tau = np.hstack(states[:2]), states[2]
    assert_near(jax.jit(functions.x_dot)(x, tau), model.x_dot(x, tau), 1e-12)
    found = jax.vmap(jax.jacrev(functions.x_dot, (0, 1)))(x, tau)
    for one, expected in zip(found, model.x_dot_derivatives(x, tau), strict=True):
        assert_near(one, expected, 1e-10)


def test_a_flight_is_differentiated_by_all_its_torques(functions, states):
    """In a scan of midpoint steps."""
    x, h = np.concatenate([states[0][1], states[1][1]]), 2e-3
    x[3:7] /= np.linalg.norm(x[3:7])

    def end(torques):
        def step(x, u):
            return x + h * functions.x_dot(x + h / 2 * functions.x_dot(x, u), u), None

        return jax.lax.scan(step, jax.numpy.asarray(x), torques.reshape(3, 4))[0]

    torques = np.tile(states[2][0], 3)
    flat = jax.jit(lambda u: end(u)[3:7] @ np.array([1.0, 2.0, 3.0, 4.0]))
    found = jax.jit(jax.grad(flat))(torques)
    assert_near(found, by_differences(lambda u: flat(u)[None], torques)[0], 1e-8)


def test_states_that_the_model_refuses_have_nan_alone(functions, states):
    q, v, tau = (array.copy() for array in states)
    v[4, 2], q[17, 3:7] = np.nan, 0
    found = np.isnan(np.asarray(functions.forward_dynamics(q, v, tau)))
    for refused in (found.all(axis=1), found.any(axis=1)):
        assert list(refused.nonzero()[0]) == [4, 17]


def test_models_of_other_parameters_are_others(model, states):
    light = model.with_parameters(tail_mass=0.5 * model.parameters["tail_mass"])
    for each in (model, light):
        found = st.jax_functions(each).forward_dynamics(*states)
        assert_near(found, each.forward_dynamics(*states), 1e-12)


def test_a_float_model_computes_with_floats_and_no_other(functions, states):
    single = zoo.model("single")
    with of_32_bits():
        found = st.jax_functions(single).forward_dynamics(*states)
        assert found.dtype == np.float32
        with pytest.raises(st.StateError, match=r'32 bits, .*update\("jax_enable_x64", True\)'):
            functions.forward_dynamics(*states)
    given = [array.astype(np.float32) for array in states]
    assert_near(found, single.forward_dynamics(*given), 1e-5)


def test_a_tail_on_a_fixed_base_is_differentiated():
    model = zoo.model("fixed")
    functions, rng = st.jax_functions(model), np.random.default_rng(0)
    q, v, tau = 0.3 * rng.normal(size=(3, 4)) * [[1], [1], [1e-3]]
    found = jax.jacfwd(functions.forward_dynamics, (0, 1, 2))(q, v, tau)
    for one, other in zip(found, model.forward_dynamics_derivatives(q, v, tau), strict=True):
        assert_near(one, other, 1e-12)
    assert_near(functions.x_dot(np.r_[q, v], tau), model.x_dot(np.r_[q, v], tau), 1e-12)


# What is refused.


def test_what_is_wrong_is_named(functions, states):
    whole = dict(zip(("q", "v", "tau"), states, strict=True))
    scalar = ({"tau": 0.0}, r"forward_dynamics: tau has shape \(\), not \(\.\.\., 4\)")
    for change, words in [*REFUSED, scalar]:
        with row(words), pytest.raises(st.StateError, match=words):
            functions.forward_dynamics(*(whole | change).values())
    with pytest.raises(st.StateError, match="x has shape"):
        functions.x_dot(np.zeros(5), np.zeros(4))


def test_functions_that_the_scene_left_out_are_named():
    functions = st.jax_functions(zoo.model("bare"))
    given = [np.r_[0.0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2)]
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_derivatives'"):
        jax.jacfwd(functions.forward_dynamics)(*given)
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        functions.inverse_dynamics(*given[:2], np.zeros(8))


def test_without_a_compiler_of_cpp_that_is_said(model, monkeypatch):
    from serpentail.differentiable import jax_calls

    def failing(*_, **__):
        raise st.CompileFailed("cc1plus: not found")

    jax_calls.library.cache_clear()
    monkeypatch.setattr(jax_calls, "SOURCE", jax_calls.SOURCE.with_name("none.cc"))
    monkeypatch.setattr(jax_calls, "compile_library", failing)
    with pytest.raises(st.CompileFailed, match=r"jax_functions: .*C\+\+17.*cc1plus"):
        st.jax_functions(model)
