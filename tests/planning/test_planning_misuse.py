"""Planning problems that cannot be posed: the error names field, value and remedy, before anything
is solved.
"""

import inspect
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.checks import Refusals
from serpentail.planning.problem import checked_problem
from serpentail.scenes.plan import plan_arguments, planned
from serpentail.scenes.plan_keys import PLAN
from tests.support.models import model_folder
from tests.support.told import besides_progress
from tests.support.tumbling import DURATION, FUNCTIONS, rat, start

SCENE = Path(__file__).parents[2] / "scenes" / "righting_m1_n3.toml"
NAN = [float("nan")] * 8
USUAL = {
    **{"objective": "effort", "smoothing": 0.0, "damping": 0.0, "path": (), "clearance": None},
    **{"legs": None, "formulation": "airborne", "attitude": "quaternion"},
}


def refused(**changes) -> str:
    """The message of a problem with something wrong."""
    given = {"start": start(rat()), "duration": DURATION} | changes
    with pytest.raises(st.PlanningError) as caught:
        st.plan(rat(), **given)
    return str(caught.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"start": 3}, "start: value 3: needs (q0, v0)"),
        ({"start": (np.ones(8), np.zeros(8))}, "start[0]"),
        ({"start": (np.ones(9), NAN)}, "start[1]"),
        ({"start": (np.zeros(9), np.zeros(8))}, "upright is (1, 0, 0, 0)"),
        ({"duration": 0}, "duration: value 0: needs a number above 0"),
        ({"duration": (0.5, 0.2)}, "least <= most"),
        ({"duration": float("inf")}, "duration: value inf"),
        ({"goal": "upwright"}, "goal: value 'upwright': did you mean 'upright'?"),
        ({"goal": 3}, "goal: value 3: needs a serpentail.Goal"),
        ({"goal": st.Goal(attitude=(0, 0, 0, 0))}, "goal.attitude"),
        ({"goal": st.Goal(attitude="up")}, "goal.attitude: value 'up'"),
        ({"goal": st.Goal(torso_rate=(0, 0))}, "goal.torso_rate"),
        ({"goal": st.Goal(tail=(0.1, None, 0.2))}, "goal.tail"),
        ({"goal": st.Goal(tail=np.zeros(2, complex))}, "goal.tail"),
        ({"goal": st.Goal(tail=("1", None))}, "goal.tail"),
        ({"goal": st.Goal(tail=np.array(1.0))}, "goal.tail"),
        ({"goal": st.Goal(tail=np.ma.masked_all(2))}, "goal.tail: has masked entries"),
        ({"goal": st.Goal(tail_rate=(NAN[0], None))}, "goal.tail_rate"),
        ({"bounds": st.Bounds(torque=-1)}, "bounds.torque: value -1: needs magnitudes above 0"),
        ({"bounds": st.Bounds(angle=(1, 2, 3))}, "bounds.angle"),
        ({"bounds": st.Bounds(angle=1e-3)}, "beyond 0.001: widen the bound, or start inside it"),
        ({"goal": st.Goal(tail=(0.9, None)), "bounds": st.Bounds(angle=0.8)}, "goal.tail: entry 0"),
        ({"bounds": 0.02}, "bounds: value 0.02: needs a serpentail.Bounds"),
        ({"objective": "efort"}, "objective: value 'efort': did you mean 'effort'?"),
        ({"formulation": "euler"}, "formulation: value 'euler'"),
        ({"attitude": "matrix"}, "attitude: value 'matrix': needs 'quaternion' or 'euler'"),
        ({"damping": -1e-3}, "damping: value -0.001"),
        ({"smoothing": "none"}, "smoothing: value 'none': needs a number from 0"),
        ({"path": None}, "path: value None: needs rows"),
        ({"path": [(3, 0, 1)]}, "path[0]"),
        ({"path": [(len, "0", 1)]}, "path[0]: bounds ('0', 1): needs two numbers"),
        ({"path": [(len, 1, 0)]}, "path[0]: bounds (1.0, 0.0)"),
        ({"rule": "radaw"}, "rule: value 'radaw'"),
        ({"degree": 12}, "degree: value 12"),
        ({"intervals": 0}, "intervals: value 0: needs a whole number from 1"),
        ({"tolerance": 0.0}, "tolerance: value 0.0"),
        ({"time_limit": 0}, "time_limit: value 0: needs a number above 0"),
        ({"time_limit": float("nan")}, "time_limit: value nan"),
        (
            {"objective": lambda p: p.torqe**2},
            "objective: a point has no 'torqe', it has attitude",
        ),
        ({"objective": lambda p: p.torqe**2}, "did you mean 'torque'?"),
        ({"path": [(lambda p: p.hight, 0, 1)]}, "path[0]: a point has no 'hight', it has"),
        (
            {"objective": lambda p: p.torque},
            "objective: a result of shape (2, 1): needs one number",
        ),
        ({"objective": lambda _: "least"}, "objective: value 'least': needs a result of numbers"),
        ({"path": [(lambda _: None, 0, 1)]}, "path[0]: value None: needs a result of numbers"),
        ({"path": [(lambda p: p.tail, 0.5, 1)]}, "path[0]: the start has"),
        (
            {"path": [(lambda p: p.position[2], 0, 0.2)]},
            "path[0]: the start has 0.3, beyond (0, 0.2)",
        ),
        ({"path": [(lambda p: p.time, 0.1, 1)]}, "path[0]: the start has 0, beyond (0.1, 1)"),
        ({"num_nodes": 59}, "setting: value 'num_nodes': did you mean 'intervals'?"),
        ({"interval": 20}, "setting: value 'interval': did you mean 'intervals'?"),
        ({"guess": 3}, "guess: value 3: needs a Plan or a Trajectory"),
        ({"solver": "no_such"}, "solver: value 'no_such'"),
        (
            {"solver": "ipotp"},
            "solver: value 'ipotp': did you mean 'ipopt'? There are 'ipopt', 'fatrop'",
        ),
        ({"options": {"max_iter": 5}}, 'did you mean "ipopt.max_iter"?'),
        ({"options": {"max_iter": 5}, "solver": "fatrop"}, "did you mean 'fatrop.max_iter'?"),
        ({"duration": 1e160}, "a body falls inf m"),
        ({"duration": 580}, 'a body falls 1.6e+06 m in this time: did you mean "580 ms"?'),
        ({"duration": "20 mm"}, "duration: value '20 mm': a length where a time is needed"),
        ({"bounds": st.Bounds(torque="20 mm")}, "bounds.torque: value '20 mm': a length where"),
        ({"options": {"ipopt.no_such": 1}}, "options: value {'ipopt.no_such': 1}"),
        ({"options": 3}, "options: value 3: needs a dict"),
    ],
)
def test_what_is_wrong_is_named(changes, words):
    assert words in refused(**changes)


def test_path_constraints_that_a_start_may_meet_are_not_refused():
    """Torques and a free duration are not known there, nor are free starts."""
    q, v = start(rat())
    path = [(lambda p: p.torque, -1e-4, 0.02), (lambda p: p.duration, 0.3, 0.4)]
    path += [(lambda p: p.tail[0], q[7] - 1e-7, 3.0), (lambda p: p.tail_rate[0], -np.inf, 1e3)]
    given = {"duration": (0.1, 0.5), "rounds": 0, "retries": 0, "intervals": 3, "track": False}
    few = {"options": {"ipopt.max_iter": 2}, "tolerance": None}
    assert not st.plan(rat(), start=(q, v), path=path, **given, **few).success
    path = [(lambda p: p.tail[0], q[7] + 0.01, 3.0)]
    with pytest.raises(st.PlanningError, match=r"path\[0\]: the start has"):
        st.plan(rat(), start=(q, v), path=path, **given, **few)
    free = {"tail": (q[7:] - 0.1, q[7:] + 0.1)}
    assert not st.plan(rat(), start=(q, v), path=path, free_start=free, **given, **few).success


def test_bounds_and_durations_may_have_units():
    checked = [
        checked_problem(rat(), (start(rat()), None, duration, bounds), USUAL, Refusals(ValueError))
        for duration, bounds in (
            (0.4, st.Bounds(angle=np.pi / 3, torque=(0.02, 0.01), rate=np.radians(500))),
            ("400 ms", st.Bounds("60 deg", "500 deg/s", ["20 mN m", "10 N mm"])),
        )
    ]
    assert checked[0].duration == checked[1].duration == (0.4, 0.4)
    for name in ("angle", "rate", "torque"):
        own, texts = (getattr(problem.bounds, name) for problem in checked)
        np.testing.assert_allclose(texts, own, rtol=1e-15)


@pytest.mark.parametrize(
    ("duration", "bounds", "words"),
    [
        (6.0, st.Bounds(), r'duration: value 6 s: a body falls .*: did you mean "6 ms"\?'),
        (0.4, st.Bounds(torque=20), r'torque: value 20 N m: .*: did you mean "20 mN m"\?'),
        (0.4, st.Bounds(angle=60), r'angle: value 60 rad: .*: did you mean "60 deg"\?'),
    ],
)
def test_slips_of_units_give_a_warning(duration, bounds, words):
    with pytest.warns(st.UnusualSize, match=words):
        checked_problem(rat(), (start(rat()), None, duration, bounds), USUAL, Refusals(ValueError))


def test_a_long_flight_without_gravity_is_no_slip():
    weightless = rat().with_parameters(gravity=0.0)
    task = (start(rat()), None, 580.0, st.Bounds(angle=1e3, torque=None))
    assert checked_problem(weightless, task, USUAL, Refusals(ValueError)).duration == (580, 580)


def test_scenes_without_a_function_are_refused():
    model = st.load(
        model_folder(1, 1, functions=["mass_matrix", "forward_dynamics", "energy", "momentum"])
    )
    with pytest.raises(st.ModelError, match="'inverse_dynamics'"):
        st.plan(model, start=start(model), duration=DURATION)


def test_goal_that_cannot_be_reached_is_flagged():
    model = rat()
    q, v = start(model)
    v[3] = 60.0  # rad/s, far too fast for the time and torques given
    bounds = st.Bounds(angle=np.pi / 3, torque=1e-4)
    settings = {"retries": 0, "options": {"ipopt.max_iter": 60}}
    plan = st.plan(model, start=(q, v), duration=0.1, bounds=bounds, **settings)
    assert (
        not plan.success
        and not plan.report["converged"]
        and plan.report["status"] != "Solve_Succeeded"
    )
    json.dumps(plan.report, allow_nan=False)


# Scenes and the command line.


def table() -> dict:
    return tomllib.loads(SCENE.read_text())["plan"]


def test_scene_has_the_arguments_of_plan():
    arguments = plan_arguments(
        table() | {"tolerance": "free", "goal": {"attitude": "free", "tail": ["free", 0.1]}}
    )
    assert arguments["tolerance"] is None and arguments["goal"] == st.Goal(
        attitude=None, tail=(None, 0.1)
    )
    assert np.linalg.norm(arguments["start"][0][3:7]) == pytest.approx(1, abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"start": {"q": []}}, "plan.start: value {'q': []}: needs q and v"),
        ({"goal": 3}, "needs a table, under a line [plan.goal]"),
        (
            {"goal": {"attitud": "upright"}},
            "plan.goal: key: value 'attitud': did you mean 'attitude'?",
        ),
        ({"bounds": {"torques": 1}}, "did you mean 'torque'?"),
        ({"intervalls": 3}, "did you mean 'intervals'?"),
        ({"guess": 3}, "plan.guess: value 3: only programs can give it"),
    ],
)
def test_scene_errors_name_the_key(changes, words):
    with pytest.raises(st.PlanningError) as caught:
        plan_arguments(table() | changes)
    assert words in str(caught.value)


@pytest.mark.parametrize("text", ["kind = ", 'kind = "articulated"\n'])
def test_scene_without_a_plan(tmp_path, text):
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(st.PlanningError, match=r"scene file|has no table"):
        planned(str(tmp_path / "scene.toml"))


def test_command_line_prints_one_object(tmp_path, capsys):
    folder = model_folder(1, 3, functions=list(dict.fromkeys(FUNCTIONS)))
    q, v = start(rat())
    text = (
        f"[plan]\nduration = {DURATION}\nintervals = 8\n[plan.start]\nq = {q.tolist()}\nv = "
        f"{v.tolist()}\n"
    )
    (tmp_path / "own.toml").write_text(text)
    saved = tmp_path / "own.npz"
    status = cli.main(
        [
            "plan",
            str(tmp_path / "own.toml"),
            "--folder",
            str(folder),
            "--json",
            "-",
            "--save",
            str(saved),
        ]
    )
    out, err = capsys.readouterr()
    report = json.loads(out)
    assert (status, besides_progress(err), out.count("\n")) == (0, "", 1)
    assert report["warnings"] == []
    assert report["success"] and report["open_loop_attitude_error_deg"] <= 0.01
    assert {
        "iterations",
        "solve_cpu_s",
        "objective",
        "tracked_attitude_error_deg",
        "dyn_err",
        "energy_J",
    } <= set(report)
    assert st.Trajectory.load(saved).t[-1] == pytest.approx(DURATION)
    assert cli.main(["plan", str(tmp_path / "none.toml")]) == 2
    assert "scene file" in capsys.readouterr().err


def test_settings_are_named_for_editors_and_help():
    parameters = inspect.signature(st.plan).parameters
    named = [p for p in parameters.values() if p.kind == p.KEYWORD_ONLY]
    assert len(named) == 34 and all(p.annotation is not p.empty for p in named)
    assert {key for key in PLAN.keys if key not in parameters} == set()


def test_an_error_of_the_users_own_is_not_taken_for_a_points():
    with pytest.raises(AttributeError, match="'NoneType' object has no attribute 'torque'"):
        st.plan(rat(), start=start(rat()), duration=DURATION, objective=lambda p: None.torque)
