"""Planning again, which derives nothing anew; guesses; being told to stop; and plans that scenes
and the command line ask for.
"""

import json
import signal
import threading
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st
from serpentail.basics.attitude import from_angles
from serpentail.cli import cli
from serpentail.optimal import fatrop, interrupt
from serpentail.optimal.blas_threads import _blas, one_thread
from serpentail.planning import attempts as trying
from serpentail.planning.program import nodes
from serpentail.planning.result import report as result_report
from serpentail.planning.search import Search
from serpentail.scenes.plan import arguments_for, plan_arguments
from tests.support import zoo
from tests.support.rows import row
from tests.support.told import besides_progress
from tests.support.tumbling import AGAIN, DURATION, keyed, planned, rat, start

ENDLESS = {
    "ipopt": {"ipopt.tol": 1e-300, "ipopt.acceptable_tol": 1e-300, "ipopt.max_iter": 10**6},
    "fatrop": {"fatrop.tolerance": 1e-300, "fatrop.max_iter": 10**6, "fatrop.print_level": 0},
}


def again(model=None, **settings) -> st.Plan:
    return keyed(model or rat(), **AGAIN | {"start": start(rat())} | settings)


def numbers(plan: st.Plan) -> np.ndarray:
    found = plan.solution.samples
    return np.concatenate([found.states.ravel(), found.controls.ravel(), found.constants])


def test_planning_again_from_neighbouring_states_derives_nothing(monkeypatch):
    (q, v), fresh = start(rat()), again()
    monkeypatch.setattr(nodes, "terms_of", lambda *_: pytest.fail("derived again"))
    found = again(start=(q, 1.01 * v), guess=fresh)
    assert found.report["converged"]
    assert found.report["iterations"] < again(start=(q, 1.01 * v)).report["iterations"]
    np.testing.assert_allclose(found.trajectory.v[0, 3:], 1.01 * v[3:], atol=1e-9)
    np.testing.assert_allclose(found.trajectory.q[0], q, atol=1e-9)


@pytest.mark.slow
def test_other_problems_and_models_share_no_program():
    """Memoised terms answer for their own problem only: damping, goal and model all matter."""
    few = {"intervals": 4}
    heavy = rat().with_parameters(tail_mass=0.005)
    goal = st.Goal(attitude=from_angles(np.array([0.1, 0, 0])))
    found = [again(**few), again(**few, damping=1e-3), again(**few, goal=goal), again(heavy, **few)]
    assert len({plan.report["objective"] for plan in found}) == 4
    np.testing.assert_array_equal(numbers(again(**few)), numbers(found[0]))
    low, high = ({"path": ((lambda p: p.tail_rate[0], -m, m),)} for m in (2.0, 20.0))
    rates = [
        np.abs(again(**few, **path).curve.starts["tail_rate"][:, 0]).max() for path in (low, high)
    ]
    assert rates[0] <= 2.0 + 1e-6 < rates[1]


def test_several_guesses_are_as_good_as_one_and_the_solver_uses_one_thread():
    one, many = (planned(tolerance=None, intervals=8, multi_start=count) for count in (1, 3))
    assert one.report["guesses"] == 1 and many.report["guesses"] == 3
    assert many.report["objective"] <= one.report["objective"] * (1 + 1e-6)
    threads = _blas().openblas_get_num_threads
    before = threads()
    with one_thread():
        assert threads() == 1
    assert threads() == before


@pytest.mark.parametrize("name", ENDLESS)
def test_interrupt_and_time_limit_end_a_solve_inside_and_return_its_iterate(name):
    # so many intervals that rounding ends it only much later
    endless = partial(again, solver=name, options=ENDLESS[name], intervals=144)
    endless(time_limit=0.01)  # derives before it can be stopped
    before = signal.getsignal(signal.SIGINT)
    timer = threading.Timer(0.2, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    plan = endless()
    timer.join()
    assert plan.report["stopped"] == "interrupt" and signal.getsignal(signal.SIGINT) is before
    begun = time.perf_counter()
    cut = endless(time_limit=1.0)
    assert time.perf_counter() - begun >= 1.0
    assert cut.report["stopped"] == "time limit" and cut.report["iterations"] > 1
    for each in (plan, cut):
        assert not each.success and np.isfinite(numbers(each)).all()
        assert each.report["guesses"] == 1 and each.report["status"] == "User_Requested_Stop"


def test_a_stop_between_rounds_keeps_the_best_round_and_what_is_raised_is_raised(monkeypatch):
    settings = {"intervals": 6, "tolerance": 1e-12, "rounds": 30}
    finer = Search._finer

    def interrupted(search, last):
        signal.raise_signal(signal.SIGINT)
        return finer(search, last)

    for of, name, fake, why in (
        (Search, "_finer", interrupted, "interrupt"),
        (trying, "stop_reason", lambda: "time limit", "time limit"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(of, name, fake)
            plan = again(**settings)
        assert not plan.success and plan.report["converged"]
        assert (plan.report["stopped"], plan.report["intervals"]) == (why, 6)
    assert plan.report["rounds"] == 1

    def raised():
        raise KeyboardInterrupt

    monkeypatch.setattr(fatrop, "stop_reason", raised)  # while a solve goes on
    with pytest.raises(KeyboardInterrupt):
        again(solver="fatrop", intervals=12)


def test_time_limits_count_the_tracking_and_leave_it_out_without_time(monkeypatch):
    tracked, given = result_report.tracked, {"intervals": 6, "track": True}

    def slow(*arguments):
        time.sleep(0.2)
        return tracked(*arguments)

    monkeypatch.setattr(result_report, "tracked", slow)
    monkeypatch.setattr(result_report, "TRACKING_COST", 1e6)
    for limit, stopped in ((60.0, "time limit"), (None, None)):
        begun = time.perf_counter()
        report = again(**given, time_limit=limit).report
        taken = time.perf_counter() - begun
        assert report["stopped"] == stopped and report["success"]
        assert (report["tracked_attitude_error_deg"] is None) == (limit is not None)
    assert 0.2 + report["truth_s"] <= report["wall_s"] <= taken


def test_time_limits_are_of_one_thread_and_a_second_interrupt_is_the_usual_one():
    def reason():
        with interrupt.stoppable(3600.0):
            return interrupt.stop_reason()

    with interrupt.stoppable(1e-9), ThreadPoolExecutor(1) as other:
        assert other.submit(reason).result() is None
        assert interrupt.stop_reason() == "time limit"
    with pytest.raises(KeyboardInterrupt), interrupt.stoppable():
        signal.raise_signal(signal.SIGINT)
        assert interrupt.stop_reason() == "interrupt"
        signal.raise_signal(signal.SIGINT)
    with interrupt.stoppable():
        assert not interrupt.stop_reason()


SCENE = Path(__file__).parents[2] / "scenes" / "righting_m1_n3.toml"
TABLE = tomllib.loads(SCENE.read_text())["plan"]


def test_scene_has_the_arguments_of_plan_and_errors_name_the_key(tmp_path):
    goal = {"attitude": "free", "tail": ["free", 0.1]}
    arguments = plan_arguments(TABLE | {"tolerance": "free", "goal": goal})
    assert arguments["tolerances"] == st.Tolerances(attitude=None)
    assert arguments["goal"] == st.Goal(attitude=None, tail=(None, 0.1))
    assert np.linalg.norm(arguments["start"][0][3:7]) == pytest.approx(1, abs=1e-15)
    for words, changes in {
        r"plan.start: value {'q': \[\]}": {"start": {"q": []}},
        r"\[plan.goal\]": {"goal": 3},
        "plan.goal: key: value 'attitud': .*'attitude'": {"goal": {"attitud": "upright"}},
        "'torque'": {"bounds": {"torques": 1}},
        "'intervals'": {"intervalls": 3},
        "plan.guess: value 3": {"guess": 3},
    }.items():
        with row(words), pytest.raises(st.PlanningError, match=words):
            plan_arguments(TABLE | changes)
    for name in ("start", "duration"):
        rest = {key: value for key, value in TABLE.items() if key != name}
        with pytest.raises(st.PlanningError, match=f"plan.{name}: no value"):
            plan_arguments(rest)
    for text, words in (("kind = ", "scene file"), ('kind = "articulated"\n', "has no table")):
        (tmp_path / "scene.toml").write_text(text)
        with row(words), pytest.raises(st.PlanningError, match=words):
            st.planned(str(tmp_path / "scene.toml"))

    few = {"intervals": 10, "plan.tolerance": "free", "duration": "0.5 s", "tail_mass": "4 g"}
    plan = st.planned("righting_m1_n3", changes=few)
    assert (plan.report["intervals"], plan.duration, plan.model.parameters["tail_mass"]) == (
        10,
        0.5,
        0.004,
    )
    for wrong in ("duraton", "plan.tail_mass", "phase.a", "tail_mass.b"):
        with row(wrong), pytest.raises(st.SerpentailError, match=wrong.split(".")[0]):
            st.planned("righting_m1_n3", changes={wrong: 1})


def test_a_scaled_scene_scales_its_ranges():
    """By the parameter's unit: an inertia is a mass times a square of a length."""
    body = SimpleNamespace(manifest=rat().manifest | {"size": {"kg": 8.0, "m": 2.0, "s": 1.0}})
    inertias = [[1e-5, 1e-5, 1e-5], ["20 g mm^2", 1e-5, 1e-5]]
    design = {"tail_length": ["10 cm", 0.2], "torso_inertia": inertias, "tale": 3}
    asked = {"start": {"q": [0], "v": [0]}, "duration": 1, "design": design}
    found = arguments_for(body, asked)["design"]
    np.testing.assert_allclose(found["tail_length"], [0.2, 0.4])
    np.testing.assert_allclose(found["torso_inertia"], [[32e-5] * 3, [64e-8, 32e-5, 32e-5]])
    assert found["tale"] == 3


def test_command_line_prints_one_object(tmp_path, capsys):
    q, v = (part.tolist() for part in start(rat()))
    usual = f"[plan]\nduration = {DURATION}\nintervals = 8\nstart = {{ q = {q}, v = {v} }}\n"
    free = 'bounds.angle = 1.0\ndesign.tail_length = ["16 cm", 0.24]\n'
    free += 'free_start.tail = [[-0.2, "-5 deg"], [0.2, 0.1]]\n'
    scene, saved = tmp_path / "own.toml", tmp_path / "own.npz"
    words = ["plan", str(scene), "--folder", str(zoo.folder("m1_n3"))]
    numbers = {"iterations", "solve_cpu_s", "objective", "dyn_err", "energy_J"}
    for text in (usual, usual + free):
        scene.write_text(text)
        status = cli.main([*words, "--json", "-", "--save", str(saved)])
        out, err = capsys.readouterr()
        assert (status, besides_progress(err), out.count("\n")) == (0, "", 1)
        report, motion = json.loads(out), st.Trajectory.load(saved)
        assert report["success"] and report["open_loop_attitude_error_deg"] <= 0.01
        assert report["warnings"] == [] and report.keys() >= numbers
        assert motion.t[-1] == pytest.approx(DURATION)
    length = report["design"]["tail_length"]
    assert 0.16 <= length <= 0.24 and motion.info["parameters"]["tail_length"] == length
    assert report["start"]["tail"] == pytest.approx(motion.q[0, 7:], abs=1e-6)
    assert set(report["design_slopes"]) == {"tail_length"}
    assert cli.main(["plan", str(tmp_path / "none.toml")]) == 2
    assert "scene file" in capsys.readouterr().err
