"""Goals that the conserved angular momentum forbids are refused, and no others."""

import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import rotation_matrix
from serpentail.checks import Refusals
from serpentail.planning.momentum import refuse_impossible
from serpentail.planning.problem import SETTINGS, checked_problem
from tests.support import zoo
from tests.support.tumbling import AGAIN, DURATION, planned, rat, start

TILTED = (0.8, 0.6, 0.0, 0.0)


def asked(goal, name="m1_n3", **bounds):
    """Refuse a goal, or not."""
    model, refused = zoo.model(name), Refusals(st.PlanningError)
    usual = planned(tolerance=None, intervals=8).problem
    settings = {name: getattr(usual, name) for name in SETTINGS}
    task = (start(model), goal, DURATION, st.Bounds(**bounds))
    problem = checked_problem(model, task, settings, refused)
    refused.tell()
    refuse_impossible(model, problem)


def test_torso_and_tail_at_rest_are_refused_where_something_turns():
    (q, v), goal = start(rat()), st.Goal(tail_rate=(0.0, 0.0))
    with pytest.raises(st.PlanningError, match="torso and tail at rest"):
        st.plan(rat(), start=(q, v), goal=goal, duration=DURATION)
    few = AGAIN | {"intervals": 6}
    assert st.plan(rat(), start=(q, 0 * v), goal=goal, **few).report["converged"]


def test_ends_that_motions_have_are_never_refused():
    """Rates of torso and tail that carry the momentum, by a solution of their own."""
    model, random = rat(), np.random.default_rng(3)
    h = model.momentum(*start(model))[1]
    for attitude, R in (("upright", np.eye(3)), (TILTED, rotation_matrix(np.array(TILTED)))):
        for _ in range(3):
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
    asked(st.Goal(**goal, tail=(0.1, 0.2, 0.3, -0.2)), "m2_n2")
    asked(st.Goal(**goal))
