"""Derivatives of compiled models are those that CasADi and Pinocchio find by algorithms of their
own.
"""

from functools import cache

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from tests.references.metrics import equilibrated_condition
from tests.references.parameters import TABLE_1
from tests.references.pinocchio_chain import PinocchioChain
from tests.support.derivative_models import (
    KINDS,
    NEGLIGIBLE,
    derivative_model,
    jacobian_error,
    spans,
    states,
    tangent_of_q,
)

from .compared import PARAMS, ROUNDING, SOLVED, called

SMALL = [
    (1, 3, "straight"),
    (1, None, "loops"),
]  # the Jacobian of the whole forward dynamics is long


@pytest.fixture(scope="module", params=SMALL, ids=["m1_n3", "arcs1"])
def small_model(request):
    """A model whose forward dynamics CasADi differentiates in short."""
    return derivative_model(*request.param)


def skew(v):
    """v~, so that v~ x = v x x."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


# CasADi: automatic differentiation of its expressions for the values


@cache
def by_casadi(model, function, third):
    """A function of (q, v, third) to Jacobians of a value function with respect to all three."""
    arguments = [
        ca.SX.sym("q", model.nq),
        ca.SX.sym("v", model.nv),
        ca.SX.sym(third, model.nv - 6 * (third == "tau")),
    ]
    out = model.casadi.symbolic(function)(*arguments, model.casadi.parameter_vector)
    return ca.Function("jacobians", arguments, [ca.jacobian(out, x) for x in arguments])


@cache
def hessian_by_casadi(model):
    """A function of (q, v, v_dot, multiplier) to the Hessian of multiplier^T (H v_dot + C) over all
    but the last.
    """
    sizes = {"q": model.nq, "v": model.nv, "v_dot": model.nv, "multiplier": model.nv}
    q, v, v_dot, multiplier = arguments = [ca.SX.sym(name, size) for name, size in sizes.items()]
    out = model.casadi.symbolic("inverse_dynamics")(q, v, v_dot, model.casadi.parameter_vector)
    x = ca.vertcat(q, v, v_dot)
    gradient = ca.jtimes(out, x, multiplier, True)
    return ca.Function("hessian", arguments, [ca.jacobian(gradient, x)])


@pytest.mark.parametrize("kind", KINDS)
def test_inverse_dynamics_derivatives_are_casadis(model, kind):
    for state in states(model, kind):
        q, v, _ = by_casadi(model, "inverse_dynamics", "v_dot")(
            state["q"], state["v"], state["v_dot"]
        )
        found = called(model, "inverse_dynamics_derivatives", state)
        assert (
            jacobian_error(found["dq"], np.array(q) @ tangent_of_q(state["q"]), model.nv)
            <= ROUNDING
        )
        assert jacobian_error(found["dv"], np.array(v), model.nv) <= ROUNDING


@pytest.mark.parametrize("kind", KINDS)
def test_forward_dynamics_derivatives_are_casadis(small_model, kind):
    model = small_model
    for state in states(model, kind):
        q, v, tau = by_casadi(model, "forward_dynamics", "tau")(
            state["q"], state["v"], state["tau"]
        )
        expected = {
            "dq": np.array(q) @ tangent_of_q(state["q"]),
            "dv": np.array(v),
            "dtau": np.array(tau),
        }
        limit = SOLVED * equilibrated_condition(model.mass_matrix(state["q"]))
        for name, found in called(model, "forward_dynamics_derivatives", state).items():
            assert jacobian_error(found, expected[name], model.nv) <= limit, name


def hessian_error(found, expected, nv):
    """Largest over blocks of turns and tail of max|d| / max|ref|; a small block is compared with
    its rows' largest.
    """
    assert found.shape == expected.shape
    worst = 0.0
    for rows in spans(nv, nv)[1:]:
        floor = 1e3 * NEGLIGIBLE * np.max(np.abs(expected[rows]), initial=0) or 1.0
        for columns in spans(nv, nv)[1:]:
            one, other = found[rows, columns], expected[rows, columns]
            worst = max(worst, np.max(np.abs(one - other)) / max(np.max(np.abs(other)), floor))
    return worst


@pytest.mark.parametrize("kind", KINDS)
def test_hessians_are_casadis(model, kind):
    """By the numbers of the quaternion, brought to turns: the force depends on the direction of the
    quaternion alone, so the second derivative along it, by which the exponential map leaves the
    tangent, is zero.
    """
    nq, nv = model.nq, model.nv
    for state in states(model, kind):
        T = np.zeros((nq + 2 * nv, 3 * nv))
        T[:nq, :nv], T[nq:, nv:] = tangent_of_q(state["q"]), np.eye(2 * nv)
        H = (
            T.T
            @ np.array(
                hessian_by_casadi(model)(*(state[x] for x in ("q", "v", "v_dot", "multiplier")))
            )
            @ T
        )
        q, v, a = (slice(k * nv, (k + 1) * nv) for k in range(3))
        expected = {"qq": H[q, q], "qv": H[q, v], "vv": H[v, v], "aq": H[a, q]}
        for name, found in called(model, "inverse_dynamics_hessian", state).items():
            error = hessian_error(found, expected[name], nv)
            assert error <= ROUNDING, (name, error)
            np.testing.assert_array_equal(found[:, :3] == 0, np.ones((nv, 3), bool))
        assert not H[a, v].any() and not H[a, a].any()  # these blocks are left out: they are zero
        found, force = (
            called(model, "inverse_dynamics_hessian", state)["aq"][:3],
            model.mass_matrix(state["q"])[:3],
        )
        scale = np.abs(
            force @ state["multiplier"]
        ).max()  # a turn moves as much force from axis to axis
        assert np.abs(found - expected["aq"][:3]).max() <= ROUNDING * scale


# Pinocchio: analytic derivatives of the chain of revolutes, reduced


@cache
def chain(segments, links):
    """Pinocchio's chain."""
    return PinocchioChain(TABLE_1, segments, links)


def jacobians_by_pinocchio(chain, q, v, v_dot):
    """dq, dv of H v_dot + C = T^T rnea(Q, V, A), V = T v, A = T v_dot + T_dot v, T = diag(R^T, 1,
    G).

    Pinocchio moves Q with velocities of the torso in body axes, as T takes ours.  T turns with the
    torso: along a turn w, d(R^T x) = R^T x x w and d(R f) = R (w x f).
    """
    Q, T = chain._full_configuration(q)
    V, A, omega = T @ v, T @ v_dot, v[3:6]
    p_ddot = A[:3].copy()
    A[:3] -= np.cross(omega, V[:3])
    by_Q, by_V, by_A = (
        np.array(x) for x in pin.computeRNEADerivatives(chain.model, chain.data, Q, V, A)
    )
    by_A = np.triu(by_A) + np.triu(by_A, 1).T
    V_q, A_q, A_v = np.zeros_like(T), np.zeros_like(T), np.zeros_like(T)
    V_q[:3, 3:6] = skew(V[:3])
    A_q[:3, 3:6] = skew(p_ddot) - skew(omega) @ skew(V[:3])
    A_v[:3, :3], A_v[:3, 3:6] = -skew(omega) @ T[:3, :3], skew(V[:3])
    dq = T.T @ (by_Q @ T + by_V @ V_q + by_A @ A_q)
    dq[:3, 3:6] -= T[:3, :3].T @ skew(np.array(chain.data.tau)[:3])
    return dq, T.T @ (by_V @ T + by_A @ A_v)


def assert_pinocchios(found, expected, nv, limit):
    """Compare Jacobians where ours are not zero to the last bit: there, Pinocchio's sums leave
    rounding.
    """
    assert np.abs(np.where(found == 0, expected, 0)).max() <= limit * np.abs(expected).max()
    error = jacobian_error(found, np.where(found == 0, 0, expected), nv, negligible=1e-2)
    assert error <= limit, error


CHAINS = [param for param in PARAMS if param.values[0][1]]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", CHAINS)
def test_inverse_dynamics_derivatives_are_pinocchios(size, kind):
    model = derivative_model(*size)
    for state in states(model, kind):
        dq, dv = jacobians_by_pinocchio(chain(*size[:2]), state["q"], state["v"], state["v_dot"])
        found = called(model, "inverse_dynamics_derivatives", state)
        assert_pinocchios(found["dq"], dq, model.nv, 10 * ROUNDING)
        assert_pinocchios(found["dv"], dv, model.nv, 10 * ROUNDING)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", CHAINS)
def test_forward_dynamics_derivatives_are_pinocchios(size, kind):
    """-H^-1 d(H v_dot + C), all of it by Pinocchio, v_dot too."""
    model, peer = derivative_model(*size), chain(*size[:2])
    for state in states(model, kind):
        H, v_dot = (
            peer.mass_matrix(state["q"]),
            peer.forward_dynamics(state["q"], state["v"], state["tau"]),
        )
        found = called(model, "forward_dynamics_derivatives", state)
        limit = SOLVED * equilibrated_condition(H)
        for name, inverse in zip(
            ("dq", "dv"), jacobians_by_pinocchio(peer, state["q"], state["v"], v_dot), strict=True
        ):
            assert_pinocchios(found[name], -np.linalg.solve(H, inverse), model.nv, 10 * limit)


@pytest.mark.parametrize("kind", KINDS)
def test_forward_dynamics_derivatives_are_those_of_pinocchios_articulated_bodies(kind):
    """With one link a segment the chain needs no reduction: computeABADerivatives gives the
    Jacobians at once.
    """
    names = ("forward_dynamics_derivatives", "mass_matrix")
    model, peer = derivative_model(2, 1, "loops", functions=names), chain(2, 1)
    for state in states(model, kind):
        Q, T = peer._full_configuration(state["q"])
        V, omega = T @ state["v"], state["v"][3:6]
        tau = np.concatenate([np.zeros(6), state["tau"]])
        by_Q, by_V, by_tau = (
            np.array(x) for x in pin.computeABADerivatives(peer.model, peer.data, Q, V, tau)
        )
        by_tau = np.triu(by_tau) + np.triu(by_tau, 1).T
        A, V_q, turning = np.array(peer.data.ddq), np.zeros_like(T), np.zeros_like(T)
        V_q[:3, 3:6] = skew(V[:3])
        # v_dot = T^-1 (A + [omega x V; 0])
        turning[:3, :3] = skew(omega)
        of_omega = np.zeros_like(T)
        of_omega[:3, 3:6] = -skew(V[:3])
        acceleration = A[:3] + np.cross(omega, V[:3])
        dq = T.T @ (by_Q @ T + by_V @ V_q + turning @ V_q)
        dq[:3, 3:6] -= T[:3, :3].T @ skew(acceleration)
        expected = {
            "dq": dq,
            "dv": T.T @ (by_V @ T + turning @ T + of_omega),
            "dtau": (T.T @ by_tau)[:, 6:],
        }
        limit = SOLVED * equilibrated_condition(model.mass_matrix(state["q"]))
        for name, found in called(model, "forward_dynamics_derivatives", state).items():
            assert_pinocchios(found, expected[name], model.nv, 10 * limit)
