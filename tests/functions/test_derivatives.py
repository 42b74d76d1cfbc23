"""Derivatives of compiled models are those of their functions, found by a complex step, and obey
mechanics.
"""

import inspect
from functools import cache

import numpy as np
import pytest

from serpentail_codegen.scene.scene import DERIVATIVES
from tests.references.metrics import block_error, equilibrated_condition
from tests.support.derivative_models import (
    FIRST,
    KINDS,
    complex_step,
    derivative_model,
    jacobian_error,
    parameter_scales,
    states,
    tail_name,
    tangent_of_q,
)

QUICK = [(1, 3, "straight"), (2, 2, "loops"), (2, None, "loops")]
SLOW = [(1, 3, "loops"), (2, 2, "straight"), (3, 4, "straight"), (3, 4, "loops")]
SLOW += [(6, 6, "loops"), (8, 16, "loops")]
SLOW += [(1, None, "straight"), (1, None, "loops"), (2, None, "straight"), (3, None, "loops")]
ROUNDING = 1e-12  # largest error of a block, relative
SOLVED = 1e-13  # the same for each unit of the condition number, where H is solved with


PARAMS = [
    pytest.param(size, marks=marks, id=tail_name(size))
    for sizes, marks in [(QUICK, []), (SLOW, [pytest.mark.slow])]
    for size in sizes
]


@pytest.fixture(scope="module", params=PARAMS)
def model(request):
    """A compiled model with all derivatives."""
    return derivative_model(*request.param)


@pytest.fixture(params=KINDS)
def some_states(request, model):
    """Two states of one kind."""
    return states(model, request.param)


def called(model, name, state):
    """The outputs of a function at a state, by name."""
    function = getattr(model, name)
    found = function(*(state[argument] for argument in inspect.signature(function).parameters))
    names = [a["name"] for a in model.manifest["functions"][name]["outputs"]]
    return dict(zip(names, found if len(names) > 1 else (found,), strict=True))


def limit(model, name, state):
    """Largest error of a block: rounding, and what solving with H makes of it."""
    return (
        SOLVED * equilibrated_condition(model.mass_matrix(state["q"]))
        if "forward" in name
        else ROUNDING
    )


def test_every_derivative_function_is_compared():
    others = {
        "inverse_dynamics_vjp",
        "forward_dynamics_jvp",
        "forward_dynamics_vjp",
        "inverse_dynamics_hessian",
    }
    assert {*FIRST, *others} == set(DERIVATIVES)


@pytest.mark.parametrize("name", FIRST)
def test_first_derivatives_are_those_of_a_complex_step(model, some_states, name):
    function, outputs = FIRST[name]
    for state in some_states:
        found = called(model, name, state)
        assert set(found) == set(outputs)
        step = cache(lambda argument, state=state: complex_step(model, function, state, argument))
        for output, (of, argument) in outputs.items():
            scale = parameter_scales(model) if argument == "parameters" else 1.0
            error = jacobian_error(found[output] * scale, step(argument)[of] * scale, model.nv)
            assert error <= limit(model, name, state), (output, error)


# Inverse and forward dynamics


def test_derivatives_with_respect_to_torques_are_columns_of_the_inverse_inertia(model, some_states):
    for state in some_states:
        H, (*_, dtau) = (
            model.mass_matrix(state["q"]),
            called(model, "forward_dynamics_derivatives", state).values(),
        )
        scale = np.sqrt(np.diag(H))
        products = (H @ dtau - np.eye(model.nv)[:, 6:]) / np.outer(scale, 1 / scale[6:])
        assert np.abs(products).max() <= limit(model, "forward", state)


def test_both_dynamics_differ_by_the_inertia(model, some_states):
    """H d(v_dot) = -d(H v_dot + C) at the v_dot of forward dynamics."""
    for state in some_states:
        H, v_dot = (
            model.mass_matrix(state["q"]),
            model.forward_dynamics(*(state[x] for x in ("q", "v", "tau"))),
        )
        inverse = called(model, "inverse_dynamics_derivatives", state | {"v_dot": v_dot})
        forward = called(model, "forward_dynamics_derivatives", state)
        for name in ("dq", "dv"):
            left, size = (
                H @ forward[name] + inverse[name],
                np.abs(H) @ np.abs(forward[name]) + np.abs(inverse[name]),
            )
            assert np.all(
                np.abs(left) <= ROUNDING * np.maximum(size, 1e-6 * size.max(axis=1, keepdims=True))
            ), name


def test_position_and_velocity_of_the_torso_matter_to_nothing_but_its_energy(model, some_states):
    """Every column of the position is zero, to the last bit, and so is the velocity's but in the
    momentum.
    """
    mass = model.parameters["torso_mass"] + model.parameters["tail_mass"]
    for state in some_states:
        for name in FIRST:
            for output, values in called(model, name, state).items():
                if output.endswith("dq") and not output.startswith("potential"):
                    assert not np.any(values[..., :3])
                if output == "dv":
                    assert not np.any(values[..., :3])
        potential = called(model, "energy_derivatives", state)["potential_dq"]
        np.testing.assert_allclose(
            potential[:3], [0, 0, mass * model.parameters["gravity"]], rtol=1e-14, atol=1e-16
        )


def test_a_turn_of_the_world_turns_what_is_given_in_its_axes(model):
    """A state and its turned copy have the same derivatives in torso axes; force and p_ddot turn
    along.
    """
    for state in states(model, "random"):
        half = np.sqrt(0.5)
        w, x, y, z = state["q"][3:7]  # about the vertical, so that gravity stays
        turned = {
            **state,
            "q": np.concatenate(
                [state["q"][:3], half * np.array([w - z, x - y, y + x, z + w]), state["q"][7:]]
            ),
        }
        R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
        for name in ("v", "v_dot"):
            turned[name] = np.concatenate([R @ state[name][:3], state[name][3:]])
        for name in ("inverse_dynamics_derivatives", "forward_dynamics_derivatives"):
            one, other = called(model, name, state), called(model, name, turned)
            for output in one:
                expected = np.concatenate([R @ one[output][:3], one[output][3:]])
                assert jacobian_error(other[output], expected, model.nv) <= limit(
                    model, name, state
                )


# Products with Jacobians


def test_products_from_the_left_are_products_with_the_jacobians(model, some_states):
    for state in some_states:
        weights, H = state["multiplier"], model.mass_matrix(state["q"])
        for function in ("inverse", "forward"):
            J = called(model, f"{function}_dynamics_derivatives", state) | {"dv_dot": H}
            for output, gradient in called(model, f"{function}_dynamics_vjp", state).items():
                terms = np.abs(weights) @ np.abs(J[output])  # what may cancel
                error = np.abs(gradient - weights @ J[output])
                assert np.all(
                    error <= limit(model, function, state) * np.maximum(terms, 1e-4 * terms.max())
                ), output


def test_the_gradient_along_accelerations_is_inertia_times_multiplier(model, some_states):
    for state in some_states:
        H = model.mass_matrix(state["q"])
        gradient = called(model, "inverse_dynamics_vjp", state)["dv_dot"]
        assert block_error(gradient, H @ state["multiplier"]) <= ROUNDING


def test_products_from_the_right_are_products_with_the_jacobians(model, some_states):
    rng = np.random.default_rng(3)
    for state in some_states:
        directions = {name: rng.uniform(-1, 1, len(state[name])) for name in ("v", "tau")} | {
            "q": rng.uniform(-1, 1, model.nv)
        }
        J = called(model, "forward_dynamics_derivatives", state)
        arguments = {f"d{name}": direction for name, direction in directions.items()}
        found = called(model, "forward_dynamics_jvp", state | arguments)["dv_dot"]
        expected = sum(J[name] @ arguments[name] for name in J)
        assert block_error(found, expected) <= limit(model, "forward", state)


def test_both_products_pair_to_the_same_number(model, some_states):
    """lambda^T (J d) = (J^T lambda)^T d, by the two sweeps that never form J."""
    rng = np.random.default_rng(4)
    for state in some_states:
        directions = {
            "dq": rng.uniform(-1, 1, model.nv),
            "dv": rng.uniform(-1, 1, model.nv),
            "dtau": 1e-3 * rng.uniform(-1, 1, model.nv - 6),
        }
        forward = (
            state["multiplier"]
            * called(model, "forward_dynamics_jvp", state | directions)["dv_dot"]
        )
        back = called(model, "forward_dynamics_vjp", state)
        terms = np.concatenate([back[name] * directions[name] for name in directions])
        assert abs(forward.sum() - terms.sum()) <= limit(model, "forward", state) * (
            np.abs(forward).sum() + np.abs(terms).sum()
        )


# Second derivatives


def test_hessians_are_symmetric(model, some_states):
    for state in some_states:
        blocks = called(model, "inverse_dynamics_hessian", state)
        for name in ("qq", "vv"):
            np.testing.assert_array_equal(blocks[name], blocks[name].T)
        assert not any(
            np.any(block[:, :3]) or (name != "aq" and np.any(block[:3]))
            for name, block in blocks.items()
        )


def test_hessians_are_linear_in_multipliers_and_affine_in_accelerations(model):
    for state in states(model, "random"):
        other = {"multiplier": state["multiplier"][::-1].copy()}
        sum_ = {"multiplier": state["multiplier"] + other["multiplier"]}
        one, two, both = (
            called(model, "inverse_dynamics_hessian", state | change)
            for change in ({}, other, sum_)
        )
        for (
            name,
            block,
        ) in both.items():  # in "aq", the mass of the whole animal cancels in its turns
            limit = 10 * ROUNDING if name == "aq" else ROUNDING
            assert jacobian_error(block, one[name] + two[name], model.nv) <= limit
        at_rest = called(model, "inverse_dynamics_hessian", state | {"v_dot": 0 * state["v_dot"]})
        for name in ("qv", "vv", "aq"):  # C alone has velocities
            assert jacobian_error(at_rest[name], one[name], model.nv) <= ROUNDING


def test_hessians_contracted_with_velocities(model, some_states):
    """C is quadratic in v but for gravity, and H v_dot linear in v_dot: so Euler's theorem on
    homogeneous functions.
    """
    for state in some_states:
        blocks, J = (
            called(model, "inverse_dynamics_hessian", state),
            called(model, "inverse_dynamics_derivatives", state),
        )
        still = state | {"v": 0 * state["v"]}
        moving, at_rest = (
            state["multiplier"] @ J["dq"],
            state["multiplier"] @ called(model, "inverse_dynamics_derivatives", still)["dq"],
        )
        scale = np.abs(state["multiplier"]) @ np.abs(J["dq"]) + 1e-3 * np.abs(moving).max()
        assert np.all(
            np.abs(blocks["qv"] @ state["v"] - 2 * (moving - at_rest)) <= 10 * ROUNDING * scale
        )
        by_v = np.abs(state["multiplier"]) @ np.abs(J["dv"]) + 1e-12
        assert np.all(
            np.abs(blocks["vv"] @ state["v"] - state["multiplier"] @ J["dv"])
            <= 10 * ROUNDING * by_v
        )
        weightless = called(
            model.with_parameters(gravity=0.0), "inverse_dynamics_derivatives", still
        )["dq"]
        inertial = np.abs(state["multiplier"]) @ np.abs(weightless)
        error = np.abs(state["v_dot"] @ blocks["aq"] - state["multiplier"] @ weightless)
        assert np.all(error <= 10 * ROUNDING * np.maximum(inertial, 1e-6 * inertial.max()))


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
