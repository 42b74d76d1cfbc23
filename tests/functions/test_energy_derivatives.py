"""Derivatives of energy and momentum obey mechanics."""

import numpy as np

from tests.support.derivative_models import tangent_of_q

from .compared import ROUNDING, called, limit

# Energy and momentum


def test_momenta_are_the_gradient_of_kinetic_energy(model, some_states):
    for state in some_states:
        H, found = (
            model.mass_matrix(state["q"]),
            called(model, "energy_derivatives", state)["kinetic_dv"],
        )
        assert np.all(
            np.abs(found - H @ state["v"]) <= ROUNDING * (np.abs(H) @ np.abs(state["v"]) + 1e-300)
        )


def test_energy_changes_by_the_power_of_the_torques(model, some_states):
    """The chain rule along a motion: d(energy)/dt = tau^T q_t_dot."""
    for state in some_states:
        gradients, v = called(model, "energy_derivatives", state), state["v"]
        v_dot = model.forward_dynamics(state["q"], v, state["tau"])
        terms = np.concatenate(
            [
                gradients["kinetic_dq"] * v,
                gradients["kinetic_dv"] * v_dot,
                gradients["potential_dq"] * v,
            ]
        )
        power = state["tau"] @ v[6:]
        assert abs(terms.sum() - power) <= limit(model, "forward", state) * (
            np.abs(terms).sum() + 1e-300
        )


def test_forces_follow_from_the_energies_by_lagrange(model, some_states):
    """C = d(H v)/dq v - dT/dq + dU/dq on the tail's coordinates; aq is d(H v)/dq where the
    multiplier is v.
    """
    for state in some_states:
        gradients, v = called(model, "energy_derivatives", state), state["v"]
        aq = called(model, "inverse_dynamics_hessian", state | {"multiplier": v})["aq"]
        terms = np.stack([aq @ v, -gradients["kinetic_dq"], gradients["potential_dq"]])[:, 6:]
        bias = model.inverse_dynamics(state["q"], v, 0 * v)[6:]
        size = np.abs(terms).sum(axis=0) + np.abs(aq[6:]) @ np.abs(v)
        assert np.all(
            np.abs(terms.sum(axis=0) - bias) <= 10 * ROUNDING * (size + np.abs(bias).max())
        )


def test_momentum_is_its_derivative_times_velocity(model, some_states):
    """Momentum is linear in v; the momentum is kept while the tail moves freely and gravity alone
    pulls.
    """
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    for state in some_states:
        q, v = state["q"], state["v"]
        J, (linear, angular) = called(model, "momentum_derivatives", state), model.momentum(q, v)
        v_dot = model.forward_dynamics(q, v, state["tau"])
        pull = [0, 0, -mass * model.parameters["gravity"]]
        for name, value, rate in (("linear", linear, pull), ("angular", angular, np.zeros(3))):
            dq, dv = J[f"{name}_dq"], J[f"{name}_dv"]
            assert np.all(np.abs(dv @ v - value) <= ROUNDING * (np.abs(dv) @ np.abs(v) + 1e-300))
            terms = np.abs(dq) @ np.abs(v) + np.abs(dv) @ np.abs(v_dot)
            error = np.abs(dq @ v + dv @ v_dot - rate)
            assert np.all(error <= limit(model, "forward", state) * terms.max())
        np.testing.assert_allclose(
            J["linear_dv"][:, :3], mass * np.eye(3), rtol=0, atol=1e-14 * mass
        )
        assert np.abs(J["angular_dv"][:, :3]).max() <= 1e-15 * np.abs(J["angular_dv"]).max()


def test_tangents_of_q_follow_the_exponential_map():
    """The reference's own convention: a small turn e_k about body axes, R(q + T e_k s) = R(q) (1 +
    s e_k~).
    """
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(8)
    q = np.concatenate([rng.uniform(-1, 1, 3), 2.5 * rng.normal(size=4), rng.uniform(-1, 1, 2)])
    T, s = tangent_of_q(q), 1e-7
    for k in range(3):
        turned = Rotation.from_quat(q[3:7], scalar_first=True) * Rotation.from_rotvec(
            s * np.eye(3)[k]
        )
        moved = Rotation.from_quat((q + s * T[:, 3 + k])[3:7], scalar_first=True)
        assert (moved.inv() * turned).magnitude() <= 1e-13
