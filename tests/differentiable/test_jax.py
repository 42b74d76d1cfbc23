"""Functions inside the transformations of JAX, and what is of JAX alone."""

from contextlib import contextmanager

import numpy as np
import pytest

import serpentail as st

from ..support import zoo
from .tools import Jax, assert_near, by_differences, states

jax = pytest.importorskip("jax")


@pytest.fixture(scope="module")
def functions():
    return Jax().functions(zoo.model("m2_n2"))


@contextmanager
def of_32_bits():
    """Let JAX compute with floats."""
    jax.config.update("jax_enable_x64", False)
    try:
        yield
    finally:
        jax.config.update("jax_enable_x64", True)


def test_gradients_of_many_are_those_of_each(functions):
    """By jit, vmap and grad; forwards as backwards."""

    def loss(q, v, tau):
        return jax.numpy.sum(jax.numpy.sin(1e-3 * functions.forward_dynamics(q, v, tau)))

    given = states()
    at_once = jax.jit(jax.grad(loss, (0, 1, 2)))(*given)
    mapped = jax.jit(jax.vmap(jax.grad(loss, (0, 1, 2))))(*given)
    forward = jax.jacfwd(loss, (0, 1, 2))(*given)
    for one, *others in zip(at_once, mapped, forward, strict=True):
        for other in others:
            assert_near(one, other, 1e-12)


def test_a_flight_is_differentiated_by_all_its_torques(functions):
    """In a scan of midpoint steps."""
    q, v, tau = states()
    x, h = np.concatenate([q[1], v[1]]), 2e-3
    x[3:7] /= np.linalg.norm(x[3:7])

    def end(torques):
        def step(x, u):
            return x + h * functions.x_dot(x + h / 2 * functions.x_dot(x, u), u), None

        return jax.lax.scan(step, jax.numpy.asarray(x), torques.reshape(3, 4))[0]

    flat = jax.jit(lambda u: end(u)[3:7] @ np.array([1.0, 2.0, 3.0, 4.0]))
    found = jax.jit(jax.grad(flat))(np.tile(tau[0], 3))
    assert_near(found, by_differences(lambda u: flat(u)[None], np.tile(tau[0], 3))[0], 1e-8)


def test_states_that_the_model_refuses_have_nan_alone(functions):
    q, v, tau = states()
    v[4, 2], q[17, 3:7] = np.nan, 0
    found = np.isnan(np.asarray(functions.forward_dynamics(q, v, tau)))
    for refused in (found.all(axis=1), found.any(axis=1)):
        assert list(refused.nonzero()[0]) == [4, 17]


def test_models_of_other_parameters_are_others():
    model = zoo.model("m2_n2")
    for each in (model, model.with_parameters(tail_mass=0.5 * model.parameters["tail_mass"])):
        found = st.jax_functions(each).forward_dynamics(*states())
        assert_near(found, each.forward_dynamics(*states()), 1e-12)


def test_a_float_model_computes_with_floats_and_no_other(functions):
    single = zoo.model("single")
    with of_32_bits():
        found = st.jax_functions(single).forward_dynamics(*states())
        assert found.dtype == np.float32
        with pytest.raises(st.StateError, match=r'32 bits, .*update\("jax_enable_x64", True\)'):
            functions.forward_dynamics(*states())
    given = [array.astype(np.float32) for array in states()]
    assert_near(found, single.forward_dynamics(*given), 1e-5)


def test_without_a_compiler_of_cpp_that_is_said(monkeypatch):
    from serpentail.differentiable import jax_calls

    def failing(*_, **__):
        raise st.CompileFailed("cc1plus: not found")

    jax_calls.library.cache_clear()
    monkeypatch.setattr(jax_calls, "SOURCE", jax_calls.SOURCE.with_name("none.cc"))
    monkeypatch.setattr(jax_calls, "compile_library", failing)
    with pytest.raises(st.CompileFailed, match=r"jax_functions: .*C\+\+17.*cc1plus"):
        st.jax_functions(zoo.model("bare"))
