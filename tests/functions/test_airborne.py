"""Rates of airborne states are those of the full animal; their derivatives are those of a complex
step.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import block_diag

from serpentail import StateError
from serpentail.basics.attitude import quaternion_rate
from serpentail_codegen.ir.interpret import Run
from tests.references.air import attitude
from tests.references.metrics import block_error, equilibrated_condition
from tests.support import zoo
from tests.support.derivative_models import COMPLEX, STEP, nest_of, of_every_kind, parameters_of
from tests.support.rows import row

from .compared import model_of

QUICK = ["m1_n3", "loops", "arcs2_loops", "elastic", "mixed", "air"]
SLOW = ["m3_n4", "straight", "arcs3", "own_links", "own_arcs", "elastic_arcs", "weightless"]
SLOW += ["limbs", "tree"]
ROUNDING = 2e-13  # of a derivative, relative to its row; for each unit of the condition number
every_model = pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)]
)


def calls(model):
    """Names, full states and arguments of calls: B at the origin, without air also at rest, and
    weights of the order of one over each rate's size.
    """
    nt, air = model.nv - 6, drift_of(model)
    sizes = np.repeat([1, 10, 500, 50, 500, 20], [4, nt, nt, air // 2, air // 2, 3])
    for name, state in of_every_kind(model):
        q, v = state["q"].copy(), state["v"].copy()
        q[:3], v[:3] = 0, v[:3] * bool(air)
        x = [q[3:], v[6:]]
        if air:
            x += [attitude(q[3:7]).T @ (v[:3] - model.parameters["wind"]), v[3:6]]
        given = {"x": np.concatenate(x), "tau": state["tau"]}
        given["angular"] = model.momentum(q, v)[1]
        weights = np.random.default_rng(41).normal(size=len(sizes)) / sizes
        yield name, (q, v, state["tau"]), given | {"weights": weights}


def drift_of(model):
    """How many numbers x has of the torso's velocities."""
    return 6 if "air_density" in model.parameters else 0


def all_three(model, arguments):
    """The outputs of all three functions: y; y, J; y, J, H."""
    rates = [arguments[name] for name in ("x", "tau", "angular")]
    y = model.airborne_rates(*rates)
    J = model.airborne_rates_derivatives(*rates)
    return (y,), J, model.airborne_rates_hessian(*rates, arguments["weights"])


def blocks(*sizes):
    """Slices of a vector with one unit each."""
    return [slice(a, b) for a, b in pairwise(np.cumsum([0, *sizes]))]


def worst(found, expected, rows, columns):
    """Largest error over blocks, relative to the block's largest entry."""
    errors = [0.0]
    for r in rows:
        floor = 1e-9 * np.abs(expected[r]).max()
        for c in columns:
            scale = max(np.abs(expected[r, c]).max(), floor)
            errors.append(np.abs(found[r, c] - expected[r, c]).max() / scale if scale else 0.0)
    return max(errors)


def along(model, name, arguments, ways):
    """Complex steps along columns of x and tau: output -> (length, directions)."""
    nest, nx = nest_of(model, name), len(arguments["x"])
    steps = {"x": ways[:nx], "tau": ways[nx:]}
    scalars = {}
    for array in (*nest.of_role("parameters"), *nest.of_role("input")):
        values = {**parameters_of(model), **arguments}[array.name]
        step = steps.get(array.name, np.zeros((len(values), ways.shape[1])))
        scalars[array.name] = list(np.asarray(values)[:, None] + 1j * STEP * step)
    # every direction is a run of its own: wide arrays have lanes of their own
    found = {a.name: np.zeros((a.length, ways.shape[1])) for a in nest.of_role("output")}
    for k in range(ways.shape[1]):
        run = Run(nest, COMPLEX, {n: [s[k] for s in rows] for n, rows in scalars.items()})
        for output, values in found.items():
            values[:, k] = np.array([np.imag(s) for s in run.values[output]]) / STEP
    return found


@every_model
def test_rates_are_those_of_full_dynamics_at_that_momentum(name):
    model, rows = model_of(name), []
    for at, (q, v, tau), arguments in calls(model):
        (y,), (first, J), (second, same, H) = all_three(model, arguments)
        rows.append((arguments, (y, J, H)))
        sizes = [4, len(tau), len(tau), drift_of(model)]
        quaternion, rate, acceleration, drift, omega = np.split(y, np.cumsum(sizes))
        most = equilibrated_condition(model.mass_matrix(q))
        with row(at):
            assert np.abs(omega - v[3:6]).max() <= 2e-14 * most * max(np.abs(v).max(), 1e-300)
            v_dot = model.forward_dynamics(q, v, tau)
            assert block_error(acceleration, v_dot[6:]) <= 1e-13 * most
            if len(drift):  # a vector of the world in axes that turn
                swept = np.cross(v[3:6], arguments["x"][-6:-3])
                own = [attitude(q[3:7]).T @ v_dot[:3] - swept, v_dot[3:6]]
                assert block_error(drift, np.concatenate(own)) <= 1e-13 * most
            np.testing.assert_array_equal(rate, v[6:])
            turning = np.array(quaternion_rate(q[3:7], omega))
            np.testing.assert_allclose(quaternion, turning, atol=1e-15 * np.abs(turning).max())
            for found, values in ((first, y), (second, y), (same, J)):
                scale = np.abs(values).max(axis=-1, keepdims=True)
                assert (np.abs(found - values) <= 1e-11 * scale + 1e-300).all()
    stack = {key: np.array([arguments[key] for arguments, _ in rows]) for key in arguments}
    for found, alone in zip(
        all_three(model, stack)[2], zip(*(each for _, each in rows), strict=True), strict=True
    ):
        assert np.abs(found - np.array(alone)).max() <= 1e-11 * np.abs(alone).max()


@every_model
def test_derivatives_are_those_of_a_complex_step(name):
    """Along a random direction in each block of x and tau."""
    model, rng = model_of(name), np.random.default_rng(42)
    nt, air = model.nv - 6, [3] * (drift_of(model) // 3)
    by, of = blocks(4, nt, nt, *air, nt), blocks(4, nt, nt, *air, 3)
    each = blocks(*np.ones(len(by), int))
    for at, (q, _, _), arguments in [*calls(model)][::2]:
        y, J, H = all_three(model, arguments)[2]
        limit = ROUNDING * equilibrated_condition(model.mass_matrix(q))
        ways = block_diag(*(rng.normal(size=(b.stop - b.start, 1)) for b in by))
        steps = along(model, "airborne_rates_derivatives", arguments, ways)["J"]
        expected = np.einsum("r,rck->ck", arguments["weights"], steps.reshape(len(y), len(H), -1))
        slopes = along(model, "airborne_rates", arguments, ways)["y"]
        with row(at):
            assert worst(J @ ways, slopes, of, each) <= limit
            assert worst(H @ ways, expected, by, each) <= limit
            np.testing.assert_array_equal(H, H.T)
            # torques enter with coordinates alone
            assert not np.delete(H[-nt:], np.r_[4 : 4 + nt], axis=1).any()
            twice = all_three(model, arguments | {"weights": 2 * arguments["weights"]})[2][2]
            np.testing.assert_array_equal(twice, 2 * H)


def one_call(model):
    """Arguments of one call, free to be changed."""
    return next({key: x.copy() for key, x in given.items()} for _, _, given in calls(model))


def test_attitudes_that_do_not_matter():
    """The norm of a quaternion is a factor of its rate alone; a turn of state and momentum changes
    nothing in torso axes.
    """
    model = zoo.model("loops")
    arguments = one_call(model)
    w, x, y, z = arguments["x"][:4]
    a, b, c = arguments["angular"]
    expected = all_three(model, arguments)[0][0]
    arguments["x"][:4] *= -3.7
    found = all_three(model, arguments)[0][0]
    np.testing.assert_allclose(found[:4], -3.7 * expected[:4], rtol=1e-13)
    np.testing.assert_allclose(found[4:], expected[4:], rtol=1e-12)
    arguments["x"][:4] = np.sqrt(0.5) * np.array([w - x, x + w, y - z, z + y])  # about x
    arguments["angular"] = np.array([a, -c, b])
    found = all_three(model, arguments)[0][0]
    np.testing.assert_allclose(found[4:], expected[4:], rtol=1e-11, atol=1e-12)


def test_wrong_states_are_refused():
    model = zoo.model("loops")
    for value in (np.nan, np.inf):
        for name in ("x", "tau", "angular", "weights"):
            arguments = one_call(model)
            arguments[name][-1] = value
            with row(name, value), pytest.raises(StateError, match=f"hessian: {name}"):
                model.airborne_rates_hessian(*arguments.values())
    for scale in (0.0, 1e-200, 1e200):
        arguments = one_call(model)
        arguments["x"][:4] *= scale
        with row(scale), pytest.raises(StateError, match="quaternion"):
            all_three(model, arguments)
    arcs = zoo.model("arcs2_loops")
    arguments = one_call(arcs)
    arguments["x"][6:8] = 6, 6
    with pytest.raises(StateError, match=r"segment 2 .*8\.48528"):
        all_three(arcs, arguments)
