"""A controller with ticks equals short runs one after another, each with held torques."""

import numpy as np
import pytest

import serpentail as st
from tests.support.tumbling import rat, start

RATE, TICKS = 200.0, 12
PERIOD = 1 / RATE
METHODS = {"tsit5": {}, "rk4": {"step": 2e-5}, "dop853": {}}


class Filter:
    """Damping of a filtered rate: its torques depend on all calls before."""

    def __init__(self, tail):
        self.tail, self.rates, self.times = tail, 0.0, []

    def __call__(self, t, q, v):
        self.times.append(t)
        self.rates = 0.6 * self.rates + 0.4 * v[-self.tail :]
        return -2e-4 * self.rates - 1e-3 * q[-self.tail :]


def by_hand(model, q, v, law, late):
    """State after all ticks; torques act from ``late`` ticks later on, half of one if it is 0.5."""
    nt = model.layout.nt
    given = [np.zeros(nt)] * int(np.ceil(late))
    for k in range(TICKS):
        given.append(np.asarray(law(k * PERIOD, q, v)))
        parts = [(given[k], PERIOD)]
        if late % 1:
            parts = [(given[k], late % 1 * PERIOD), (given[k + 1], (1 - late % 1) * PERIOD)]
        for torque, duration in parts:
            held = st.TorqueTable([0.0], [torque])
            motion = st.simulate(
                model, q, v, controller=held, t_span=duration, method="tsit5", output_step=duration
            )
            q, v = motion.q[-1], motion.v[-1]
    return np.concatenate([q, v])


@pytest.mark.parametrize("late", [0, 0.5, 2])
@pytest.mark.parametrize("method", METHODS)
def test_torques_are_held_between_ticks(method, late):
    model = rat()
    nt, state = model.layout.nt, start(model)
    law = Filter(nt)
    controller = st.Sampled(law, RATE, late * PERIOD)
    motion = st.simulate(
        model, *state, controller=controller, t_span=TICKS * PERIOD, method=method,
        output_step=PERIOD / 5, **METHODS[method],
    )  # fmt: skip
    assert np.allclose(law.times, np.arange(TICKS) * PERIOD, rtol=0, atol=1e-12)
    wanted = by_hand(model, *state, Filter(nt), late)
    free = st.simulate(model, *state, t_span=TICKS * PERIOD)
    assert np.abs(np.append(free.q[-1], free.v[-1]) - wanted).max() > 1e-2
    np.testing.assert_allclose(np.append(motion.q[-1], motion.v[-1]), wanted, rtol=0, atol=2e-5)
    # the torques of the samples within a tick are equal
    within = motion.tau[1:].reshape(TICKS, 5, nt)
    if late != 0.5:
        assert not np.ptp(within, axis=1).any()
    assert len(np.unique(motion.tau[:, 0])) > TICKS - 3


def test_a_run_between_two_ticks_begins_with_one_and_a_phase_has_its_own_clock():
    model = rat()
    law = Filter(model.layout.nt)
    st.simulate(model, *start(model), controller=st.Sampled(law, 100), t_span=(0.013, 0.035))
    assert np.allclose(law.times, [0.013, 0.02, 0.03], rtol=0, atol=1e-12)
    law = Filter(model.layout.nt)
    phases = st.Phases([(0.0, None), (0.013, st.Sampled(law, 100))])
    st.simulate(model, *start(model), controller=phases, t_span=0.035)
    assert np.allclose(law.times, [0, 0.01, 0.02], rtol=0, atol=1e-12)


def test_each_of_many_runs_has_its_own_torques_and_another_run_begins_anew():
    model = rat()
    q, v = start(model)
    faster = np.array([v, 1.2 * v])
    controllers = [st.Sampled(Filter(model.layout.nt), RATE) for _ in range(2)]
    both = st.simulate(model, q, faster, controller=controllers, t_span=0.05, method="tsit5")
    for k, own in enumerate(faster):
        alone = st.Sampled(Filter(model.layout.nt), RATE)
        wanted = st.simulate(model, q, own, controller=alone, t_span=0.05, method="tsit5")
        np.testing.assert_allclose(both.v[k, -1], wanted.v[-1], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((None, 100.0), "Sampled: function: value None: needs a function"),
        ((len, 0.0), "Sampled: rate: value 0.0: needs a number above 0"),
        ((len, 100.0, -1.0), "Sampled: delay: value -1.0: needs a number from 0"),
    ],
)
def test_what_is_wrong_is_refused(arguments, words):
    with pytest.raises(st.SimulationError, match=words):
        st.Sampled(*arguments)


def test_too_many_ticks_and_wrong_torques_are_refused():
    model = rat()
    state = start(model)
    with pytest.raises(st.SimulationError, match="needs at most 1000000 ticks in a run"):
        st.simulate(model, *state, controller=st.Sampled(Filter(1), 1e9))
    for given in (None, [1.0], [[1], [2, 3]], np.full(model.layout.nt, np.nan)):
        with pytest.raises(st.SimulationError, match="finite torques"):
            st.simulate(model, *state, controller=st.Sampled(lambda *_, given=given: given, 100))
