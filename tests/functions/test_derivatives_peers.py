"""Derivatives of compiled models are those that Pinocchio finds by algorithms of its own: analytic
derivatives of the chain of revolutes, reduced.
"""

import numpy as np
import pytest

from tests.references.metrics import equilibrated_condition
from tests.references.parameters import TABLE_1
from tests.support import zoo
from tests.support.derivative_models import jacobian_error, of_every_kind
from tests.support.rows import row

from .compared import ROUNDING, SOLVED, called

pin = pytest.importorskip("pinocchio")
CHAINS = [
    "m1_n3",
    "segments",
    *(pytest.param(n, marks=pytest.mark.slow) for n in ("m3_n4", "lanes")),
]


def chain(model):
    """Pinocchio's chain."""
    from tests.references.pinocchio_chain import PinocchioChain

    return PinocchioChain(TABLE_1, model.segments, model.links)


def skew(v):
    """v~, so that v~ x = v x x."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


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


@pytest.mark.parametrize("name", CHAINS)
def test_derivatives_of_dynamics_are_pinocchios(name):
    """Forward: -H^-1 d(H v_dot + C), all of it by Pinocchio, v_dot too."""
    model = zoo.model(name)
    peer = chain(model)
    for at, state in of_every_kind(model):
        q, v, v_dot, tau = (state[x] for x in ("q", "v", "v_dot", "tau"))
        found = called(model, "inverse_dynamics_derivatives", state)
        for key, expected in zip(
            ("dq", "dv"), jacobians_by_pinocchio(peer, q, v, v_dot), strict=True
        ):
            with row(at, "inverse", key):
                assert_pinocchios(found[key], expected, model.nv, 10 * ROUNDING)
        H = peer.mass_matrix(q)
        by_force = jacobians_by_pinocchio(peer, q, v, peer.forward_dynamics(q, v, tau))
        found = called(model, "forward_dynamics_derivatives", state)
        limit = 10 * SOLVED * equilibrated_condition(H)
        for key, inverse in zip(("dq", "dv"), by_force, strict=True):
            with row(at, "forward", key):
                assert_pinocchios(found[key], -np.linalg.solve(H, inverse), model.nv, limit)
