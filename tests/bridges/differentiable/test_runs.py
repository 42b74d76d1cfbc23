"""Ends of runs in JAX and PyTorch: their gradients against differences of runs at 1e-12."""

import numpy as np
import pytest

import serpentail as st
from tests.bridges.differentiable.test_functions import TOOLS
from tests.simulation.test_gradients import DAMPED, EXACT, HELD, SPAN, dropped, rat, slope
from tests.support.rows import row


def held(x):
    return st.Legs.fixed(*x)


def starts():
    """q0 whose quaternion is of no norm 1, v0, a parameter, numbers of the legs."""
    q, v = dropped()
    q[3:7] *= 1.3
    return [q, v, np.array(rat().parameters["torso_mass"]), HELD]


def total(functions, q, v, mass, x, **settings):
    settings = {"controller": DAMPED, "legs": (held, x), "rtol": 1e-6} | settings
    q, v = functions.simulate(q, v, SPAN, parameters={"torso_mass": mass}, **settings)
    return v[3] + 3 * q[2] + q[4]


@pytest.mark.parametrize("name", TOOLS)
def test_gradients_of_ends(name):
    tool = TOOLS[name]()
    functions, given = tool.functions(rat()), starts()
    found = tool.jacobians(lambda *arrays: total(functions, *arrays), given)
    for k, at in enumerate(given):
        way = np.random.default_rng(k).normal(size=at.shape) * np.maximum(1e-3, abs(at))

        def moved(e, k=k, way=way):
            values = [x + e * way if i == k else x for i, x in enumerate(given)]
            return float(total(functions, *tool.arrays(values), **EXACT))

        with row(k):
            ours = np.vdot(np.asarray(found[k]), way)
            np.testing.assert_allclose(ours, slope(moved, 2e-4), rtol=2e-4)


@pytest.mark.parametrize("name", TOOLS)
def test_where_a_point_grazes_gradients_are_nan(name):
    tool = TOOLS[name]()
    functions, (q, v, *_) = tool.functions(rat()), starts()

    def ended(q, **settings):
        how = {"legs": held(HELD), "rtol": 1e-4, "output_step": 3.02e-4} | settings
        return functions.simulate(q, v, 3.02e-4, **how)[1][2]

    v = tool.arrays([v])[0]
    for choice, known in (("nan", False), ("value", True)):
        (found,) = tool.jacobians(lambda q, c=choice: ended(q, on_doubt=c), [q])
        assert np.isfinite(np.asarray(found)).all() == known
    with pytest.raises(st.SimulationError, match=r"^on_doubt: value 'zero'"):
        ended(*tool.arrays([q]), on_doubt="zero")
    with pytest.raises(st.StateError, match=r"^simulate: q0 has shape \(2, 9\)"):
        ended(*tool.arrays([np.stack([q, q])]))
    with pytest.raises(Exception, match="rk4 has no setting 'rtol'"):
        ended(*tool.arrays([q]), method="rk4")


def test_runs_under_transformations_of_jax():
    tool = TOOLS["jax"]()
    functions, (q, v, mass, x) = tool.functions(rat()), starts()
    slope_of = tool.jax.grad(lambda v: total(functions, q, v, mass, x))
    rows = np.stack([v, 1.1 * v])
    together = tool.jax.jit(tool.map(slope_of))(rows)
    np.testing.assert_allclose(together, [slope_of(row) for row in rows], rtol=1e-12)
