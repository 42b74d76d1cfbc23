"""How a search goes on where its first guesses fail, and what it says where it finds nothing."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import serpentail as st
from serpentail.motion.plausibility import SUNK, depth_in_torso
from serpentail.optimal import fatrop
from serpentail.optimal.solution import Solution
from serpentail.optimal.violation import violation
from serpentail.planning import continuation
from serpentail.planning.attempts import Attempts
from serpentail.planning.continuation import with_bound
from serpentail.planning.magnitudes import checked_bounds
from tests.support import zoo
from tests.support.rows import row
from tests.support.tumbling import DURATION, keyed, rat, start

FREE_ANGLES = {
    "bounds": st.Bounds(angle=None),
    "through_torso": True,
    "track": False,
    "duration": DURATION,
}


def failing(monkeypatch, fails):
    """Let attempts fail for which ``fails(program, guess, solver)`` holds; return what is tried."""
    tried, solved = [], Attempts.solved

    def noted(self, program, motion, guess="far", solver="fatrop", quick=False):
        found = solved(self, program, motion, guess, solver, quick)
        if fails(program, guess, solver):
            found = replace(found, success=False, status="Failed_For_A_Test")
        tried.append((guess, solver, found))
        return found

    monkeypatch.setattr(Attempts, "solved", noted)
    return tried


def wanted(program) -> bool:
    """Tell if a program has the usual bound of torques and the usual duration."""
    return (
        bool(np.max(program.problem.bounds.torque) <= 0.02) and program.problem.duration[1] <= 0.4
    )


def test_an_easier_problem_is_led_back_to_the_wanted_one(monkeypatch):
    model = rat()
    tried = failing(monkeypatch, lambda program, guess, _: wanted(program) and guess == "far")
    plan = keyed(model, start=start(model), **FREE_ANGLES)
    assert plan.success and plan.report["advice"] is None
    torques = [float(np.max(found.samples.controls)) for *_, found in tried]
    assert len(tried) == 3 and tried[-1][0] == "close", torques  # wanted, easier, wanted
    monkeypatch.undo()
    alone = keyed(model, start=start(model), **FREE_ANGLES)
    assert plan.report["objective"] == pytest.approx(alone.report["objective"], rel=1e-5)


@pytest.mark.slow
def test_a_search_that_finds_nothing_says_which_bound_suffices_and_a_plan_has_it():
    model, begin, weak = rat(), start(rat(), 1), st.Bounds(torque=0.002)
    given = {"start": begin, "duration": DURATION, "bounds": weak, "track": False}
    for tolerance in (0.01, None):  # a plan that is true has another bound all the same
        plan = keyed(model, **given, tolerance=tolerance)
        report = plan.report
        with row(tolerance):
            assert not plan.success and not report["converged"]
            assert report["status"] == "Solved_With_Larger_Bound"
    bound, words = report["advice"].split(": ")
    enough = float(words.split()[0])
    assert bound in ("bounds.torque", "duration") and "no plan was found" in words
    assert report["advice"] in repr(plan)
    if bound == "bounds.torque":
        given["bounds"] = st.Bounds(torque=1.02 * enough)
    else:
        given["duration"] = 1.02 * enough
    assert keyed(model, guess=plan, **given).success


def test_larger_bounds_are_larger_by_their_factor():
    model = rat()
    problem = keyed(model, start=start(model), **FREE_ANGLES).problem
    free = replace(problem, duration=(0.3, 0.5))
    assert with_bound(problem, "bounds.torque", 1.0) is problem
    for factor in (1.5, 8.0):
        with row(factor):
            more = with_bound(problem, "bounds.torque", factor)
            np.testing.assert_allclose(more.bounds.torque, factor * problem.bounds.torque)
            assert with_bound(problem, "duration", factor).duration == (
                pytest.approx(0.4 * factor),
                pytest.approx(0.4 * factor),
            )
            assert with_bound(free, "duration", factor).duration == (0.3, 0.5 * factor)


@pytest.mark.slow
def test_ipopt_tries_where_fatrop_finds_nothing(monkeypatch):
    model = rat()
    tried = failing(monkeypatch, lambda _, __, solver: solver == "fatrop")
    plan = keyed(model, start=start(model), retries=1, **FREE_ANGLES)
    assert plan.success and plan.report["solver"] == "ipopt"
    assert [solver for _, solver, _ in tried].count("ipopt") == 1
    for solver in ("fatrop", "ipopt"):
        with row(solver):
            tried.clear()
            keyed(model, start=start(model), retries=1, solver=solver, **FREE_ANGLES)
            assert {each for _, each, _ in tried} == {solver}


def test_a_failed_search_returns_what_violates_least(monkeypatch):
    model, seen = rat(), []
    solve = fatrop.solve

    def few(problem, begin, guess, asked, most_threads=1, quick=False):
        found = solve(problem, begin, guess, {"fatrop.max_iter": 3}, most_threads, quick)
        seen.append((problem, found))
        return replace(found, success=False)

    monkeypatch.setattr(fatrop, "solve", few)
    monkeypatch.setattr(continuation, "EASIER", ())
    plan = keyed(model, start=start(model), solver="fatrop", retries=3, **FREE_ANGLES)
    assert not plan.success and len(seen) == 4
    least = min(seen, key=lambda pair: violation(pair[0], pair[1].samples))[1]
    assert isinstance(least, Solution)
    np.testing.assert_array_equal(plan.solution.samples.states, least.samples.states)


def test_the_nearest_stored_plan_is_the_second_guess(monkeypatch):
    model = rat()
    stored = [keyed(model, start=start(model, k), **FREE_ANGLES) for k in (0, 1, 2)]
    tried = failing(monkeypatch, lambda program, guess, _: wanted(program) and guess == "far")
    q, v = start(model)
    q[7] += 1e-3
    plan = keyed(model, start=(q, v), guess=stored, tolerance=None, **FREE_ANGLES)
    assert plan.success and [guess for guess, *_ in tried] == ["far", "close"]
    near = stored[0].report["objective"]
    assert plan.report["objective"] == pytest.approx(near, rel=0.05)
    monkeypatch.undo()
    tried = failing(monkeypatch, lambda *_: False)
    keyed(model, start=(q, v), guess=stored, tolerance=None, **FREE_ANGLES)
    assert [guess for guess, *_ in tried] == ["far"]  # not asked for


def test_angles_are_within_half_a_turn_unless_start_or_goal_ask_for_more():
    model = rat()
    q, v = start(model)
    for angle, tail, most in (
        ("half turn", 0.1, np.pi / 3),
        ("half turn", 1.3, 1.3),
        (None, 0.1, None),
        (0.8, 0.1, 0.8),
    ):
        q[7] = tail
        with row(angle, tail):
            bounds = st.Bounds(angle=angle)
            plan = keyed(model, start=(q, v), duration=DURATION, bounds=bounds, track=False)
            found = plan.problem.bounds.angle
            if most is None:
                assert found is None
            else:
                assert found[0] == pytest.approx(most)
                assert np.abs(plan.trajectory.tail[:, 0]).max() <= 1.001 * most
    model = zoo.model("ratios").with_parameters(joint_ratios=[1.0, 0.6, -0.5, -0.3])
    angles = checked_bounds(model, st.Bounds()).angle  # of joints that turn by ratios
    np.testing.assert_allclose(angles, np.pi / np.repeat([1.6, 0.8], 2))


def bending(point):
    """An objective that bends the tail into the torso."""
    rates = 1e2 * ca.sumsqr(point.torque) + 1e-4 * ca.sumsqr(point.tail_rate)
    return rates + ca.sumsqr(point.tail - np.array([0.0, 2.4]))


def test_a_plan_through_the_torso_is_made_again_around_it():
    model = rat()
    problem = {
        "start": start(model),
        "duration": DURATION,
        "goal": st.Goal(attitude=None, torso_rate=None),
        "bounds": st.Bounds(angle=np.pi),
        "objective": bending,
        "track": False,
    }
    free = keyed(model, through_torso=True, **problem)
    assert depth_in_torso(model, free.trajectory.q).max() > SUNK  # else the test shows nothing
    plan = keyed(model, **problem)
    assert plan.success and not any("torso" in doubt for doubt in plan.warnings)
    assert depth_in_torso(model, plan.trajectory.q).max() <= SUNK
    assert plan.report["objective"] > free.report["objective"]
