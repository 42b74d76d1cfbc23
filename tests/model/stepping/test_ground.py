"""Steps on the ground: implicit, with bristles, legs and torques of each run."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st

from ...simulation.rollouts.many import rat

H = 5e-5  # s
RUNS = 11


def pressing(runs, seed=0):
    """Poses in which feet press on the ground, velocities, torques, bristles and legs."""
    model, rng = rat(), np.random.default_rng(seed)
    q, v = np.zeros((runs, model.nq)), 0.05 * rng.normal(size=(runs, model.nv))
    q[:, 3], q[:, 7:] = 1, 0.2 * rng.normal(size=(runs, 2))
    legs = np.tile([3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0], (runs, 1))
    legs[:, [1, 3]] -= rng.uniform(0, 0.3, (runs, 1))
    lowest = model.contact_points(q, v, legs)[0][:, :6, 2].min(axis=1)
    q[:, 2] = -lowest - 2e-4
    bristles = np.zeros((runs, 2 * sum(model.contacts.values())))
    return q, v, 1e-5 * rng.normal(size=(runs, 2)), bristles, legs


def of_each(found, k):
    return np.concatenate([array[k] for array in found])


def true(model, y, tau, legs, duration):
    """Where LSODA of SciPy comes to, by the model's forces on the ground."""
    nq, nv = model.nq, model.nv

    def rate(t, y):
        q, v, bristles = y[:nq], y[nq : nq + nv], y[nq + nv :]
        w, x, omega = q[3], q[4:7], v[3:6]
        turn = 0.5 * np.concatenate([[-x @ omega], w * omega + np.cross(x, omega)])
        now = np.concatenate([legs[:4] + t * legs[4:], legs[4:]])
        v_dot, stretching = model.kernel("contact_rates")(q, v, tau, bristles, now)[:2]
        return np.concatenate([v[:3], turn, v[6:], v_dot, stretching])

    found = solve_ivp(rate, (0, duration), y, "LSODA", rtol=1e-10, atol=1e-12, max_step=1e-4)
    return found.y[:, -1]


@pytest.mark.parametrize("runs", [2, 9])
def test_steps_come_to_where_the_motion_does(runs):
    """By half the step, half as far from it: the method is of order 1, singly and in lanes."""
    q, v, tau, bristles, legs = (array[np.arange(runs) % 2] for array in pressing(2))
    legs[:, 4:] = np.resize([[2.0, -3.0, 2.0, -3.0], [0.0, -10.0, 0.0, 0.0]], (runs, 4))
    for k in range(2):
        start = np.concatenate([q[k], v[k], bristles[k]])
        expected = true(rat(), start, tau[k], legs[k], 100 * H)
        errors = []
        for part in (1, 2, 4):
            found = rat().step(q, v, tau, H / part, steps=100 * part, bristles=bristles, legs=legs)
            errors.append(np.abs(of_each(found, k) - expected)[: rat().nq].max())
        moved = np.abs(expected - start)[: rat().nq].max()
        assert errors[0] < 0.02 * moved
        assert errors[1] < 0.7 * errors[0] and errors[2] < 0.7 * errors[1]


def test_a_run_is_what_simulate_makes_of_it():
    q, v, tau, bristles, legs = pressing(RUNS)
    legs = legs[4]
    found = rat().step(q, v, tau, H, steps=40, bristles=bristles, legs=legs)
    for k in (0, 6, 10):
        times = np.array([0.0, 40 * H])
        motion = st.simulate(
            rat(),
            q[k],
            v[k],
            controller=st.TorqueTable(times, np.tile(tau[k], (2, 1)), 0.0),
            legs=st.Legs.fixed(legs[0], legs[1]),
            t_span=40 * H,
            output_step=40 * H,
            method="implicit_euler",
            step=H,
        )
        for array, expected in zip(found, (motion.q, motion.v), strict=False):
            np.testing.assert_allclose(array[k], expected[-1], rtol=1e-9, atol=1e-12)
        stretch = motion.contact.bristles[-1].ravel()
        np.testing.assert_allclose(found[2][k], stretch, rtol=1e-8, atol=1e-12)


def test_in_place_in_threads_and_one_by_one():
    q, v, tau, bristles, legs = pressing(80)
    expected = rat().step(q, v, tau, H, steps=3, bristles=bristles, legs=legs, threads=1)
    own = q.copy(), v.copy(), bristles.copy()
    rat().step(*own[:2], tau, H, steps=3, bristles=own[2], legs=legs, out=own, threads=3)
    for found, wanted in zip(own, expected, strict=True):
        assert np.array_equal(found, wanted)
    alone = rat().step(q[70], v[70], tau[70], H, steps=3, bristles=bristles[70], legs=legs[70])
    np.testing.assert_allclose(np.concatenate(alone), of_each(expected, 70), rtol=1e-9, atol=1e-13)


def test_runs_have_parameters_of_their_own():
    q, v, tau, bristles, legs = pressing(3)
    mass = np.array([0.09, 0.1, 0.12])
    given = {"bristles": bristles, "legs": legs, "steps": 20}
    found = rat().step(q, v, tau, H, parameters={"torso_mass": mass}, **given)
    given = {name: each[1] if name != "steps" else each for name, each in given.items()}
    own = rat().with_parameters(torso_mass=mass[1]).step(q[1], v[1], tau[1], H, **given)
    assert np.array_equal(of_each(found, 1), np.concatenate(own))
    assert not np.array_equal(of_each(found, 1), of_each(rat().step(q, v, tau, H, **given), 1))


def test_a_flight_by_implicit_steps_is_near_the_explicit():
    q, v, tau, bristles, legs = pressing(2)
    q[:, 2] += 1.0
    given = {"bristles": bristles, "legs": legs, "steps": 20}
    implicit = rat().step(q, v, tau, H, **given)
    explicit = rat().step(q, v, tau, H, method="rk4", **given)
    np.testing.assert_allclose(implicit[0], explicit[0], atol=1e-6)
    assert not np.array_equal(implicit[0], explicit[0])


def test_a_run_that_fails_stops_no_other():
    q, v, tau, bristles, legs = pressing(4)
    statuses = np.zeros(4, np.intc)
    given = {"bristles": bristles, "legs": legs}
    expected = rat().step(q, v, tau, H, **given)
    v[2, 3:6] = 1e9
    found = rat().step(q, v, tau, H, statuses=statuses, **given)
    assert list(statuses.nonzero()[0]) == [2]
    for k in (0, 1, 3):
        assert np.array_equal(of_each(found, k), of_each(expected, k))
    with pytest.raises(st.SimulationError, match="step of run 2: "):
        rat().step(q, v, tau, H, **given)
