"""Plans that scenes and the command line ask for."""

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.scenes.plan import arguments_for, plan_arguments, planned
from tests.support import zoo
from tests.support.rows import row
from tests.support.told import besides_progress
from tests.support.tumbling import DURATION, rat, start

SCENE = Path(__file__).parents[2] / "scenes" / "righting_m1_n3.toml"
TABLE = tomllib.loads(SCENE.read_text())["plan"]
NUMBERS = {"iterations", "solve_cpu_s", "objective", "dyn_err", "energy_J"}


def test_scene_has_the_arguments_of_plan_and_errors_name_the_key(tmp_path):
    goal = {"attitude": "free", "tail": ["free", 0.1]}
    arguments = plan_arguments(TABLE | {"tolerance": "free", "goal": goal})
    assert arguments["tolerance"] is None
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
            planned(str(tmp_path / "scene.toml"))


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
    for text in (usual, usual + free):
        scene.write_text(text)
        status = cli.main([*words, "--json", "-", "--save", str(saved)])
        out, err = capsys.readouterr()
        assert (status, besides_progress(err), out.count("\n")) == (0, "", 1)
        report, motion = json.loads(out), st.Trajectory.load(saved)
        assert report["success"] and report["open_loop_attitude_error_deg"] <= 0.01
        assert report["warnings"] == [] and report.keys() >= NUMBERS
        assert motion.t[-1] == pytest.approx(DURATION)
    length = report["design"]["tail_length"]
    assert 0.16 <= length <= 0.24 and motion.info["parameters"]["tail_length"] == length
    assert report["start"]["tail"] == pytest.approx(motion.q[0, 7:], abs=1e-6)
    assert set(report["design_slopes"]) == {"tail_length"}
    assert cli.main(["plan", str(tmp_path / "none.toml")]) == 2
    assert "scene file" in capsys.readouterr().err
