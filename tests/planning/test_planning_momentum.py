"""Goals that the conserved angular momentum forbids are refused, and no others."""

import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import rotation_matrix
from serpentail.checks import Refusals
from serpentail.planning.momentum import refuse_impossible
from serpentail.planning.problem import SETTINGS, checked_problem
from tests.support.tumbling import DURATION, planned, rat, start

REST = (0.0, 0.0)


def asked(goal, size=(1, 3), **bounds):
    """Refuse a goal, or not."""
    model, refused = rat(*size), Refusals(st.PlanningError)
    usual = planned(tolerance=None, intervals=8).problem
    settings = {name: getattr(usual, name) for name in SETTINGS}
    task = (start(model), goal, DURATION, st.Bounds(**bounds))
    problem = checked_problem(model, task, settings, refused)
    refused.tell()
    refuse_impossible(model, problem)


def test_torso_and_tail_at_rest_are_refused_where_something_turns():
    model, goal = rat(), st.Goal(tail_rate=REST)
    with pytest.raises(st.PlanningError, match="torso and tail at rest, but flight conserves"):
        st.plan(model, start=start(model), goal=goal, duration=DURATION)
    q, v = start(model)
    few = {"tolerance": None, "intervals": 6, "track": False}
    plan = st.plan(model, start=(q, 0 * v), goal=goal, duration=DURATION, **few)
    assert plan.report["converged"]


@pytest.mark.parametrize("attitude", ["upright", (0.8, 0.6, 0.0, 0.0)])
def test_ends_that_motions_have_are_never_refused(attitude):
    """Rates of torso and tail that carry the momentum, by a solution of their own."""
    model, random = rat(), np.random.default_rng(3)
    q, v = start(model)
    h = model.momentum(q, v)[1]
    R = np.eye(3) if attitude == "upright" else rotation_matrix(np.array(attitude))
    for _ in range(5):
        tail, tail_rate = random.uniform(-0.5, 0.5, 2), random.uniform(-30, 30, 2)
        H = model.mass_matrix(np.concatenate([[0, 0, 0, 1, 0, 0, 0], tail]))
        rhs = np.concatenate([np.zeros(3), R.T @ h]) - H[:6, 6:] @ tail_rate
        omega = np.linalg.solve(H[:6, :6], rhs)[3:]
        goal = {"attitude": attitude, "torso_rate": omega, "tail": tail}
        asked(st.Goal(**goal))
        asked(st.Goal(**goal, tail_rate=tail_rate))
        asked(st.Goal(**goal), rate=31.0)
        with pytest.raises(st.PlanningError, match=r"cannot carry .*% of the angular momentum"):
            asked(st.Goal(**goal | {"torso_rate": 1.5 * omega}, tail_rate=tail_rate))
        with pytest.raises(st.PlanningError, match="within their bounds"):
            asked(st.Goal(**goal), rate=0.5 * np.abs(tail_rate).min())


def test_one_segment_cannot_carry_any_momentum_but_two_can():
    """Two rates, three equations."""
    goal = {"attitude": (1.0, 0.0, 0.0, 0.0), "torso_rate": (0.0, 0.0, 0.0)}
    with pytest.raises(st.PlanningError, match="tail rates within their bounds cannot carry"):
        asked(st.Goal(**goal, tail=(0.1, 0.2)))
    asked(st.Goal(**goal, tail=(0.1, 0.2, 0.3, -0.2)), (2, 3))
    asked(st.Goal(**goal))
