"""Numbers with units in [simulate], [plan] and changes; magnitudes that are slips of units."""

import re
from dataclasses import fields
from math import pi, radians
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from serpentail.checks import Refusals
from serpentail.planning.problem import SETTINGS as PROBLEM_SETTINGS
from serpentail.planning.settings import PlanSettings
from serpentail.scenes.keys import read
from serpentail.scenes.plan import CODE_ONLY, plan_arguments
from serpentail.scenes.plan_keys import BOUNDS, GOAL, PLAN
from serpentail.scenes.simulate_keys import SIMULATE
from serpentail.units import MEASURES
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of
from tests.support.told import besides_progress

SPOKEN = """
[simulate.reference]
times = ["0 ms", "20 ms"]
bends = [["15 deg"], [0.5]]
[simulate.controller]
kind = "pfl"
kp = "1e4 1/s^2"
kd = "200 1/s"
"""
PLAIN = """
[simulate.reference]
times = [0.0, 0.02]
bends = [[0.2617993877991494], [0.5]]
[simulate.controller]
kind = "pfl"
kp = 1e4
kd = 200.0
"""


def test_a_motion_with_units_is_that_in_si(scene):
    with_units = {
        "duration": 'duration = "20 ms"',
        "height": 'height = "20 cm"\npitch = "30 deg"\nvelocity = ["1 cm/s", 0, "3.6 km/h"]',
        "gamma": 'gamma = "210 deg"',
        "delta": 'delta = -0.26\nmoves = [{ at = "5 ms", delta = "-60 deg", rate = "4000 deg/s" }]',
    }
    in_si = {
        "height": f"height = 0.2\npitch = {pi / 6}\nvelocity = [0.01, 0, 1.0]",
        "gamma": "gamma = 3.6651914291880923",
        "delta": (
            f"delta = -0.26\nmoves = [{{ at = 0.005, delta = {-pi / 3}, rate = {radians(4000)} }}]"
        ),
    }
    motions = []
    for added, replaced in ((SPOKEN, with_units), (PLAIN, in_si)):
        motions.append(st.scenario(scene(added, **replaced)).simulate())
    np.testing.assert_array_equal(motions[0].t, motions[1].t)
    np.testing.assert_allclose(motions[0].q, motions[1].q, rtol=0, atol=1e-12)


def test_parameters_of_a_scene_file_have_units_too(scene):
    parameters = '[parameters]\ntorso_mass = "105.7 g"\ntail_mount = "0, -40.5, 4.5 mm"\n'
    path = Path(scene())
    path.write_text(path.read_text().replace("[simulate]", parameters + "[simulate]"))
    found = st.scenario(path, changes={"tail_mass": "3.5 g", "start.pitch": "20 deg"})
    assert found.model.parameters["torso_mass"] == 0.1057
    assert found.model.parameters["tail_mass"] == 0.0035
    assert st.pitch_roll_yaw(found.q0)[0] == pytest.approx(pi / 9, abs=1e-15)


def test_set_takes_units(scene, capsys):
    given = ["--set", "start.height=12 cm", "--set", "torso_mass=0.11 kg", "--save", "a.npz"]
    assert cli.main(["simulate", scene(), *given]) == 0
    assert besides_progress(capsys.readouterr().err) == ""
    motion = st.Trajectory.load("a.npz")
    assert motion.q[0, 2] == 0.12 and motion.info["parameters"]["torso_mass"] == 0.11


def test_a_plan_with_units_is_that_in_si():
    start = {"q": [0, 0, "34 cm", 1, 0, 0, 0, "-32 deg", 0], "v": [0, 0, "238.5 cm/s", "90 deg/s"]}
    table = {
        "start": start,
        "duration": ["300 ms", 0.58],
        "tolerance": "0.01 deg",
        "goal": {"tail": ["free", "10 deg"], "torso_rate": "free"},
        "bounds": {"angle": "180 deg", "torque": "20 mN m"},
        "damping": "1 mN m s/rad",
    }
    found = plan_arguments(table)
    q, v = found["start"]
    assert q == [0, 0, 0.34, 1, 0, 0, 0, -0.5585053606381855, 0] and v == [0, 0, 2.385, pi / 2]
    assert found["duration"] == [0.3, 0.58] and found["tolerance"] == 0.01
    assert found["goal"] == st.Goal(tail=(None, radians(10)), torso_rate=None)
    assert found["bounds"] == st.Bounds(angle=pi, torque=0.02) and found["damping"] == 0.001
    assert plan_arguments({"start": start, "duration": 1, "goal": "upright"})["goal"] == "upright"


# All that is wrong, at once.


def test_all_that_is_wrong_with_a_motion_is_told_at_once(scene):
    path = scene(
        '[simulate.controller]\nkind = "pfl"\nkp = -1.0\n'
        '[simulate.reference]\ntimes = [0.0, 0.0]\nbends = [[0.1], [0.2]]\nblnd = "linear"\n',
        duration='duration = "3 m"\nrtol = -1\nmetod = "tsit5"\nmethod = "tsit6"',
        height="height = nan\nheigth = 2\npith = 3",
        gamma='gamma = "3 kg"',
        delta="dleta = 0",
    )
    with pytest.raises(st.SimulationError) as caught:
        st.scenario(path)
    lines = str(caught.value).splitlines()
    expected = [
        "simulate.duration: value '3 m': a length where a time is needed: give s, ms, us or",
        "simulate: key: value 'metod': did you mean 'method'?",
        "simulate.start: key: value 'heigth': did you mean 'height'?",
        "simulate.start: key: value 'pith': did you mean 'pitch'?",
        "simulate.legs.gamma: value '3 kg': a mass where an angle is needed: give rad, deg or",
        "simulate.legs: key: value 'dleta': did you mean 'delta'?",
        "simulate.reference: key: value 'blnd': did you mean 'blend'?",
        "simulate.method: value 'tsit6': did you mean 'tsit5'?",
        "simulate.rtol: value -1: needs a number above 0",
        "Pfl: kp: value -1.0: needs a number from 0",
    ]
    assert len(lines) == len(expected)
    for words in expected:
        assert any(line.startswith(words) for line in lines), words


def test_shapes_of_several_parts_are_told_at_once(scene):
    """What needs the model is told together, where the keys are right."""
    path = scene(
        "[simulate.reference]\ntimes = [1.0, 0.0]\nbends = [[0.1], [0.2]]\n"
        '[simulate.controller]\nkind = "pfl"\nkd = -1.0\n',
        height="velocity = [1, 2]",
        delta="delta = -0.26\nmoves = [{ at = 0.1 }]",
    )
    with pytest.raises(st.SimulationError) as caught:
        st.scenario(path)
    said = str(caught.value)
    assert len(said.splitlines()) == 4
    for words in (
        "legs.moves[0]: value",
        "Reference: times: value",
        "Pfl: kd: value -1.0",
        "simulate.start.velocity: value [1, 2]: needs three numbers",
    ):
        assert words in said


def test_all_that_is_wrong_with_a_plan_is_told_at_once():
    table = {
        "start": {"q": 1, "w": 2},
        "goal": {"tale": 1, "torso_rate": ["3 m"]},
        "bounds": 3,
        "durations": 0.3,
        "path": [],
        "tolerance": "3 s",
        "options": {"jit": True},
    }
    with pytest.raises(st.PlanningError) as caught:
        plan_arguments(table)
    said = str(caught.value)
    for words in (
        "plan.start: key: value 'w': needs 'q' or 'v'",
        "plan.start: value {'q': 1}: needs q and v",
        "plan.goal: key: value 'tale': did you mean 'tail'?",
        "plan.goal.torso_rate: value ['3 m']: a length where a rate of turning is needed",
        "plan.bounds: value 3: needs a table, under a line [plan.bounds]",
        "plan: key: value 'durations': did you mean 'duration'?",
        "plan.duration: no value: needs seconds",
        "plan.path: value []: only programs can give it",
        "plan.tolerance: value '3 s': a time where an angle is needed: give deg, rad or",
        "plan.options.jit: value True",
    ):
        assert words in said, words
    assert len(said.splitlines()) == 10


def test_the_keys_of_a_plan_are_what_plan_takes():
    arguments = {"start", "goal", "duration", "bounds", "design", "free_start", *PROBLEM_SETTINGS}
    arguments |= {entry.name for entry in fields(PlanSettings)}
    assert set(PLAN.keys) == arguments - set(CODE_ONLY)
    assert set(GOAL) == {entry.name for entry in fields(st.Goal)}
    assert set(BOUNDS) == {entry.name for entry in fields(st.Bounds)}


# Slips of units.

SLIPS = [
    ("simulate", {"duration": 1200.0}, 'simulate.duration: value 1200 s: .* mean "1200 ms"'),
    ("simulate", {"start": {"height": 340.0}}, 'start.height: value 340 m: .* mean "340 mm"'),
    ("simulate", {"start": {"pitch": -80}}, r'start.pitch: value -80 rad: .* mean "-80 deg"'),
    ("simulate", {"legs": {"gamma": [210.0, 1]}}, r'legs.gamma\[0\]: value 210 rad: .*"210 deg"'),
    ("simulate", {"legs": {"moves": [{"delta": -75}]}}, r"legs.moves\[0\].delta: value -75 rad"),
    ("simulate", {"reference": {"bends": [[[0, 90]]]}}, r"bends\[0\]\[0\]\[1\]: value 90 rad"),
    ("plan", {"start": {"q": [0, 0, 340, 1, 0, 0, 0]}}, r"plan.start.q\[2\]: value 340 m"),
    ("plan", {"start": {"q": [0] * 8 + [32]}}, r'plan.start.q\[8\]: value 32 rad: .* "32 deg"'),
]
TABLES = {"simulate": SIMULATE, "plan": PLAN}


@pytest.mark.parametrize(("where", "table", "words"), SLIPS, ids=[words for *_, words in SLIPS])
def test_a_slip_of_units_is_told(where, table, words):
    with pytest.warns(st.UnusualSize, match=words) as caught:
        read(table, TABLES[where], where, Refusals(ValueError))
    assert len(caught) == 1


def test_a_wide_bound_and_a_long_search_are_no_slips():
    table = {"bounds": {"angle": 100.0, "rate": 1e6}, "time_limit": 1e5}
    assert read(table, PLAN, "plan", Refusals(ValueError)) == table


@pytest.mark.filterwarnings("always::serpentail.errors.UnusualSize")
def test_a_scene_in_grams_millimetres_and_degrees_is_told(scene, capsys):
    """Each slip is one line on stderr, and the report is as always."""
    given = ["--set", "torso_mass=105.7", "--set", "hip=[22.5, -18, 11.25]"]
    given += ["--set", "start.pitch=20", "--set", "duration=0.001", "--set", "start.height=300"]
    assert cli.main(["simulate", scene(), *given, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("{") and out.count("\n") == 1
    lines = err.splitlines()
    assert len(lines) == 3 and all(line.startswith("serpentail: warning: ") for line in lines)
    for name, words in (("torso_mass", "105.7 g"), ("pitch", "20 deg"), ("height", "300 mm")):
        (line,) = [line for line in lines if name in line]
        assert line.endswith(f'did you mean "{words}"?')


# The document.

DOCUMENT = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")


def test_the_document_has_every_unit():
    rows = DOCUMENT.split("| what | units |")[1].split("\n\n")[0].splitlines()[2:]
    listed = {unit for row in rows for unit in row.split("|")[2].strip().split(", ")}
    assert listed == {unit for _, units in MEASURES.values() for unit in units}


def test_the_documents_example_is_a_motion(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = re.findall(r"^```toml\n(.*?)^```$", DOCUMENT, re.MULTILINE | re.DOTALL)[0]
    Path("rat.toml").write_text(text)
    found = st.scenario("rat.toml", folder_of(load_scene("rat.toml")))
    assert found.duration == 0.6 and found.v0[2] == 3.0 and found.q0[2] == 0.3
    assert found.controller == st.Damping(1e-3)
    parameters = found.model.parameters
    assert parameters["torso_mass"] == 0.1057
    assert parameters["torso_inertia"] == (6.72e-5, 3.64e-5, 7.28e-5)
