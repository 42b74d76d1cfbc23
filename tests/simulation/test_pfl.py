"""Partial feedback linearisation: the tail obeys a linear law, whatever the torso does."""

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation.pfl import KD, KP
from tests.references.parameters import random_states
from tests.support.models import model_folder
from tests.support.tumbling import planned, rat, start


@pytest.mark.parametrize("size", [(1, 3), (2, 3), (2, None)])
def test_tail_accelerations_are_those_commanded(size):
    """Eqs. 44 to 46: e_ddot + Kd e_dot + Kp e = 0, through forward dynamics."""
    model = rat(*size)
    times = np.linspace(0, 1, 30)
    reference = 0.3 * np.sin(times[:, None] * np.arange(1, model.nv - 5))
    law = st.Pfl(model, (times, reference))
    for q, v, _, _ in zip(*random_states(size[0], 3, 5, "random"), strict=True):
        v_dot = model.forward_dynamics(q, v, law(0.37, q, v))
        angles, rates, accelerations = law.reference(0.37)
        expected = accelerations + KD * (rates - v[6:]) + KP * (angles - q[7:])
        np.testing.assert_allclose(v_dot[6:], expected, rtol=1e-9)


def test_torques_are_those_of_the_papers_formula():
    """Eq. 46 as it stands: X^+ (S H^-1 C + ...), X = S H^-1 J_ta."""
    model = rat(2, 3)
    law = st.Pfl(model, (np.linspace(0, 1, 9), np.zeros((9, 4))), feedforward=False)
    q, v, _, _ = (rows[0] for rows in random_states(2, 1, 1, "random"))
    H, C = model.mass_matrix(q), model.bias_force(q, v)
    S = np.eye(model.nv)[6:]
    X = S @ np.linalg.solve(H, S.T)
    expected = np.linalg.pinv(X) @ (S @ np.linalg.solve(H, C) - KD * v[6:] - KP * q[7:])
    np.testing.assert_allclose(law(0.5, q, v), expected, rtol=1e-8)


def test_a_disturbed_tail_returns_to_the_plan():
    model, plan = rat(), planned()
    q, v = start(model)
    q[7:] += 0.05
    flight = st.simulate(
        model, q, v, controller=st.Pfl(model, plan), t_span=plan.duration, method="dop853"
    )
    error = np.abs(flight.resample(plan.trajectory.t).tail - plan.trajectory.tail).max(axis=1)
    assert error[0] > 0.049 and error[-1] < 1e-4


def test_after_the_reference_the_tail_is_held():
    model = rat()
    law = st.Pfl(model, ([0.0, 0.1, 0.2, 0.3], np.array([[0.0, 0], [0.1, 0], [0.3, 0], [0.4, 0]])))
    q, v = start(model)
    flight = st.simulate(model, q, v, controller=law, t_span=0.6, method="dop853", rtol=1e-8)
    np.testing.assert_allclose(flight.tail[-1], [0.4, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("reference", "gains", "words"),
    [
        (3, {}, "reference is a int"),
        (([0, 1], np.zeros((2, 3))), {}, "times (2,) and angles (2, 3)"),
        (([1, 0], np.zeros((2, 2))), {}, "needs increasing times"),
        (([0, 1], np.full((2, 2), np.nan)), {}, "]: value nan: needs a finite number"),
        (([0, 1], np.zeros((2, 2))), {"kp": -1}, "kp: value -1: needs a number from 0"),
        (
            ([0, 1], np.zeros((2, 2))),
            {"torque": 0},
            "torque: value 0: needs torques above 0, in N m",
        ),
        (([0, 1], np.zeros((2, 2))), {"torque": [1, 2, 3]}, "Pfl: torque"),
    ],
)
def test_misuse(reference, gains, words):
    with pytest.raises(st.SimulationError) as caught:
        st.Pfl(rat(), reference, **gains)
    assert words in str(caught.value)


def test_functions_that_the_model_lacks_are_named_at_once():
    reference = ([0.0, 1.0], np.zeros((2, 2)))
    has = ["forward_dynamics", "energy", "momentum", "rollout", "mass_matrix"]
    with pytest.raises(st.ModelError, match="without 'inverse_dynamics'"):
        st.Pfl(st.load(model_folder(1, 1, functions=has)), reference)
    st.Pfl(st.load(model_folder(1, 1, functions=[*has, "inverse_dynamics"])), reference)
    st.Pfl(st.load(model_folder(1, 1, functions=[*has, "pfl"])), reference)


def test_tracking_a_plan_takes_the_planned_torques():
    """On the planned motion Eq. 46 is Eq. 1 solved for tau, at its ends, too, where one by rates is
    further off.
    """
    model, plan = rat(), planned(intervals=40, tolerance=None)
    flight = plan.trajectory
    times = np.append(flight.t[:-1], np.nextafter(plan.duration, 0))
    states = list(zip(times, flight.q, flight.v, strict=True))
    by_plan, by_rates = (
        np.abs([law(*state) for state in states] - plan.torque(times)).max(axis=1)
        / np.abs(flight.tau).max()
        for law in (st.Pfl(model, plan), st.Pfl(model, flight))
    )
    assert by_plan[[0, -1]].max() < 1e-2 and np.median(by_plan) < 1e-2
    assert (3 * by_plan[[0, -1]] < by_rates[[0, -1]]).all()


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
def test_torques_keep_their_limit(method):
    """A far reference asks for more than there is; a limit that is never met changes nothing."""
    model, (q, v) = rat(), start(rat())
    reference = ([0.0, 0.1], np.stack([q[7:], q[7:] + 0.3]))
    settings = {"t_span": 0.1, "method": method}
    free, wide, tight = (
        st.simulate(model, q, v, controller=st.Pfl(model, reference, torque=limit), **settings)
        for limit in (None, 1e3, (1e-3, 2e-3))
    )
    assert np.abs(free.tau).max() > 4e-3
    np.testing.assert_allclose(wide.q, free.q, atol=1e-6)
    assert np.abs(tight.tau).max(axis=0) == pytest.approx([1e-3, 2e-3])
    law = st.Pfl(model, reference, torque=(1e-3, 2e-3))
    wanted = [law(*state) for state in zip(tight.t, tight.q, tight.v, strict=True)]
    np.testing.assert_allclose(tight.tau[1:-1], wanted[1:-1], rtol=1e-9, atol=1e-12)


def test_a_limit_may_be_a_text_with_a_unit():
    model, reference = rat(), ([0.0, 0.1], np.zeros((2, 2)))
    texts = "1 mN m", ["1 mN m", "0.2 N mm"]
    for text, wanted in zip(texts, ([1e-3, 1e-3], [1e-3, 2e-4]), strict=True):
        assert st.Pfl(model, reference, torque=text).torque.tolist() == wanted
    with pytest.raises(st.SimulationError, match="Pfl: torque: value '1 g': a mass where a torque"):
        st.Pfl(model, reference, torque="1 g")
