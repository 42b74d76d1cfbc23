"""Derivatives of compiled models are those of their functions, found by a complex step, and obey
mechanics.
"""

from functools import cache

import casadi as ca
import numpy as np
import pytest

from serpentail_scene.signatures.table import DERIVATIVES
from tests.references.metrics import block_error
from tests.support.derivative_models import (
    FIRST,
    NEGLIGIBLE,
    complex_step,
    jacobian_error,
    of_every_kind,
    parameter_scales,
    tangent_of_q,
)
from tests.support.rows import row

from .compared import ROUNDING, called, limit, marked, model_of

PASSIVE = ["elastic", "elastic_arcs", "air", "air_mixed"]
FIXED = ["air_fixed", "fixed", "fixed_arcs", "fixed_mixed"]
every_model = pytest.mark.parametrize(
    "name", marked([*PASSIVE, *FIXED], quick=["mixed", "elastic", "fixed_mixed"])
)
free_or_passive = pytest.mark.parametrize("name", marked(PASSIVE, quick=["mixed", "elastic"]))


def test_every_derivative_function_is_compared():
    others = {"inverse_dynamics_vjp", "forward_dynamics_jvp", "forward_dynamics_vjp"}
    assert {*FIRST, *others, "inverse_dynamics_hessian"} == set(DERIVATIVES)


@every_model
def test_first_derivatives_are_those_of_a_complex_step(name):
    model = model_of(name)
    names, singles = zip(*of_every_kind(model), strict=True)
    stack = {argument: np.array([s[argument] for s in singles]) for argument in singles[0]}
    step = cache(lambda function, argument: complex_step(model, function, stack, argument))
    for derivative in FIRST.keys() & model.manifest["functions"].keys():
        function, outputs = FIRST[derivative]
        for k, state in enumerate(singles):
            found = called(model, derivative, state)
            assert set(found) == set(outputs)
            for output, (of, argument) in outputs.items():
                scale = parameter_scales(model) if argument == "parameters" else 1.0
                expected = step(function, argument)[of][k] * scale
                with row(derivative, output, names[k]):
                    error = jacobian_error(found[output] * scale, expected, model.nv)
                    assert error <= limit(model, derivative, state)


@free_or_passive
def test_products_are_those_with_the_jacobians(name):
    """From the left and from the right, by sweeps that never form a Jacobian."""
    model, rng = model_of(name), np.random.default_rng(3)
    for at, state in of_every_kind(model):
        weights, H = state["multiplier"], model.mass_matrix(state["q"])
        for function in ("inverse", "forward"):
            J = called(model, f"{function}_dynamics_derivatives", state) | {"dv_dot": H}
            for output, gradient in called(model, f"{function}_dynamics_vjp", state).items():
                terms = np.abs(weights) @ np.abs(J[output])  # what may cancel
                error = np.abs(gradient - weights @ J[output])
                most = limit(model, function, state) * np.maximum(terms, 1e-4 * terms.max())
                with row(at, function, output):
                    assert np.all(error <= most)
        J = called(model, "forward_dynamics_derivatives", state)
        along = {d: rng.uniform(-1, 1, J[d].shape[1]) for d in J}
        found = called(model, "forward_dynamics_jvp", state | along)["dv_dot"]
        expected = sum(J[d] @ along[d] for d in J)
        with row(at, "from the right"):
            assert block_error(found, expected) <= limit(model, "forward", state)


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


@free_or_passive
def test_hessians_are_casadis(name):
    """By the numbers of the quaternion, brought to turns: the force depends on the direction of the
    quaternion alone, so the second derivative along it, by which the exponential map leaves the
    tangent, is zero.
    """
    model = model_of(name)
    nq, nv = model.nq, model.nv
    q, v, a = (slice(k * nv, (k + 1) * nv) for k in range(3))
    for at, state in of_every_kind(model):
        T = np.zeros((nq + 2 * nv, 3 * nv))
        T[:nq, :nv], T[nq:, nv:] = tangent_of_q(state["q"], nv), np.eye(2 * nv)
        arguments = (state[x] for x in ("q", "v", "v_dot", "multiplier"))
        H = T.T @ np.array(hessian_by_casadi(model)(*arguments)) @ T
        expected = {"qq": H[q, q], "qv": H[q, v], "vv": H[v, v], "aq": H[a, q]}
        assert not H[a, v].any() and not H[a, a].any()  # these blocks are left out: they are zero
        found = called(model, "inverse_dynamics_hessian", state)
        for block in ("qq", "vv"):
            np.testing.assert_array_equal(found[block], found[block].T)
        for block, values in found.items():
            with row(at, block):
                # the position of the torso has none, to the last bit, and without air its velocity
                drifts = "air" in name and block in ("qv", "vv")
                assert drifts or not values[:, :3].any()
                assert (drifts and block == "vv") or block == "aq" or not values[:3].any()
                assert hessian_error(values, expected[block], nv) <= ROUNDING
                if drifts:
                    by_drift = jacobian_error(values[3:, :3], expected[block][3:, :3], 3)
                    assert by_drift <= ROUNDING
                    np.testing.assert_allclose(values[:3, :3], expected[block][:3, :3], atol=1e-14)
        # a turn moves as much force from axis to axis
        scale = np.abs(model.mass_matrix(state["q"])[:3] @ state["multiplier"]).max()
        assert np.abs(found["aq"][:3] - expected["aq"][:3]).max() <= ROUNDING * scale, at


def hessian_error(found, expected, nv):
    """The error over blocks of turns and tail, smaller ones compared with their rows' largest."""
    moving = slice(3, None)
    assert found.shape == expected.shape
    return jacobian_error(found[moving, moving], expected[moving, moving], nv - 3, 1e3 * NEGLIGIBLE)
