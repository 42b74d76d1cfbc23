"""Models of floats, their names, what they keep alive, and x_dot."""

import gc
import weakref

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from tests.support import zoo

from ...support.rows import row
from .conftest import CALLS, NV, POINTS, SIZES, assert_same, call, state, states


def assert_close(found, expected, rtol, atol):
    """Compare outputs; atol is a part of the largest number of each."""
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=rtol, atol=atol * np.abs(other).max())


def test_float_model(model):
    single = zoo.model("single")
    for arguments in (state(), states(3)):
        floats = {key: np.float32(a) for key, a in arguments.items()}
        for name in CALLS:
            with row(name):
                exact = call(single, name, floats)
                assert_same(call(single, name, arguments), exact)
                assert {found.dtype for found in exact} == {np.dtype(np.float32)}
                rounded = {key: a.astype(float) for key, a in floats.items()}
                assert_close(exact, call(model, name, rounded), 2e-2, 1e-3)
    with pytest.raises(st.StateError, match=r"v\[0\]: value inf"):
        single.bias_force(state()["q"], [1e39] + [0] * (NV - 1))


def test_quaternion_may_have_any_norm(model):
    arguments = state()
    unit = arguments["q"].copy()
    unit[3:7] /= np.linalg.norm(unit[3:7])
    for factor in (-1.0, 2.0**-40, 3.7, 1e-100, 1e100):
        scaled = np.r_[unit[:3], factor * unit[3:7], unit[7:]]
        for name in CALLS:
            with row(name, factor):
                found, expected = (call(model, name, arguments | {"q": q}) for q in (scaled, unit))
                assert_close(found, expected, 1e-11, 1e-13)


def test_names_of_the_field_and_loads_by_name(model):
    q, v, v_dot, tau, f_ext = map(state().get, ("q", "v", "v_dot", "tau", "f_ext"))
    assert_same(model.crba(q), model.mass_matrix(q))
    assert_same(model.nle(q, v), model.bias_force(q, v))
    assert_same(model.rnea(q, v, v_dot), model.inverse_dynamics(q, v, v_dot))
    for load in (None, f_ext):
        assert_same(model.aba(q, v, tau, load), model.forward_dynamics(q, v, tau, load))
    tail = np.arange(7, 7 + 3 * POINTS).reshape(-1, 3)
    load = model.external_force(force=(1, 2, 3), moment=[4, 5, 6], tail=tail)
    np.testing.assert_array_equal(load, np.arange(1.0, 7 + 3 * POINTS))
    np.testing.assert_array_equal(model.external_force(), np.zeros(SIZES["f_ext"]))
    wrong = [("force", (1, 2)), ("force", "xyz"), ("moment", 1.0), ("tail", np.zeros(3 * POINTS))]
    for name, value in wrong:
        with pytest.raises(st.StateError, match=name):
            model.external_force(**{name: value})


def test_function_left_out_is_named_with_the_remedy():
    bare = zoo.model("bare")
    for name in CALLS.keys() - {"forward_dynamics"}:
        with pytest.raises(st.ModelError, match=f"bare .*'{name}'.*forward_dynamics.*`functions`"):
            call(bare, name, state())
    with pytest.raises(st.ModelError, match=r"bare .*'energy'"):
        _ = bare.casadi.energy
    assert not hasattr(bare.casadi, "_repr_html_")


def test_kernel_keeps_what_it_needs():
    whole = st.load(zoo.folder("m2_n2"), {"tail_mass": 0.05})
    expected, kernel = whole.mass_matrix(state()["q"]), whole.kernel("mass_matrix")
    gone, *kept = map(weakref.ref, (whole, whole.parameter_vector, whole.library))
    del whole
    gc.collect()
    assert gone() is None
    assert all(reference() is not None for reference in kept)
    np.testing.assert_array_equal(kernel(state()["q"]), expected)
    del kernel
    gc.collect()
    assert kept[0]() is None


# x_dot: the equations of motion as one first-order system


@pytest.fixture(params=["m1_n3", "arcs2"])
def moving(request):
    """A model, its state and its torques."""
    model, rng = zoo.model(request.param), np.random.default_rng(1)
    x = rng.normal(size=model.nq + model.nv)
    x[3:7] /= np.linalg.norm(x[3:7])
    return model, x, 1e-3 * rng.normal(size=model.layout.nt)


def test_x_dot_is_of_turns_and_accelerations_and_mends_the_norm(moving):
    """The square s of the norm follows s_dot = 2 (1 - s) s; states may be in rows."""
    (model, x, u), h = moving, 1e-6
    nq, omega, x_dot = model.nq, x[model.nq + 3 : model.nq + 6], model.x_dot(x, u)
    assert np.array_equal(x_dot[:3], x[nq : nq + 3])
    assert np.array_equal(x_dot[7:nq], x[nq + 6 :])
    assert np.array_equal(x_dot[nq:], model.forward_dynamics(x[:nq], x[nq:], u))
    turns = Rotation.from_quat(np.roll(x[3:7], -1)) * Rotation.from_rotvec(np.outer([h, -h], omega))
    after, before = (np.roll(q, 1) * np.sign(np.roll(q, 1) @ x[3:7]) for q in turns.as_quat())
    assert np.allclose(x_dot[3:7], (after - before) / (2 * h), rtol=0, atol=1e-9)
    x[3:7] *= 1.1
    expected = 1.1 * x_dot[3:7] + (1 - 1.21) * x[3:7]
    assert np.allclose(model.x_dot(x, u)[3:7], expected, rtol=1e-13, atol=1e-13)
    assert np.array_equal(model.x_dot(np.stack([x, 2 * x]), u)[0], model.x_dot(x, u))
    A, B = model.x_dot_derivatives(x, np.stack([u, 3 * u]))
    assert np.array_equal(A[1], model.x_dot_derivatives(x, 3 * u)[0])
    assert B.shape == (2, len(x), len(u))
    for wrong, words in (
        (x[1:], rf"x has shape \({len(x) - 1},\).*{len(x)}.*\({nq}\).*\({model.nv}\)"),
        (np.float64(1), r"x has shape \(\)"),
        (x * np.nan, r"x\[0\]: value nan"),
        (0 * x, "quaternion"),
    ):
        for method in (model.x_dot, model.x_dot_derivatives):
            with row(words), pytest.raises(st.StateError, match=words):
                method(wrong, u)


def test_values_and_derivatives_are_casadis_interpreted_and_compiled(moving):
    model, x, u = moving
    p, f = model.casadi.parameter_vector, model.casadi.x_dot
    compiled = model.casadi.external("x_dot", derivatives=1)
    folded = model.casadi.external("x_dot", derivatives=1, folded=True)
    assert (compiled.name_in(), folded.name_in()) == (["x", "u", "p"], ["x", "u"])
    jacobian = f.factory("J", ["x", "u", "p"], ["jac:x_dot:x", "jac:x_dot:u"])
    for norm in (1.0, 0.7):
        x[3:7] *= norm
        for found, rtol in ((f(x, u, p), 1e-9), (compiled(x, u, p), 1e-13), (folded(x, u), 1e-13)):
            assert np.allclose(found.full()[:, 0], model.x_dot(x, u), rtol=rtol, atol=rtol)
        for own, other in zip(model.x_dot_derivatives(x, u), jacobian(x, u, p), strict=True):
            assert np.abs(own - other.full()).max() < 1e-12 * np.abs(own).max()
    by_x = folded.factory("J", ["x", "u"], ["jac:x_dot:x"])(x, u).full()
    assert np.allclose(by_x, model.x_dot_derivatives(x, u)[0], rtol=1e-11, atol=1e-11)
