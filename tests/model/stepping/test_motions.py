"""Steps against Runge-Kutta in flight, SciPy on the ground, and `simulate`."""

import numpy as np
from scipy.integrate import solve_ivp

import serpentail as st
from tests.support import zoo

from ...support.rows import row
from .test_steps import AIR, RUNS, runs_of, stepped


def rate(model, y, tau, legs=None):
    """Rate of y = (q, v) or (q, v, bristles): the quaternion's is half its product with omega."""
    q, v, bristles = np.split(y, [model.nq, model.nq + model.nv])
    (w, x), omega = (q[3], q[4:7]), v[3:6]
    turn = 0.5 * np.concatenate([[-x @ omega], w * omega + np.cross(x, omega)])
    rates = [model.forward_dynamics(q, v, tau)]
    if legs is not None:
        rates = model.kernel("contact_rates")(q, v, tau, bristles, legs)[:2]
    return np.concatenate([v[:3], turn, v[6:], *rates])


def runge_kutta(model, y, tau, h):
    a = rate(model, y, tau)
    b = rate(model, y + h / 2 * a, tau)
    c = rate(model, y + h / 2 * b, tau)
    y = y + h / 6 * (a + 2 * b + 2 * c + rate(model, y + h * c, tau))
    y[3:7] /= np.linalg.norm(y[3:7])
    return y


def test_a_step_in_flight_is_one_of_runge_kutta():
    model, h = zoo.model(AIR), 2e-3
    values = runs_of(model)
    starts = np.hstack([values["q"], values["v"]])
    for each in (model, model.with_parameters(gravity=1.6)):
        pairs = zip(starts, values["tau"], strict=True)
        expected = [runge_kutta(each, y, tau, h) for y, tau in pairs]
        for runs in (1, 3, 8, 9, RUNS):
            with row(runs):
                found = stepped(each, {name: array[:runs] for name, array in values.items()}, h)
                np.testing.assert_allclose(found, expected[:runs], rtol=1e-12, atol=1e-12)


FINE, STEPS = 5e-5, 60  # s


def pressing(runs, seed=0):
    model, rng = zoo.model("ground"), np.random.default_rng(seed)
    q, v = np.zeros((runs, model.nq)), 0.05 * rng.normal(size=(runs, model.nv))
    q[:, 3], q[:, 7:] = 1, 0.2 * rng.normal(size=(runs, 2))
    legs = np.tile([3.66, -0.26, 3.66, -0.26, 0, 0, 0, 0], (runs, 1))
    legs[:, [1, 3]] -= rng.uniform(0, 0.3, (runs, 1))
    q[:, 2] = -model.contact_points(q, v, legs)[0][:, :6, 2].min(axis=1) - 2e-4
    bristles = np.zeros((runs, 2 * sum(model.contacts.values())))
    tau = 1e-5 * rng.normal(size=(runs, 2))
    return {"q": q, "v": v, "tau": tau, "bristles": bristles, "legs": legs}


def test_steps_on_the_ground_come_to_where_the_motion_does():
    """By half the step, half as far from it: the method is of order 1, singly and in lanes."""
    model, two = zoo.model("ground"), pressing(2)
    two["legs"][:, 4:] = [[2.0, -3.0, 2.0, -3.0], [0.0, -10.0, 0.0, 0.0]]
    nine = {name: array[np.arange(9) % 2] for name, array in two.items()}
    for k in range(2):
        start = np.concatenate([two[name][k] for name in ("q", "v", "bristles")])
        legs, turning = np.split(two["legs"][k], 2)

        def rates(t, y, tau=two["tau"][k], legs=legs, turning=turning):
            return rate(model, y, tau, np.concatenate([legs + t * turning, turning]))

        tolerances = {"rtol": 1e-9, "atol": 1e-11, "max_step": 2e-4}
        expected = solve_ivp(rates, (0, STEPS * FINE), start, "LSODA", **tolerances).y[:, -1]
        moved = np.abs(expected - start)[: model.nq].max()
        for runs in (two, nine):
            with row(k, len(runs["q"])):
                errors = []
                for part in (1, 2, 4):
                    found = stepped(model, runs, FINE / part, steps=STEPS * part)
                    errors.append(np.abs(found[k] - expected)[: model.nq].max())
                assert errors[0] < 0.02 * moved
                assert errors[1] < 0.7 * errors[0] and errors[2] < 0.7 * errors[1]


def test_a_run_on_the_ground_is_what_simulate_makes_of_it():
    """In flight it is near that of explicit steps."""
    model, values, end = zoo.model("ground"), pressing(11), 40 * FINE
    values["legs"] = legs = values["legs"][4]
    found = stepped(model, values, FINE, steps=40)
    for k in (0, 10):
        held = st.TorqueTable([0.0, end], np.tile(values["tau"][k], (2, 1)), 0.0)
        keys = {"controller": held, "legs": st.Legs.fixed(*legs[:2]), "output_step": end}
        keys |= {"t_span": end, "method": "implicit_euler", "step": FINE}
        motion = st.simulate(model, values["q"][k], values["v"][k], **keys)
        expected = np.hstack([motion.q[-1], motion.v[-1], motion.contact.bristles[-1].ravel()])
        np.testing.assert_allclose(found[k], expected, rtol=1e-8, atol=1e-12)
    values["q"][:, 2] += 1.0
    ways = ({}, {"method": "rk4"})
    implicit, explicit = (stepped(model, values, FINE, steps=20, **way) for way in ways)
    np.testing.assert_allclose(implicit[:, :9], explicit[:, :9], atol=1e-6)
    assert not np.array_equal(implicit, explicit)
