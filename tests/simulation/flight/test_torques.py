"""Torque laws act as they are written, whichever method integrates them: each phase has a clock of
its own, and a sampled law is asked at its ticks alone.
"""

import ctypes

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import NQ, NT, V0, fly, starts

METHODS = ("rk4", "tsit5", "dop853")
DAMPING = (2e-6, 1e-6, 3e-6, 4e-6)
NODES = [2.02, 2.05, 2.06]
TORQUES = np.array([[1, 2, 3, 4], [-4, 1, 0, 2], [0, 5, 1, -1]]) * 1e-5


def on_all_methods(**settings):
    """Yield each method's name in the settings of a flight; a failure names it."""
    for method in METHODS:
        with row(method):
            yield {"method": method} | settings


def test_a_function_acts_as_damping_does_and_one_damping_is_for_all_joints():
    for how in on_all_methods():
        own = fly(t_span=0.1, controller=st.Damping(DAMPING), **how)
        user = fly(t_span=0.1, controller=lambda t, q, v: -np.array(DAMPING) * v[6:], **how)
        for name, rounding in (("q", 1e-14), ("v", 1e-12), ("tau", 1e-15)):
            np.testing.assert_allclose(getattr(user, name), getattr(own, name), 1e-13, rounding)
        np.testing.assert_allclose(own.tau, -own.v[:, 6:] * DAMPING, rtol=1e-15)
        one, each = (fly(t_span=0.02, controller=st.Damping(d), **how) for d in (2e-6, (2e-6,) * 4))
        np.testing.assert_array_equal(one.q, each.q)
        assert (one.q != fly(t_span=0.02, **how).q).any()


@pytest.mark.parametrize("damping", [0.0, DAMPING], ids=["undamped", "damped"])
def test_a_table_is_linear_in_between_and_held_outside(damping):
    def interpolated(t):
        return np.stack([np.interp(t, NODES, column) for column in TORQUES.T], axis=-1)

    for how in on_all_methods(t_span=(2.0, 2.1), output_step=1e-3):
        flight = fly(controller=st.TorqueTable(NODES, TORQUES, damping), **how)
        wanted = interpolated(flight.t) - flight.v[:, 6:] * damping
        np.testing.assert_allclose(flight.tau, wanted, rtol=0, atol=1e-17)
        assert (flight.tau[0] != flight.tau[30]).all()
        laws = [
            (begin, lambda t, q, v, begin=begin: interpolated(begin + t) - damping * v[6:])
            for begin in (2.0, *NODES)
        ]
        user = fly(controller=st.Phases(laws), **how)
        np.testing.assert_allclose(user.q, flight.q, rtol=0, atol=1e-9)


def test_a_table_of_one_node_is_a_constant_and_one_beyond_numbers_is_refused_without_a_warning():
    for node in (-1.0, 7.0):
        flight = fly(controller=st.TorqueTable([node], TORQUES[:1]), t_span=0.1)
        assert (flight.tau == TORQUES[0]).all()
    for size in (1e308, 1e200):
        beyond = st.TorqueTable([0.0, 1e-3], np.outer([size, -size], np.eye(1, NT)))
        with row(size), pytest.raises(st.SimulationError):
            fly(controller=beyond, t_span=0.1, most_steps=2000)


def test_a_function_gets_the_state_in_arrays_of_its_own():
    kept = []

    def spoil(t, q, v):
        kept.append((t, q.copy(), v.copy(), q, v))
        q[:], v[:] = np.nan, np.nan
        return [0.0] * NT

    for how in on_all_methods(t_span=0.01):
        kept.clear()
        flight, free = (fly(controller=law, **how) for law in (spoil, None))
        np.testing.assert_array_equal(flight.q, free.q)
        assert kept[0][0] == 0.0 and kept[0][1].shape == (NQ,)
        np.testing.assert_array_equal(kept[0][2], V0)
        assert np.isnan(kept[0][3]).all()


@pytest.mark.parametrize(
    "raised", [KeyError("mine"), KeyboardInterrupt(), st.StateError("mine")], ids=repr
)
def test_an_exception_of_the_function_comes_through_at_once(raised):
    calls = []

    def law(t, q, v):
        calls.append(t)
        if len(calls) == number:
            raise raised
        return [0.0] * NT

    for number in (1, 2, 50):
        for how in on_all_methods():
            calls.clear()
            with row(number), pytest.raises(type(raised)) as caught:
                fly(t_span=0.1, controller=law, **how)
            assert caught.value is raised and len(calls) == number
            if number == 50 and isinstance(raised, KeyboardInterrupt):
                assert repr(caught.value.motion).endswith("failed: interrupted>")


def test_a_wrong_answer_of_the_function_is_named():
    five, nested, nan, inf = [0.0] * 5, [[0.0] * NT], [np.nan] * NT, [np.inf] * NT
    tsit5, others = "tsit5", ("rk4", "dop853")
    rows = [(tsit5, x) for x in (set(), "1", [[1], [2, 3]], None, five, nested, 0.0, nan, inf)]
    for method, answer in rows + [(method, x) for method in others for x in (None, nan)]:
        wanted = r"the controller gave (?s:.*) at t = 2 s, not 4 finite torques"
        with row(method, answer), pytest.raises(st.SimulationError, match=wanted):
            fly(t_span=(2, 3), controller=lambda *_, answer=answer: answer, method=method)


def test_a_function_keeps_its_warnings():
    """dop853 ignores overflows of its own, not those of the user's function."""
    for how in on_all_methods(t_span=0.01):
        with pytest.raises(RuntimeWarning, match="divide by zero"):
            fly(controller=lambda t, q, v: np.ones(NT) / 0, **how)


BEGIN = 0.02
TIMES = [0.01, 0.02, 0.03]
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
    for how in on_all_methods(t_span=0.06, output_step=1e-3):
        for name, law in LAWS.items():
            with row(name):
                in_phase = fly(controller=st.Phases([(0.0, None), (BEGIN, law(0.0))]), **how)
                late = fly(controller=st.Phases([(0.0, law(BEGIN))]), **how)
                after = in_phase.t > BEGIN
                np.testing.assert_allclose(in_phase.tau[after], late.tau[after], 1e-9, 1e-15)
                assert not in_phase.tau[~after][:-1].any()
                assert np.ptp(in_phase.tau[after], axis=0).all()
    rounding = st.Phases([(0.0, None), (1e15, LAWS["table"](0.0))])  # times that become one
    with pytest.raises(st.SimulationError, match=r"times.*1000000000000000"):
        fly(controller=rounding, t_span=0.01)


def test_a_function_of_c_has_the_clock_of_its_phase_and_ends_its_run_if_it_refuses():
    times, real = [], ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, real, real, real)
    def torque(_context, t, q, _v, tau):
        times.append(t)
        tau[0] = tau[1] = 0.0
        return int(q[0] > 40 and t > 0.005)

    controller, (q, v) = st.Phases([(0.0, None), (0.06, st.NativeTorque(torque))]), start()
    q = np.array([q, q + 50 * np.eye(1, len(q))[0], q])
    for threads in (1, 2):
        found = st.simulate(small(), q, v, t_span=0.1, controller=controller, threads=threads)
        assert [error is None for error in found.errors] == [True, False, True]
        assert "error status" in str(found.errors[1])
    assert -1e-12 < min(times) < 1e-3 and max(times) == pytest.approx(0.04)


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
    phases = st.Phases([(-0.02, None), (-0.007, st.Sampled(law, 100))])
    st.simulate(small(), *start(), controller=phases, t_span=(-0.02, 0.015))
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
    with pytest.raises(st.SimulationError, match="1000000 ticks"):
        st.simulate(small(), *start(), controller=st.Sampled(Filter(), 1e9))
    for given in (None, [1.0], [[1], [2, 3]], np.full(2, np.nan)):
        with row(given), pytest.raises(st.SimulationError, match="2 finite torques"):
            law = st.Sampled(lambda *_, given=given: given, 100)
            st.simulate(small(), *start(), controller=law)
