"""Motors: controllers get no more torque than a line from rest to the speed without load, and the
power, allow; plans ask for no more.
"""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.references.metrics import block_error
from tests.references.parameters import TABLE_1, random_states
from tests.support import zoo
from tests.support.posed import posed
from tests.support.rows import row
from tests.support.tumbling import keyed, start

from .runs import alone, same, starts

STRONG = st.TorqueTable([0.0, 0.3], np.tile([0.01, -0.008], (2, 1)), 1e-4)


def model():
    return zoo.model("motors")


def within(asked, rates):
    """What motors give of torques (K, 2) at rates."""
    torque, speed, power = (np.array(model().parameters[f"motor_{n}"]) for n in NAMES)
    share = rates / speed
    given = np.clip(asked, torque * np.maximum(-1 - share, -1), torque * np.minimum(1 - share, 1))
    return np.where(given * rates > power, power / np.where(rates == 0, 1, rates), given)


NAMES = ("torque", "speed", "power")


def test_runs_get_what_motors_give_by_every_method():
    q, v = start(model())
    v[6:] = 3.0, -12.0  # the second is faster than its motor is without load
    still = st.Pfl(model(), ([0.0, 1.0], np.tile(q[7:] + 0.5, (2, 1))))
    for method in ("tsit5", "rk4", "dop853", "ros34pw2"):
        for law in (STRONG, still):
            run = st.simulate(model(), q, v, 0.1, controller=law, method=method)
            if law is STRONG:
                asked = np.tile([0.01, -0.008], (len(run), 1)) - 1e-4 * run.tail_rate
            else:
                asked = np.array([still(*each) for each in zip(run.t, run.q, run.v, strict=True)])
            given = within(asked, run.tail_rate)
            with row(method, type(law).__name__):
                assert (np.abs(asked - given) > 1e-4).any() and (run.tau * run.tail_rate < 0).any()
                np.testing.assert_allclose(run.tau, given, atol=1e-15)
                assert run.info["imbalance"]["relative"] < 1e-4


def test_rotors_are_armatures():
    """Pinocchio has them at each of the three joints that a coordinate turns."""
    pytest.importorskip("pinocchio")
    from tests.references import pinocchio_tree

    peer, rotors = pinocchio_tree.chain(TABLE_1, 1, 3), np.array(model().parameters["tail_rotor"])
    peer.model.armature = np.concatenate([np.zeros(6), np.tile(rotors / 3, 3)])
    for q, v, v_dot, tau in zip(*random_states(1, 2, 20, "random"), strict=True):
        expected = peer.forward_dynamics(q, v, tau)
        for found in (model().forward_dynamics, model().casadi.forward_dynamics):
            assert block_error(np.array(found(q, v, tau)).ravel(), expected) < 1e-10
        np.testing.assert_allclose(model().mass_matrix(q), H := peer.mass_matrix(q), atol=1e-15)
        assert model().energy(q, v)[0] == pytest.approx(v @ H @ v / 2, rel=1e-13)
        force = H @ v_dot + peer.bias_force(q, v)
        assert block_error(model().inverse_dynamics(q, v, v_dot), force) < 1e-11


def test_many_runs_get_the_same():
    q, v = starts(model(), 20)
    how = {"t_span": 0.05, "output_step": "5 ms", "method": "tsit5"}
    flights = alone(model(), q, v, STRONG, **how)
    same(st.simulate(model(), q, v, controller=STRONG, **how), flights)


@cache
def planned():
    return keyed(model(), start=start(model()), duration=0.4, track=False)


def test_plans_ask_for_what_motors_give():
    """A run with motors then does what the plan does."""
    plan = planned()
    times = np.linspace(0, 0.4, 2001)
    torques, rates = plan.torque(times), plan.curve.at(times)["tail_rate"]
    assert plan.success
    np.testing.assert_allclose(torques, within(torques, rates), atol=2e-3 * 3e-3)
    assert (torques * rates).max() > 0.99 * 4e-3
    strong = model().with_parameters(motor_torque=1, motor_speed=1e3, motor_power=1e3)
    free, run = (
        st.simulate(each, *plan.start, 0.4, controller=lambda t, q, v: plan.torque(t)[0])
        for each in (strong, model())
    )
    np.testing.assert_allclose(run.q[-1], free.q[-1], atol=1e-3)


def test_a_plan_s_own_numbers_come_first():
    own = st.Bounds(torque=1e-3, speed="600 rpm", power=[1, 2])
    of_model = (3e-3, 3e-3, 14, 10, 4e-3, 4e-3)
    turns = 20 * np.pi
    for bounds, found in ((st.Bounds(), of_model), (own, (1e-3, 1e-3, turns, turns, 1, 2))):
        problem = posed(model(), start=start(model()), duration=0.4, bounds=bounds)[0]
        np.testing.assert_allclose(np.ravel([getattr(problem.bounds, n) for n in NAMES]), found)
    free = st.Bounds(speed=None, power=None)
    problem = posed(model(), start=start(model()), duration=0.4, bounds=free)[0]
    assert problem.rows == ()
