"""Clocks of controllers: each phase has its own, and a sampled law is asked at its ticks alone."""

import ctypes

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import NT, fly, starts

BEGIN = 0.02
TIMES, TORQUES = [0.01, 0.02, 0.03], np.array([[1, 2, 3, 4], [-4, 1, 0, 2], [0, 5, 1, -1]]) * 1e-5
ROWS = np.stack([TORQUES[:-1], np.diff(TORQUES, axis=0) / 0.01], axis=-1)
LAWS = {
    "table": lambda delay: st.TorqueTable(np.add(TIMES, delay), TORQUES),
    "curve": lambda delay: st.TorqueCurve(st.Piecewise(np.add(TIMES, delay), ROWS)),
    "function": lambda delay: lambda t, q, v: [1e-3 * (t - delay)] * NT,
}


def small():
    """One segment, which flies."""
    return zoo.model("m1_n3")


def start():
    """A start of it."""
    q, v = starts(small(), 1)
    return q[0], v[0] * 3


def test_a_law_of_a_phase_is_that_law_later():
    for method in ("rk4", "tsit5", "dop853"):
        for name, law in LAWS.items():
            with row(method, name):
                how = {"t_span": 0.06, "output_step": 1e-3, "method": method}
                in_phase = fly(controller=st.Phases([(0.0, None), (BEGIN, law(0.0))]), **how)
                late = fly(controller=st.Phases([(0.0, law(BEGIN))]), **how)
                after = in_phase.t > BEGIN
                np.testing.assert_allclose(in_phase.tau[after], late.tau[after], 1e-9, 1e-15)
                assert not in_phase.tau[~after][:-1].any()
                assert np.ptp(in_phase.tau[after], axis=0).all()


def test_a_function_of_c_has_the_clock_of_its_phase():
    times, real = [], ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, real, real, real)
    def torque(_context, t, _q, _v, tau):
        times.append(t)
        tau[0] = tau[1] = 0.0
        return 0

    controller = st.Phases([(0.0, None), (0.06, st.NativeTorque(torque))])
    st.simulate(small(), *start(), t_span=0.1, controller=controller)
    assert -1e-12 < min(times) < 1e-3 and max(times) == pytest.approx(0.04)


def test_a_clock_that_rounds_times_to_one_is_refused():
    controller = st.Phases([(0.0, None), (1e15, LAWS["table"](0.0))])
    with pytest.raises(st.SimulationError, match=r"times.*1000000000000000"):
        fly(controller=controller, t_span=0.01)


# ---- ticks ---------------------------------------------------------------------------------------

RATE, TICKS = 200.0, 12
PERIOD = 1 / RATE


class Filter:
    """Damping of a filtered rate: its torques depend on all calls before."""

    def __init__(self):
        self.rates, self.times = 0.0, []

    def __call__(self, t, q, v):
        self.times.append(t)
        self.rates = 0.6 * self.rates + 0.4 * v[6:]
        return -2e-4 * self.rates - 1e-3 * q[7:]


def by_hand(law, late):
    """State after all ticks; torques act from ``late`` ticks later on, half of one if it is 0.5."""
    (q, v), given = start(), [np.zeros(2)] * int(np.ceil(late))
    for k in range(TICKS):
        given.append(np.asarray(law(k * PERIOD, q, v)))
        parts = [(given[k], PERIOD)]
        if late % 1:
            parts = [(given[k], late % 1 * PERIOD), (given[k + 1], (1 - late % 1) * PERIOD)]
        for torque, duration in parts:
            held = {"controller": st.TorqueTable([0.0], [torque]), "output_step": duration}
            motion = st.simulate(small(), q, v, t_span=duration, method="tsit5", **held)
            q, v = motion.q[-1], motion.v[-1]
    return np.concatenate([q, v])


@pytest.mark.parametrize("late", [0, 0.5, 2])
def test_torques_are_held_between_ticks(late):
    """As in short runs one after another, each with torques that stay."""
    wanted = by_hand(Filter(), late)
    free = st.simulate(small(), *start(), t_span=TICKS * PERIOD)
    assert np.abs(np.append(free.q[-1], free.v[-1]) - wanted).max() > 1e-2
    for how in ({"method": "tsit5"}, {"method": "rk4", "step": 2e-5}, {"method": "dop853"}):
        law = Filter()
        how |= {"controller": st.Sampled(law, RATE, late * PERIOD), "output_step": PERIOD / 5}
        with row(how["method"]):
            motion = st.simulate(small(), *start(), t_span=TICKS * PERIOD, **how)
            assert np.allclose(law.times, np.arange(TICKS) * PERIOD, rtol=0, atol=1e-12)
            found = np.append(motion.q[-1], motion.v[-1])
            np.testing.assert_allclose(found, wanted, rtol=0, atol=2e-5)
            # the torques of the samples within a tick are equal
            within = motion.tau[1:].reshape(TICKS, 5, 2)
            assert late == 0.5 or not np.ptp(within, axis=1).any()
            assert len(np.unique(motion.tau[:, 0])) > TICKS - 3


def test_a_run_between_two_ticks_begins_with_one_and_a_phase_has_its_own_clock():
    law = Filter()
    st.simulate(small(), *start(), controller=st.Sampled(law, 100), t_span=(0.013, 0.035))
    assert np.allclose(law.times, [0.013, 0.02, 0.03], rtol=0, atol=1e-12)
    law = Filter()
    phases = st.Phases([(0.0, None), (0.013, st.Sampled(law, 100))])
    st.simulate(small(), *start(), controller=phases, t_span=0.035)
    assert np.allclose(law.times, [0, 0.01, 0.02], rtol=0, atol=1e-12)


def test_each_of_many_runs_has_its_own_torques_and_another_run_begins_anew():
    (q, v), how = start(), {"t_span": 0.05, "method": "tsit5"}
    faster = np.array([v, 1.2 * v])
    controllers = [st.Sampled(Filter(), RATE) for _ in range(2)]
    both = st.simulate(small(), q, faster, controller=controllers, **how)
    for k, own in enumerate(faster):
        wanted = st.simulate(small(), q, own, controller=st.Sampled(Filter(), RATE), **how)
        np.testing.assert_allclose(both.v[k, -1], wanted.v[-1], rtol=1e-9, atol=1e-9)


def test_wrong_ticks_and_torques_are_refused():
    rows = [
        ((None, 100.0), "function: value None"),
        ((len, 0.0), "rate: value 0.0"),
        ((len, 100.0, -1.0), "delay: value -1.0"),
    ]
    for arguments, words in rows:
        with row(words), pytest.raises(st.SimulationError, match=words):
            st.Sampled(*arguments)
    with pytest.raises(st.SimulationError, match="1000000 ticks"):
        st.simulate(small(), *start(), controller=st.Sampled(Filter(), 1e9))
    for given in (None, [1.0], [[1], [2, 3]], np.full(2, np.nan)):
        with row(given), pytest.raises(st.SimulationError, match="2 finite torques"):
            law = st.Sampled(lambda *_, given=given: given, 100)
            st.simulate(small(), *start(), controller=law)
