"""Steps of many flights: each is one of classical Runge-Kutta under its run's own torques and
parameters, in lanes as singly, in place as elsewhere, in any number of threads.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st
from tests.support import zoo

from ...support.rows import row

H = 2e-3  # s
RUNS = 19  # two groups of lanes, and some left over


@pytest.fixture(scope="module")
def tail():
    return zoo.model("m2_n2")


@pytest.fixture(scope="module")
def states():
    """States and torques of runs, all of them different."""
    rng = np.random.default_rng(5)
    q, v = 0.1 * rng.normal(size=(RUNS, 11)), rng.normal(size=(RUNS, 10))
    q[:, 2:4] += 1
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    return q, v, 1e-4 * rng.normal(size=(RUNS, 4))


def rate(model, y, tau):
    """Rate of y = (q, v): the quaternion's is half its product with (0, omega)."""
    q, v = y[: model.nq], y[model.nq :]
    (w, x), omega = (q[3], q[4:7]), v[3:6]
    turn = 0.5 * np.concatenate([[-x @ omega], w * omega + np.cross(x, omega)])
    return np.concatenate([v[:3], turn, v[6:], model.forward_dynamics(q, v, tau)])


def runge_kutta(model, q, v, tau, h):
    """Where one step of the classical method comes to, its quaternion made a unit one."""
    y = np.concatenate([q, v])
    a = rate(model, y, tau)
    b = rate(model, y + h / 2 * a, tau)
    c = rate(model, y + h / 2 * b, tau)
    y = y + h / 6 * (a + 2 * b + 2 * c + rate(model, y + h * c, tau))
    y[3:7] /= np.linalg.norm(y[3:7])
    return y


def assert_near(found, expected, digits=1e-12):
    assert np.max(np.abs(found - expected) / (1 + np.abs(expected))) <= digits


def test_a_step_is_one_of_runge_kutta_under_own_torques(tail, states):
    expected = np.array([runge_kutta(tail, *each, H) for each in zip(*states, strict=True)])
    for runs in (1, 3, 8, 9, RUNS):
        with row(runs):
            found = np.hstack(tail.step(*(array[:runs] for array in states), H))
            assert_near(found, expected[:runs])


def test_many_short_steps_are_the_motion(tail, states):
    """Against SciPy's order 8, which knows nothing of the steps."""
    q, v, tau = states
    found = np.hstack(tail.step(q, v, tau, 2.5e-4, steps=40))
    start, settings = np.hstack([q, v]), {"rtol": 1e-12, "atol": 1e-12}
    for k in (0, 18):
        true = solve_ivp(
            lambda _, y, k=k: rate(tail, y, tau[k]), (0, 0.01), start[k], "DOP853", **settings
        )
        expected = true.y[:, -1]
        expected[3:7] /= np.linalg.norm(expected[3:7])
        assert_near(found[k], expected, 1e-9)


def test_steps_of_one_call_are_those_of_many(tail, states):
    q, v, tau = states
    at_once = tail.step(q, v, tau, H, steps=3)
    for _ in range(3):
        q, v = tail.step(q, v, tau, H)
    assert_near(np.hstack(at_once), np.hstack([q, v]), 1e-14)


def test_in_place_and_into_other_arrays(tail, states):
    """One state has no batch axis."""
    for q, v, tau in (states, [array[4] for array in states]):
        expected, into = tail.step(q, v, tau, H), (np.zeros_like(q), np.zeros_like(v))
        assert [array.shape for array in expected] == [q.shape, v.shape]
        found = tail.step(q, v, tau, H, out=into)
        assert all(np.shares_memory(a, b) for a, b in zip(found, into, strict=True))
        own = q.copy(), v.copy()
        tail.step(*own, tau, H, out=own)
        for a, b, c in zip(expected, into, own, strict=True):
            assert np.array_equal(a, b) and np.array_equal(a, c)


def test_single_rows_are_repeated(tail, states):
    q, v, tau = states
    found = tail.step(q[2], v, tau[3], H)
    expected = tail.step(np.tile(q[2], (RUNS, 1)), v, np.tile(tau[3], (RUNS, 1)), H)
    assert all(np.array_equal(a, b) for a, b in zip(found, expected, strict=True))


def test_runs_have_parameters_of_their_own(tail, states):
    for runs in (3, RUNS):
        q, v, tau = (array[:runs] for array in states)
        changes = {"tail_mass": np.linspace(0.008, 0.02, runs), "gravity": np.linspace(0, 9, runs)}
        for given in (changes, tail.parameters_of_runs(changes, runs)):
            found = np.hstack(tail.step(q, v, tau, H, parameters=given))
            for k in range(runs):
                with row(runs, type(given), k):
                    own = tail.with_parameters(**{name: x[k] for name, x in changes.items()})
                    assert_near(found[k], runge_kutta(own, q[k], v[k], tau[k], H))


def test_threads_change_nothing(tail, states):
    q, v, tau = (np.tile(array, (40, 1)) for array in states)
    one, three = (tail.step(q, v, tau, H, steps=4, threads=n) for n in (1, 3))
    assert np.array_equal(one[0], three[0]) and np.array_equal(one[1], three[1])


def test_a_float_model_takes_and_gives_floats(tail, states):
    q, v, tau = (array.astype(np.float32) for array in states)
    own = q.copy(), v.copy()
    found = zoo.model("single").step(*own, tau, H, out=own)
    assert found[0].dtype == np.float32
    assert_near(np.hstack(found), np.hstack(tail.step(*states, H)), 2e-4)


def test_baked_parameters_serve(states):
    q, v, tau = states
    given = np.delete(q, [9, 10], 1), v[:, :8], tau[:, :2]
    baked, plain = (np.hstack(zoo.model(name).step(*given, H)) for name in ("baked", "m1_n3"))
    assert_near(baked, plain)


def test_a_copy_with_other_parameters_steps_by_these(tail, states):
    still = tail.with_parameters(gravity=0.0)
    falls = tail.step(*states, H)[1] - still.step(*states, H)[1]
    np.testing.assert_allclose(falls[:, 2], -H * tail.parameters["gravity"], rtol=1e-9)


def test_a_run_that_fails_stops_no_other(tail, states):
    for runs in (3, RUNS):
        q, v, tau = (array[:runs].copy() for array in states)
        expected = tail.step(q, v, tau, H)
        v[1, 6:] = 1e200
        own, statuses = (q.copy(), v.copy()), np.full(runs, -1, np.intc)
        tail.step(*own, tau, H, out=own, statuses=statuses)
        assert statuses[1] != 0 and not np.delete(statuses, 1).any()
        for found, wanted in zip(own, expected, strict=True):
            assert_near(np.delete(found, 1, 0), np.delete(wanted, 1, 0), 1e-13)
        with pytest.raises(st.SimulationError, match=r"step of run 1: .*too long"):
            tail.step(q, v, tau, H)
    tau[9, 2] = np.nan  # a status where statuses are asked for
    tail.step(q, states[1], tau, H, statuses=statuses)
    assert list(statuses.nonzero()[0]) == [9]
    v[2] = v[1]
    with pytest.raises(st.SimulationError, match=r"run 1: .*\(2 of 19 runs failed\)"):
        tail.step(q, v, states[2], H)
