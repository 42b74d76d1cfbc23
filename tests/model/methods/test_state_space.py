"""x_dot: the equations of motion as one first-order system, against turns, other integrators and
CasADi's derivatives.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import serpentail as st
from tests.support.models import model_folder

FUNCTIONS = [
    "forward_dynamics",
    "forward_dynamics_derivatives",
    "rollout",
    "energy",
    "momentum",
]


@pytest.fixture(scope="module", params=[(1, 3), (2, None)], ids=["articulated", "continuum"])
def model(request):
    return st.load(model_folder(*request.param, functions=FUNCTIONS))


@pytest.fixture
def state(model):
    rng = np.random.default_rng(1)
    x = rng.normal(size=model.nq + model.nv)
    x[3:7] /= np.linalg.norm(x[3:7])
    return x, 1e-3 * rng.normal(size=model.layout.nt)


def turned(quaternion, omega, duration):
    """The quaternion (w, x, y, z) after a turn at a rate in its own axes."""
    scalar_last = Rotation.from_quat(np.roll(quaternion, -1)) * Rotation.from_rotvec(
        omega * duration
    )
    after = np.roll(scalar_last.as_quat(), 1)
    return after * np.sign(after @ quaternion)


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


def test_another_integrator_flies_the_same(model, state):
    x, u = state
    x[model.nq :] *= 0.1
    own = st.simulate(model, x[: model.nq], x[model.nq :], t_span=0.2, rtol=1e-11, atol=1e-11)
    other = solve_ivp(
        lambda t, x: model.x_dot(x, 0 * u), (0, 0.2), x, method="DOP853", rtol=1e-11, atol=1e-11
    ).y[:, -1]
    assert np.allclose(other, np.r_[own.q[-1], own.v[-1]], rtol=0, atol=1e-8)


def test_the_norm_returns_to_one(model, state):
    """The square s of the norm follows s_dot = 2 (1 - s) s / s: s / (1 - s) grows as exp(2 t)."""
    x, u = state
    x[3:7] *= 1.1
    x[model.nq :] *= 0.1
    end = solve_ivp(lambda t, x: model.x_dot(x, 0 * u), (0, 0.5), x, rtol=1e-9, atol=1e-9).y[:, -1]
    after, ratio = end[3:7], 1.21 / (1 - 1.21) * np.exp(1)
    assert after @ after == pytest.approx(ratio / (1 + ratio), abs=1e-6)


@pytest.mark.parametrize("norm", [1.0, 0.7])
def test_derivatives_are_casadis(model, state, norm):
    x, u = state
    x[3:7] *= norm
    p, names = model.casadi.parameter_vector, ["x", "u", "p"]
    f = model.casadi.x_dot
    jacobian = f.factory("J", names, ["jac:x_dot:x", "jac:x_dot:u"])
    assert np.allclose(f(x, u, p).full()[:, 0], model.x_dot(x, u), rtol=1e-11, atol=1e-9)
    for own, other in zip(model.x_dot_derivatives(x, u), jacobian(x, u, p), strict=True):
        assert np.abs(own - other.full()).max() < 1e-12 * np.abs(own).max()


def test_the_compiled_one_is_the_same(model, state):
    x, u = state
    f = model.casadi.external("x_dot", derivatives=1)
    folded = model.casadi.external("x_dot", derivatives=1, folded=True)
    p = model.casadi.parameter_vector
    assert (f.name_in(), folded.name_in()) == (["x", "u", "p"], ["x", "u"])
    for found in (f(x, u, p), folded(x, u)):
        assert np.allclose(found.full()[:, 0], model.x_dot(x, u), rtol=1e-13, atol=1e-13)
    jacobian = folded.factory("J", ["x", "u"], ["jac:x_dot:x"])(x, u).full()
    assert np.allclose(jacobian, model.x_dot_derivatives(x, u)[0], rtol=1e-11, atol=1e-11)


def test_states_in_rows(model, state):
    x, u = state
    many = np.stack([x, 2 * x])
    assert np.array_equal(model.x_dot(many, u)[0], model.x_dot(x, u))
    A, B = model.x_dot_derivatives(x, np.stack([u, 3 * u]))
    assert np.array_equal(A[1], model.x_dot_derivatives(x, 3 * u)[0])
    assert B.shape == (2, model.nq + model.nv, len(u))


@pytest.mark.parametrize(
    ("x", "words"),
    [
        (lambda x: x[1:], r"x has shape \(\d+,\): needs \d+ numbers, q \(\d+\) and v"),
        (lambda x: np.float64(1), r"x has shape \(\)"),
        (lambda x: x * np.nan, r"x\[0\]: value nan"),
        (lambda x: np.where(np.isin(np.arange(len(x)), range(3, 7)), 0, x), "quaternion"),
    ],
)
def test_what_is_no_state(model, state, x, words):
    with pytest.raises(st.StateError, match=words):
        model.x_dot(x(state[0]), state[1])
