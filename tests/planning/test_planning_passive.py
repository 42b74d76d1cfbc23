"""Plans of passive tails know their springs, damping and stops."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import serpentail as st
from tests.references.passive import PassiveTail
from tests.support.elastic import elastic_model, plain_model
from tests.support.tumbling import DURATION, FUNCTIONS, start

ELASTIC = {"tail_stiffness": 3e-3, "tail_rest": 0.1, "tail_damping": 1e-4}
ELASTIC |= {"tail_stop_lower": -0.9, "tail_stop_upper": 0.9, "tail_stop_stiffness": 0.05}
SIZE = (1, 3)


def rat():
    return elastic_model(*SIZE, ELASTIC, functions=list(dict.fromkeys(FUNCTIONS)))


@cache
def planned():
    """A plan that rights a rat with an elastic tail."""
    bounds = st.Bounds(angle=np.pi / 3)
    return st.plan(rat(), start=start(rat()), duration=DURATION, bounds=bounds)


def test_plans_reach_the_goal_in_truth_and_when_tracked():
    plan = planned()
    assert plan.success and plan.report["dynamics"] == "compiled"
    assert plan.report["open_loop_attitude_error_deg"] < 0.5
    assert plan.report["tracked_attitude_error_deg"] < 0.5


def test_planned_torques_less_what_the_tail_asks_for_move_one_without():
    """By SciPy's DOP853, with the reference's forces of springs, damping and stops."""
    plan, bare, own = planned(), plain_model(*SIZE, functions=FUNCTIONS[:]), PassiveTail(ELASTIC, 2)

    def rate(t, y):
        q, v = y[: bare.nq], y[bare.nq :]
        w, e, omega = q[3], q[4:7], v[3:6]
        turn = np.concatenate([[-e @ omega], w * omega + np.cross(e, omega)]) / 2
        tau = plan.torque(t)[0] - own.force(q[7:], v[6:])
        return np.concatenate([v[:3], turn, v[6:], bare.forward_dynamics(q, v, tau)])

    y = np.concatenate([plan.problem.q0, plan.problem.v0])
    for a, b in zip(plan.curve.ends[:-1], plan.curve.ends[1:], strict=True):
        y = solve_ivp(rate, (a, np.nextafter(b, a)), y, "DOP853", rtol=1e-10, atol=1e-11).y[:, -1]
    end = plan.trajectory
    assert np.abs(end.tail).max() > 0.15  # springs matter
    np.testing.assert_allclose(y[7 : bare.nq], end.tail[-1], atol=2e-2)
    np.testing.assert_allclose(np.abs(y[3:7]), np.abs(end.q[-1, 3:7]), atol=5e-3)


def test_starts_and_goals_behind_the_stops_are_refused():
    model = rat()
    q, v = start(model)
    q[7] = 1.5
    with pytest.raises(st.PlanningError, match=r"start: tail coordinate 0 is 1\.5 rad, behind"):
        st.plan(model, start=(q, v), duration=DURATION)
    goal = st.Goal(tail=[0.0, -1.2])
    with pytest.raises(st.PlanningError, match=r"goal\.tail: tail coordinate 1 is -1\.2 rad"):
        st.plan(model, start=start(model), goal=goal, duration=DURATION)
    with pytest.raises(st.PlanningError, match="duration"):
        st.plan(model, start=start(model), goal=st.Goal(tail=[0.0, None]), duration=-1)
