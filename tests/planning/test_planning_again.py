"""Planning again, which derives nothing anew, and being told to stop."""

import signal
import threading
import time

import numpy as np
import pytest

import serpentail as st
from serpentail.attitude import from_angles
from serpentail.planning import rounds, ways
from serpentail.planning.nlp import interrupt, solver, transcription
from serpentail.planning.result import report as result_report
from tests.support.models import model_folder
from tests.support.tumbling import AGAIN, FUNCTIONS, planned, rat, start


def test_planning_again_from_a_plan_takes_fewer_iterations():
    fresh, again = planned(tolerance=None), planned(tolerance=None, guess=planned(tolerance=None))
    assert again.report["converged"] and again.report["iterations"] < fresh.report["iterations"] / 2
    assert again.report["objective"] == pytest.approx(fresh.report["objective"], rel=1e-4)


def test_planning_again_from_neighbouring_states_derives_nothing(monkeypatch):
    model, (q, v) = rat(), start(rat())
    plan = st.plan(model, start=(q, v), **AGAIN)
    once = st.plan(model, start=(q, 1.005 * v), guess=plan, **AGAIN)
    for module, name in ((transcription, "transcribe"), (solver, "_engine")):
        monkeypatch.setattr(module, name, lambda *_: pytest.fail("derived again"))
    again = st.plan(model, start=(q, 1.01 * v), guess=once, **AGAIN)
    assert again.report["converged"] and again.report["iterations"] <= 8
    np.testing.assert_allclose(again.trajectory.v[0, 3:], 1.01 * v[3:], atol=1e-9)


def test_a_plan_of_the_same_size_lends_its_multipliers_and_no_other(monkeypatch):
    model, begun = rat(), []

    def noted(nlp, name, options, guess):
        begun.append(guess)
        return solver.solver(nlp, name, options, guess)

    monkeypatch.setattr(ways, "solver", noted)
    plan = st.plan(model, start=start(model), intervals=4, **AGAIN)
    for settings, guess in (({}, "warm"), ({"rule": "lobatto"}, "close")):
        del begun[:]
        again = st.plan(model, start=start(model), guess=plan, **AGAIN, **settings)
        assert again.report["converged"] and begun[0] == guess


def test_other_problems_and_models_share_no_program():
    """A memoised program answers for its own problem only: damping, goal and model all matter."""
    model, coarse = rat(), {"intervals": 4}
    tilted = st.Goal(attitude=from_angles(np.array([0.1, 0, 0])))
    found = [
        st.plan(model, start=start(model), **AGAIN, **coarse, **own)
        for own in ({}, {"damping": 1e-3})
    ]
    found += [st.plan(model, start=start(model), goal=tilted, **AGAIN, **coarse)]
    heavy = st.load(
        model_folder(1, 3, functions=list(dict.fromkeys(FUNCTIONS))),
        parameters={"tail_mass": 0.005},
    )
    found += [st.plan(heavy, start=start(model), **AGAIN, **coarse)]
    assert len({plan.report["objective"] for plan in found}) == 4
    again = st.plan(model, start=start(model), **AGAIN, **coarse)
    np.testing.assert_array_equal(again.solution.w, found[0].solution.w)


ENDLESS = {"ipopt.tol": 1e-300, "ipopt.acceptable_iter": 0, "ipopt.max_iter": 10**6}


def test_interrupt_in_the_first_solve_returns_its_iterate():
    """Ctrl-C in a solve that would take a million iterations."""
    model, common = rat(), AGAIN | {"start": start(rat()), "intervals": 40, "options": ENDLESS}
    st.plan(model, **common, time_limit=0.01)  # derives before it can be stopped
    before = signal.getsignal(signal.SIGINT)
    timer = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    plan = st.plan(model, **common)
    timer.join()
    assert not plan.success and np.isfinite(plan.solution.w).all()
    assert (plan.report["stopped"], plan.report["status"]) == ("interrupt", "User_Requested_Stop")
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupt_in_a_later_round_returns_the_round_before(monkeypatch):
    finer = rounds.Search._finer

    def interrupted(search, last):
        signal.raise_signal(signal.SIGINT)
        return finer(search, last)

    monkeypatch.setattr(rounds.Search, "_finer", interrupted)
    plan = st.plan(
        rat(), start=start(rat()), intervals=6, **AGAIN | {"tolerance": 1e-9, "rounds": 30}
    )
    assert not plan.success and plan.report["converged"]
    assert (plan.report["stopped"], plan.report["intervals"]) == ("interrupt", 6)


def test_time_limit_ends_a_solve_inside_and_returns_its_iterate():
    """A solve that would take a million iterations; a limit that is not reached changes nothing."""
    model = rat()
    common = AGAIN | {"start": start(model), "intervals": 40, "options": ENDLESS}
    st.plan(model, **common, time_limit=0.01)  # derives
    begun = time.perf_counter()
    cut = st.plan(model, **common, time_limit=0.5)
    assert 0.5 <= time.perf_counter() - begun < 30.0
    assert (cut.success, cut.report["stopped"], cut.report["guesses"]) == (False, "time limit", 1)
    assert cut.report["status"] == "User_Requested_Stop" and cut.report["iterations"] > 1
    free, limited = (
        st.plan(model, start=start(model), intervals=6, **AGAIN, **own)
        for own in ({}, {"time_limit": 60})
    )
    assert limited.report["stopped"] is None and limited.success
    np.testing.assert_array_equal(free.solution.w, limited.solution.w)


def test_time_limit_ends_refinement_with_the_best_round(monkeypatch):
    """Between rounds: what was solved before is kept, and is good for all but the tolerance."""
    model, settings = rat(), AGAIN | {"intervals": 6, "tolerance": 1e-12}
    monkeypatch.setattr(rounds, "stop_reason", lambda: "time limit")
    cut = st.plan(model, start=start(model), **settings)
    assert not cut.success and cut.report["converged"]
    assert (cut.report["stopped"], cut.report["rounds"]) == ("time limit", 1)


def test_wall_time_counts_the_tracking(monkeypatch):
    def slow(*arguments):
        time.sleep(0.2)
        return tracked(*arguments)

    tracked = result_report.tracked
    monkeypatch.setattr(result_report, "tracked", slow)
    given = AGAIN | {"start": start(rat()), "intervals": 6, "track": True}
    begun = time.perf_counter()
    report = st.plan(rat(), **given).report
    assert 0.2 + report["truth_s"] <= report["wall_s"] <= time.perf_counter() - begun
    assert report["tracked_attitude_error_deg"] is not None


def test_tracking_for_which_the_limit_leaves_no_time_is_left_out(monkeypatch):
    monkeypatch.setattr(result_report, "TRACKING_COST", 1e6)
    given = AGAIN | {"start": start(rat()), "intervals": 6, "track": True}
    for limit, stopped in ((60.0, "time limit"), (None, None)):
        report = st.plan(rat(), **given, time_limit=limit).report
        assert report["stopped"] == stopped and report["success"]
        assert (report["tracked_attitude_error_deg"] is None) == (limit is not None)


def test_time_limits_are_of_one_thread():
    found = {}

    def other():
        with interrupt.stoppable(3600.0):
            found["other"] = interrupt.stop_reason()

    with interrupt.stoppable(1e-9):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        assert (interrupt.stop_reason(), found["other"]) == ("time limit", None)


def test_second_interrupt_is_the_usual_one():
    with pytest.raises(KeyboardInterrupt), interrupt.stoppable():
        signal.raise_signal(signal.SIGINT)
        assert interrupt.stop_reason()
        signal.raise_signal(signal.SIGINT)
    with interrupt.stoppable():
        assert not interrupt.stop_reason()
