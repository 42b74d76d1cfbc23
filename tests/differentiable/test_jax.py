"""Functions for JAX: the model's values, exact derivatives, in every transformation."""

import re
import sys

import numpy as np
import pytest

import serpentail as st

from ..support.models import model_folder
from .conftest import RUNS, assert_near, by_differences

FUNCTIONS = ("forward_dynamics", "inverse_dynamics")
every_function = pytest.mark.parametrize("name", FUNCTIONS)


@pytest.fixture(scope="session")
def functions(model, jax):
    return st.jax_functions(model)


def arguments(states, name):
    """Arguments of a function: its last is tau or v_dot."""
    q, v, tau = states
    return (q, v, tau if name == "forward_dynamics" else 3 * np.roll(v, 1, axis=0))


@every_function
@pytest.mark.parametrize("runs", [1, 3, RUNS])
def test_values_are_the_models(jax, model, functions, states, name, runs):
    function, given = getattr(functions, name), arguments(states, name)
    given = [array[:runs] for array in given]
    expected = getattr(model, name)(*given)
    for found in (function, jax.jit(function), jax.jit(jax.vmap(function))):
        assert_near(found(*given), expected, 1e-12)
    assert_near(function(*(array[0] for array in given)), expected[0], 1e-12)


@every_function
def test_large_batches_are_made_in_lanes_and_threads(jax, model, functions, states, name):
    given = [np.tile(array, (200, 1)) for array in arguments(states, name)]
    assert_near(jax.jit(getattr(functions, name))(*given), getattr(model, name)(*given), 1e-12)


@every_function
def test_derivatives_are_those_by_differences(jax, model, functions, states, name):
    """The quaternion is not kept at norm 1: a change along it changes nothing."""
    function = getattr(functions, name)
    given = [array[2] for array in arguments(states, name)]
    forward = jax.jit(jax.jacfwd(function, (0, 1, 2)))(*given)
    backward = jax.jit(jax.jacrev(function, (0, 1, 2)))(*given)
    for k in range(3):
        expected = by_differences(
            lambda x, k=k: getattr(model, name)(*given[:k], x, *given[k + 1 :]), given[k]
        )
        assert_near(forward[k], expected, 1e-9)
        assert_near(backward[k], forward[k], 1e-12)
    assert np.abs(forward[0][:, 3:7] @ given[0][3:7]).max() < 1e-12 * np.abs(forward[0]).max()


def test_gradients_of_many_are_those_of_each(jax, functions, states):
    def loss(q, v, tau):
        return jax.numpy.sum(jax.numpy.sin(1e-3 * functions.forward_dynamics(q, v, tau)))

    at_once = jax.jit(jax.grad(loss, (0, 1, 2)))(*states)
    mapped = jax.jit(jax.vmap(jax.grad(loss, (0, 1, 2))))(*states)
    for one, other in zip(at_once, mapped, strict=True):
        assert_near(one, other, 1e-12)


def test_one_state_is_repeated_over_leading_axes(functions, model, states):
    q, v, tau = states
    found = functions.forward_dynamics(q[0], v[:12].reshape(3, 4, -1), tau[5])
    for k in range(12):
        assert_near(found[k // 4, k % 4], model.forward_dynamics(q[0], v[k], tau[5]), 1e-12)


def test_x_dot_and_its_derivatives_are_the_models(jax, model, functions, states):
    q, v, tau = states
    x = np.hstack([q, v])
    assert_near(jax.jit(functions.x_dot)(x, tau), model.x_dot(x, tau), 1e-12)
    A, B = jax.vmap(jax.jacrev(functions.x_dot, (0, 1)))(x, tau)
    for found, expected in zip((A, B), model.x_dot_derivatives(x, tau), strict=True):
        assert_near(found, expected, 1e-10)


def test_a_flight_is_differentiated_by_all_its_torques(jax, functions, states):
    """In a scan of Runge-Kutta's steps."""
    x, h = np.concatenate([states[0][1], states[1][1]]), 2e-3
    x[3:7] /= np.linalg.norm(x[3:7])

    def end(torques):
        def step(x, u):
            a = functions.x_dot(x, u)
            b = functions.x_dot(x + h / 2 * a, u)
            c = functions.x_dot(x + h / 2 * b, u)
            return x + h / 6 * (a + 2 * b + 2 * c + functions.x_dot(x + h * c, u)), None

        return jax.lax.scan(step, jax.numpy.asarray(x), torques)[0]

    torques = np.tile(states[2][0], (5, 1))
    flat = jax.jit(lambda u: end(u.reshape(5, 4))[3:7] @ np.array([1.0, 2.0, 3.0, 4.0]))
    found = jax.jit(jax.grad(flat))(torques.ravel())
    assert_near(found, by_differences(lambda u: flat(u)[None], torques.ravel())[0], 1e-8)


def test_states_that_the_model_refuses_have_nan_alone(jax, functions, states):
    q, v, tau = (array.copy() for array in states)
    v[4, 2], q[17, 3:7] = np.nan, 0
    found = np.asarray(jax.jit(functions.forward_dynamics)(q, v, tau))
    refused = np.zeros(RUNS, bool)
    refused[[4, 17]] = True
    assert np.array_equal(np.isnan(found).all(axis=1), refused)
    assert np.array_equal(np.isnan(found).any(axis=1), refused)


def test_models_of_other_parameters_are_others(jax, model, states):
    light = model.with_parameters(tail_mass=0.5 * model.parameters["tail_mass"])
    for each in (model, light):
        found = jax.jit(st.jax_functions(each).forward_dynamics)(*states)
        assert_near(found, each.forward_dynamics(*states), 1e-12)


def test_a_float_model_computes_with_floats(jax, states):
    float_model = st.load(model_folder(2, 2, functions=["forward_dynamics"], real="float"))
    jax.config.update("jax_enable_x64", False)
    try:
        found = st.jax_functions(float_model).forward_dynamics(*states)
        assert found.dtype == np.float32
        given = [array.astype(np.float32) for array in states]
        assert_near(found, float_model.forward_dynamics(*given), 1e-5)
    finally:
        jax.config.update("jax_enable_x64", True)


def test_a_tail_on_a_fixed_base_is_differentiated(jax):
    names = ["forward_dynamics", "forward_dynamics_derivatives"]
    model = st.load(model_folder(1, 2, functions=names, base="fixed"))
    functions, rng = st.jax_functions(model), np.random.default_rng(0)
    q, v, tau = 0.3 * rng.normal(size=(3, 2)) * [[1], [1], [1e-3]]
    found = jax.jacfwd(functions.forward_dynamics, (0, 1, 2))(q, v, tau)
    for one, other in zip(found, model.forward_dynamics_derivatives(q, v, tau), strict=True):
        assert_near(one, other, 1e-12)
    assert_near(functions.x_dot(np.r_[q, v], tau), model.x_dot(np.r_[q, v], tau), 1e-12)


# What is refused.


def test_32_bits_are_refused_with_the_remedy(jax, functions, states):
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(st.StateError, match=r'32 bits, .*update\("jax_enable_x64", True\)'):
            functions.forward_dynamics(*states)
    finally:
        jax.config.update("jax_enable_x64", True)


@pytest.mark.parametrize(
    "changed, line",
    [
        ({"q": np.zeros(10)}, "forward_dynamics: q has shape (10,), not (..., 11)"),
        ({"tau": 0.0}, "forward_dynamics: tau has shape (), not (..., 4)"),
        ({"v": np.zeros((5, 10))}, "leading axes differ ((21, 11), (5, 10), (21, 4)): give one"),
        ({"tau": np.zeros(4, complex)}, "forward_dynamics: tau: type complex128: needs real"),
        ({"tau": np.zeros(4, bool)}, "forward_dynamics: tau: type bool: needs real numbers"),
    ],
)
def test_what_is_wrong_is_named(functions, states, changed, line):
    given = dict(zip(("q", "v", "tau"), states, strict=True)) | changed
    with pytest.raises(st.StateError, match=re.escape(line)):
        functions.forward_dynamics(*given.values())
    with pytest.raises(st.StateError, match="x has shape"):
        functions.x_dot(np.zeros(5), np.zeros(4))


def test_functions_that_the_scene_left_out_are_named(jax):
    plain = st.load(model_folder(1, 1, functions=["forward_dynamics"]))
    functions = st.jax_functions(plain)
    given = [np.r_[0.0, 0, 0, 1, 0, 0, 0, 0, 0], np.zeros(8), np.zeros(2)]
    with pytest.raises(st.ModelError, match="without 'forward_dynamics_derivatives'"):
        jax.jacfwd(functions.forward_dynamics)(*given)
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        functions.inverse_dynamics(*given[:2], np.zeros(8))


def test_what_is_no_model_is_refused():
    for make in (st.jax_functions, st.torch_functions):
        with pytest.raises(st.ModelError, match="model: value 'rat': needs a model"):
            make("rat")


@pytest.mark.parametrize("tool", ["jax", "torch"])
def test_without_the_library_the_extra_is_named(model, monkeypatch, tool):
    monkeypatch.setitem(sys.modules, tool, None)
    with pytest.raises(st.ExtraMissing, match=rf'pip install "serpentail\[{tool}\]"'):
        getattr(st, f"{tool}_functions")(model)


def test_without_a_compiler_of_cpp_that_is_said(model, jax, monkeypatch):
    from serpentail.differentiable import jax_calls

    jax_calls.library.cache_clear()
    monkeypatch.setattr(jax_calls, "SOURCE", jax_calls.SOURCE.with_name("none.cc"))
    monkeypatch.setattr(jax_calls, "compile_library", failing)
    with pytest.raises(st.CompileFailed, match=r"a C\+\+17 compiler is needed .* such as g\+\+"):
        st.jax_functions(model)


def failing(*_, **__):
    raise st.CompileFailed("cc1plus: not found")
