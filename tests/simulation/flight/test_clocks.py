"""Each controller of phases has a clock of its own, which is at 0 where its phase begins."""

import ctypes

import numpy as np
import pytest

import serpentail as st
from tests.support.tumbling import planned, rat, start

from .thrown import NT, both

BEGIN = 0.02
TIMES, TORQUES = [0.01, 0.02, 0.03], np.array([[1, 2, 3, 4], [-4, 1, 0, 2], [0, 5, 1, -1]]) * 1e-5
ROWS = np.stack([TORQUES[:-1], np.diff(TORQUES, axis=0) / 0.01], axis=-1)
LAWS = {
    "table": lambda delay: st.TorqueTable(np.add(TIMES, delay), TORQUES),
    "curve": lambda delay: st.TorqueCurve(st.Piecewise(np.add(TIMES, delay), ROWS)),
    "function": lambda delay: lambda t, q, v: [1e-3 * (t - delay)] * NT,
}


@both
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_law_of_a_phase_is_that_law_later(fly, settings, law):
    span = {"t_span": 0.06, "output_step": 1e-3}
    in_phase = fly(controller=st.Phases([(0.0, None), (BEGIN, law(0.0))]), **span, **settings)
    late = fly(controller=st.Phases([(0.0, law(BEGIN))]), **span, **settings)
    after = in_phase.t > BEGIN
    np.testing.assert_allclose(in_phase.tau[after], late.tau[after], rtol=1e-9, atol=1e-15)
    assert not in_phase.tau[~after][:-1].any() and np.ptp(in_phase.tau[after], axis=0).all()


def test_a_function_of_c_has_the_clock_of_its_phase():
    times, real = [], ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, real, real, real)
    def torque(_context, t, _q, _v, tau):
        times.append(t)
        tau[0] = tau[1] = 0.0
        return 0

    controller = st.Phases([(0.0, None), (0.06, st.NativeTorque(torque))])
    st.simulate(rat(), *start(rat()), t_span=0.1, controller=controller)
    assert -1e-12 < min(times) < 1e-3 and max(times) == pytest.approx(0.04)


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
def test_a_plan_is_tracked_from_where_its_phase_begins(method):
    """What stands at the start of a plan after 0.2 s in which nothing happens goes as planned."""
    model, plan = rat(), planned()
    q, v = start(model)
    settings = {"method": method, "output_step": 1e-3}
    free = st.Pfl(model, ([0.0, 1.0], np.stack([q[7:], q[7:]])), kp=0, kd=0)
    controller = st.Phases([(0.0, free), (0.2, st.Pfl(model, plan))])
    before = st.simulate(model, q, v, controller=free, t_span=0.2, **settings)
    early, late = (
        st.simulate(model, *state, controller=law, t_span=span, **settings)
        for state, law, span in [
            ((before.q[-1], before.v[-1]), st.Pfl(model, plan), plan.duration),
            ((q, v), controller, 0.2 + plan.duration),
        ]
    )
    np.testing.assert_allclose(late.q[-1, 3:], early.q[-1, 3:], atol=1e-6)


def test_a_clock_that_rounds_times_to_one_is_refused(fly):
    controller = st.Phases([(0.0, None), (1e15, LAWS["table"](0.0))])
    with pytest.raises(st.SimulationError, match="Phases: times: value 1000000000000000"):
        fly(controller=controller, t_span=0.01)
