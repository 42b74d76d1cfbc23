"""Partial feedback linearisation: the tail obeys a linear law, whatever the torso does."""

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import planned, rat, start

STILL = ([0.0, 1.0], np.zeros((2, 2)))


def test_functions_that_the_model_lacks_are_named_at_once_or_made_of_others():
    """By these the tail follows a reference, and is held after its end."""
    with pytest.raises(st.ModelError, match=r"without .*'inverse_dynamics'"):
        st.Pfl(zoo.model("bare"), STILL)
    polar, q, v = zoo.model("polar"), np.eye(1, 9, 3)[0], np.zeros(8)
    q[7:] = 0.3, 0.5
    law = st.Pfl(polar, ([0.0, 0.1], np.tile([0.4, 0.5], (2, 1))))
    run = st.simulate(polar, q, v, controller=law, t_span=0.2, method="tsit5")
    np.testing.assert_allclose(run.tail[[len(run.t) // 2, -1]], [[0.4, 0.5]] * 2, atol=1e-6)


def plan():
    return planned(intervals=40, tolerance=None)


def test_tracking_a_plan_takes_the_planned_torques():
    """On the planned motion Eq. 46 is Eq. 1 solved for tau, at its ends, too, where one by rates is
    further off.
    """
    flight = plan().trajectory
    times = np.append(flight.t[:-1], np.nextafter(plan().duration, 0))
    states = list(zip(times, flight.q, flight.v, strict=True))
    by_plan, by_rates = (
        np.abs([law(*state) for state in states] - plan().torque(times)).max(axis=1)
        / np.abs(flight.tau).max()
        for law in (st.Pfl(rat(), plan()), st.Pfl(rat(), flight))
    )
    assert by_plan[[0, -1]].max() < 1e-2 and np.median(by_plan) < 1e-2
    assert (3 * by_plan[[0, -1]] < by_rates[[0, -1]]).all()


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
def test_torques_keep_their_limit(method):
    """A far reference asks for more than there is; a limit that is never met changes nothing."""
    model, (q, v) = rat(), start(rat())
    reference = ([0.0, 0.1], np.stack([q[7:], q[7:] + 0.3]))
    laws = [st.Pfl(model, reference, torque=limit) for limit in (None, 1e3, (1e-3, 2e-3))]
    how = {"t_span": 0.1, "method": method}
    free, wide, tight = (st.simulate(model, q, v, controller=law, **how) for law in laws)
    assert np.abs(free.tau).max() > 4e-3
    np.testing.assert_allclose(wide.q, free.q, atol=1e-6)
    assert np.abs(tight.tau).max(axis=0) == pytest.approx([1e-3, 2e-3])
    wanted = [laws[2](*state) for state in zip(tight.t, tight.q, tight.v, strict=True)]
    np.testing.assert_allclose(tight.tau[1:-1], wanted[1:-1], rtol=1e-9, atol=1e-12)


WRONG = [
    (3, {}, "reference is a int"),
    (([0, 1], np.zeros((2, 3))), {}, r"times \(2,\) and angles \(2, 3\)"),
    (([1, 0], np.zeros((2, 2))), {}, "increasing times"),
    (([0, 1], np.full((2, 2), np.nan)), {}, "value nan"),
    (([0], np.zeros((1, 2))), {}, "one node only"),
    (STILL, {"kp": -1}, "kp: value -1"),
    (STILL, {"kd": -1}, "kd: value -1"),
    (STILL, {"torque": 0}, "torque: value 0"),
    (STILL, {"torque": [1, 2, 3]}, "Pfl: torque"),
    (STILL, {"torque": "1 g"}, "torque: value '1 g'"),
]


def test_wrong_references_gains_and_limits_are_named_and_units_are_read():
    for reference, gains, words in WRONG:
        with row(words), pytest.raises(st.SimulationError, match=words):
            st.Pfl(rat(), reference, **gains)
    for text, wanted in (("1 mN m", [1e-3, 1e-3]), (["1 mN m", "0.2 N mm"], [1e-3, 2e-4])):
        assert st.Pfl(rat(), STILL, torque=text).torque.tolist() == wanted
