"""x_dot: the equations of motion as one first-order system, against turns, other integrators and
CasADi's derivatives.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import serpentail as st
from tests.support import zoo


@pytest.fixture(params=["m1_n3", "arcs2"])
def model(request):
    return zoo.model(request.param)


@pytest.fixture
def state(model):
    rng = np.random.default_rng(1)
    x = rng.normal(size=model.nq + model.nv)
    x[3:7] /= np.linalg.norm(x[3:7])
    return x, 1e-3 * rng.normal(size=model.layout.nt)


def turned(quaternion, omega, duration):
    """The quaternion (w, x, y, z) after a turn at a rate in its own axes."""
    turn = Rotation.from_rotvec(omega * duration)
    after = np.roll((Rotation.from_quat(np.roll(quaternion, -1)) * turn).as_quat(), 1)
    return after * np.sign(after @ quaternion)


def flown(model, x, duration, tolerance):
    """The state that SciPy's order 8 comes to without torques."""
    u = np.zeros(model.layout.nt)
    settings = {"method": "DOP853", "rtol": tolerance, "atol": tolerance}
    return solve_ivp(lambda _, x: model.x_dot(x, u), (0, duration), x, **settings).y[:, -1]


def test_the_kinematics_are_those_of_turns(model, state):
    x, u = state
    nq, h = model.nq, 1e-6
    x_dot = model.x_dot(x, u)
    assert np.array_equal(x_dot[:3], x[nq : nq + 3])
    assert np.array_equal(x_dot[7:nq], x[nq + 6 :])
    omega = x[nq + 3 : nq + 6]
    change = (turned(x[3:7], omega, h) - turned(x[3:7], omega, -h)) / (2 * h)
    assert np.allclose(x_dot[3:7], change, rtol=0, atol=1e-9)
    assert np.array_equal(x_dot[nq:], model.forward_dynamics(x[:nq], x[nq:], u))


def test_the_norm_returns_to_one(model, state):
    """The square s of the norm follows s_dot = 2 (1 - s) s / s: s / (1 - s) grows as exp(2 t)."""
    x, _ = state
    x[3:7] *= 1.1
    x[model.nq :] *= 0.1
    after, ratio = flown(model, x, 0.1, 1e-9)[3:7], 1.21 / (1 - 1.21) * np.exp(0.2)
    assert after @ after == pytest.approx(ratio / (1 + ratio), abs=1e-6)


def test_values_and_derivatives_are_casadis_interpreted_and_compiled(model, state):
    x, u = state
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


def test_states_in_rows(model, state):
    x, u = state
    many = np.stack([x, 2 * x])
    assert np.array_equal(model.x_dot(many, u)[0], model.x_dot(x, u))
    A, B = model.x_dot_derivatives(x, np.stack([u, 3 * u]))
    assert np.array_equal(A[1], model.x_dot_derivatives(x, 3 * u)[0])
    assert B.shape == (2, model.nq + model.nv, len(u))


def test_what_is_no_state():
    model = zoo.model("m1_n3")
    sound = np.r_[np.zeros(3), 1.0, np.zeros(13)]
    for x, words in (
        (sound[1:], r"x has shape \(16,\).*17.*\(9\).*\(8\)"),
        (np.float64(1), r"x has shape \(\)"),
        (sound * np.nan, r"x\[0\]: value nan"),
        (0 * sound, "quaternion"),
    ):
        for method in (model.x_dot, model.x_dot_derivatives):
            with pytest.raises(st.StateError, match=words):
                method(x, np.zeros(2))
