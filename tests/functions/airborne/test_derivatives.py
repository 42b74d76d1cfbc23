"""Derivatives of airborne rates are those of a complex step, and of CasADi's operations."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from serpentail_codegen.ir.interpret import Run
from tests.references.metrics import equilibrated_condition
from tests.support.derivative_models import COMPLEX, STEP, nest_of, parameters_of

from .states import airborne_arguments, airborne_model, moving_states, rates

ROUNDING = 2e-13  # of a derivative, relative to its row; for each unit of the condition number


def condition(model, x):
    """Condition number of H at an airborne state."""
    q = np.concatenate([np.zeros(3), x[: 4 + model.nv - 6]])
    return equilibrated_condition(model.mass_matrix(q))


def blocks(tail):
    """Slices of (x, tau) with one unit each."""
    edges = np.cumsum([0, 4, tail, tail, tail])
    return [slice(a, b) for a, b in pairwise(edges)]


def worst(found, expected, rows, columns):
    """Largest error over blocks, relative to the block's largest entry."""
    errors = [0.0]
    for r in rows:
        floor = 1e-9 * np.abs(expected[r]).max()
        for c in columns:
            scale = max(np.abs(expected[r, c]).max(), floor)
            errors.append(np.abs(found[r, c] - expected[r, c]).max() / scale if scale else 0.0)
    return max(errors)


def row_blocks(tail):
    """Slices of y with one unit each."""
    edges = np.cumsum([0, 4, tail, tail, 3])
    return [slice(a, b) for a, b in pairwise(edges)]


def along(model, name, arguments):
    """Complex steps along every number of x and tau: output -> (length, directions)."""
    nest = nest_of(model, name)
    x, tau = arguments["x"], arguments["tau"]
    unit = np.eye(len(x) + len(tau))
    steps = {"x": unit[: len(x)], "tau": unit[len(x) :]}
    scalars = {}
    for array in (*nest.of_role("parameters"), *nest.of_role("input")):
        values = {**parameters_of(model), **arguments}[array.name]
        step = steps.get(array.name, np.zeros((len(values), len(unit))))
        scalars[array.name] = list(np.asarray(values)[:, None] + 1j * STEP * step)
    # every direction is a run of its own: wide arrays have lanes of their own
    found = {a.name: np.zeros((a.length, len(unit))) for a in nest.of_role("output")}
    for k in range(len(unit)):
        run = Run(nest, COMPLEX, {n: [s[k] for s in rows] for n, rows in scalars.items()})
        for output, values in found.items():
            values[:, k] = np.array([np.imag(s) for s in run.values[output]]) / STEP
    return found


def test_jacobians_are_those_of_a_complex_step(model, calls):
    tail = model.nv - 6
    for arguments in calls:
        _, J = model.kernel("airborne_rates_derivatives")(*rates(arguments))
        expected = along(model, "airborne_rates", arguments)["y"]
        limit = ROUNDING * condition(model, arguments["x"])
        assert worst(J, expected, row_blocks(tail), blocks(tail)) <= limit


def test_hessians_are_those_of_a_complex_step_of_jacobians(model, calls):
    tail = model.nv - 6
    for arguments in calls:
        *_, H = model.kernel("airborne_rates_hessian")(*arguments.values())
        J = along(model, "airborne_rates_derivatives", arguments)["J"]
        size = len(H)
        expected = np.einsum("r,rck->ck", arguments["weights"], J.reshape(-1, size, size))
        limit = ROUNDING * condition(model, arguments["x"])
        assert worst(H, expected, blocks(tail), blocks(tail)) <= limit


def test_hessians_are_symmetric_and_linear_in_weights(model, calls):
    for arguments in calls:
        *_, H = model.kernel("airborne_rates_hessian")(*arguments.values())
        np.testing.assert_array_equal(H, H.T)
        *_, twice = model.kernel("airborne_rates_hessian")(
            *rates(arguments), 2 * arguments["weights"]
        )
        np.testing.assert_array_equal(twice, 2 * H)


def test_torques_enter_second_derivatives_with_coordinates_alone(model, calls):
    tail = model.nv - 6
    q = slice(4, 4 + tail)
    for arguments in calls:
        *_, H = model.kernel("airborne_rates_hessian")(*arguments.values())
        rows = np.delete(H[-tail:], np.r_[q], axis=1)
        assert not rows.any()


@cache
def casadi_rates(model):
    """CasADi's y, J and Hessian of mu^T y, of the full animal's symbolic functions."""
    ca = pytest.importorskip("casadi")
    tail = model.nv - 6
    x, tau = ca.SX.sym("x", 4 + 2 * tail), ca.SX.sym("tau", tail)
    h, mu = ca.SX.sym("h", 3), ca.SX.sym("mu", 7 + 2 * tail)
    q = ca.vertcat(ca.SX.zeros(3), x[: 4 + tail])
    omega = ca.SX.sym("omega", 3)

    # B's velocity and omega from the momenta, which are linear in them
    v = ca.vertcat(ca.SX.sym("p_dot", 3), omega, x[4 + tail :])
    linear, angular = model.casadi.momentum(q, v)
    both = ca.vertcat(linear, angular - h)
    A = ca.jacobian(both, v[:6])
    rest = ca.substitute(both, v[:6], ca.SX.zeros(6))
    motion = ca.solve(A, -rest)
    full = ca.vertcat(motion, x[4 + tail :])
    v_dot = model.casadi.forward_dynamics(q, full, tau)
    a, b, c = (motion[3 + k] / 2 for k in range(3))
    w, i, j, k = (x[n] for n in range(4))
    turning = [
        -i * a - j * b - k * c,
        w * a + j * c - k * b,
        w * b + k * a - i * c,
        w * c + i * b - j * a,
    ]
    y = ca.vertcat(*turning, x[4 + tail :], v_dot[6:], motion[3:])
    z = ca.vertcat(x, tau)
    H, _ = ca.hessian(ca.dot(mu, y), z)
    return ca.Function("rates", [x, tau, h, mu], [y, ca.jacobian(y, z), H])


@pytest.mark.parametrize("size", [(1, 3, "straight"), (2, 2, "loops"), (1, None, "loops")])
def test_derivatives_are_those_of_casadi(size):
    model, tail = airborne_model(*size), 2 * size[0]
    for q, v, tau in moving_states(size[0], "scaled", 3):
        arguments = airborne_arguments(q, v, tau, [2e-4, -1e-4, 3e-4])
        expected = [np.array(a) for a in casadi_rates(model)(*arguments.values())]
        found = model.kernel("airborne_rates_hessian")(*arguments.values())
        limit = 10 * ROUNDING * condition(model, arguments["x"])
        np.testing.assert_allclose(found[0], expected[0].ravel(), rtol=1e-10)
        assert worst(found[1], expected[1], row_blocks(tail), blocks(tail)) <= limit
        assert worst(found[2], expected[2], blocks(tail), blocks(tail)) <= limit
