"""Numbers with units in [simulate], [plan] and changes; magnitudes that are slips of units."""

import re
from dataclasses import fields
from math import pi, radians

import numpy as np
import pytest

import serpentail as st
from serpentail.basics.checks import Refusals
from serpentail.cli import cli
from serpentail.planning.problem import SETTINGS as PROBLEM_SETTINGS
from serpentail.planning.settings import PLACES
from serpentail.scenes.keys import read
from serpentail.scenes.plan import BOUNDS, CODE_ONLY, GOAL, PLAN, plan_arguments
from serpentail.scenes.simulate_keys import SIMULATE
from tests.support import zoo
from tests.support.rows import row


def test_a_motion_with_units_is_that_in_si(scenario):
    law = '[simulate.controller]\nkind = "pfl"\n[simulate.reference]\n'
    spoken = law.replace("\n[", '\nkp = "1e4 1/s^2"\nkd = "200 1/s"\n[')
    spoken += 'times = ["0 ms", "20 ms"]\nbends = [["15 deg"], [0.5]]\n'
    plain = law.replace("\n[", "\nkp = 1e4\nkd = 200.0\n[")
    plain += "times = [0.0, 0.02]\nbends = [[0.2617993877991494], [0.5]]\n"
    with_units = {
        "duration": 'duration = "20 ms"',
        "height": 'height = "20 cm"\npitch = "30 deg"\nvelocity = ["1 cm/s", 0, "3.6 km/h"]',
        "gamma": 'gamma = "210 deg"',
        "delta": 'delta = -0.26\nmoves = [{ at = "5 ms", delta = "-60 deg", rate = "4000 deg/s" }]',
    }
    move = f"{{ at = 0.005, delta = {-pi / 3}, rate = {radians(4000)} }}"
    in_si = {
        "height": f"height = 0.2\npitch = {pi / 6}\nvelocity = [0.01, 0, 1.0]",
        "gamma": "gamma = 3.6651914291880923",
        "delta": f"delta = -0.26\nmoves = [{move}]",
    }
    a, b = scenario(spoken, **with_units), scenario(plain, **in_si)
    np.testing.assert_array_equal(np.hstack([a.q0, a.v0]), np.hstack([b.q0, b.v0]))
    a, b = a.simulate(), b.simulate()
    np.testing.assert_array_equal(a.t, b.t)
    np.testing.assert_allclose(a.q, b.q, rtol=0, atol=1e-12)


def test_parameters_of_a_scene_file_and_changes_have_units_too(scenario):
    parameters = '[parameters]\ntorso_mass = "105.7 g"\ntail_mount = "0, -40.5, 4.5 mm"\n'
    changes = {"tail_mass": "3.5 g", "start.pitch": "20 deg"}
    found = scenario(parameters, changes)
    assert found.model.parameters["torso_mass"] == 0.1057
    assert found.model.parameters["tail_mount"] == (0.0, -0.0405, 0.0045)
    assert found.model.parameters["tail_mass"] == 0.0035
    assert st.pitch_roll_yaw(found.q0)[0] == pytest.approx(pi / 9, abs=1e-15)


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
    assert found["duration"] == [0.3, 0.58] and found["tolerances"] == st.Tolerances(attitude=0.01)
    assert found["goal"] == st.Goal(tail=(None, radians(10)), torso_rate=None)
    assert found["bounds"] == st.Bounds(angle=pi, torque=0.02) and found["damping"] == 0.001
    assert plan_arguments({"start": start, "duration": 1, "goal": "upright"})["goal"] == "upright"


# All that is wrong, at once.


def lines_of(error, work, *arguments, **keys):
    """The lines that an error has."""
    with pytest.raises(error) as caught:
        work(*arguments, **keys)
    return str(caught.value).splitlines()


def assert_told(lines, expected):
    """Check that there is one line for each pattern at its beginning."""
    for words in expected:
        with row(words):
            assert sum(bool(re.match(words, line)) for line in lines) == 1, lines
    assert len(lines) == len(expected), lines


def test_all_that_is_wrong_with_a_motion_is_told_at_once(scenario):
    pfl, reference = '[simulate.controller]\nkind = "pfl"\n', "[simulate.reference]\n"
    twice = "times = [0.0, 0.0]\nbends = [[0.1], [0.2]]\n"
    lines = lines_of(
        st.SimulationError,
        scenario,
        f'{pfl}kp = -1.0\n{reference}{twice}blnd = "linear"\n',
        duration='duration = "3 m"\nrtol = -1\nmetod = "tsit5"\nmethod = "tsit6"',
        height="height = nan\nheigth = 2\npith = 3",
        gamma='gamma = "3 kg"',
        delta="dleta = 0",
    )
    expected = [
        "simulate.duration: value '3 m': .*a time .* ms",
        "simulate: key: value 'metod': .*'method'",
        "simulate.start: key: value 'heigth': .*'height'",
        "simulate.start: key: value 'pith': .*'pitch'",
        "simulate.legs.gamma: value '3 kg': a mass .* rad, deg",
        "simulate.legs: key: value 'dleta': .*'delta'",
        "simulate.reference: key: value 'blnd': .*'blend'",
        "simulate.method: value 'tsit6': .*'tsit5'",
        "simulate.rtol: value -1",
        "Pfl: kp: value -1.0",
    ]
    assert_told(lines, expected)

    # what needs the model is told together, where the keys are right
    lines = lines_of(
        st.SimulationError,
        scenario,
        f"{pfl}kd = -1.0\n{reference}{twice}",
        height="velocity = [1, 2]",
        delta="delta = -0.26\nmoves = [{ at = 0.1 }]",
    )
    expected = [r"legs.moves\[0\]: value", "Reference: times: value", "Pfl: kd: value -1.0"]
    assert_told(lines, [*expected, r"simulate.start.velocity: value \[1, 2\]"])


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
    expected = [
        "plan.start: key: value 'w': .*'q' or 'v'",
        "plan.start: value {'q': 1}: .*v",
        "plan.goal: key: value 'tale': .*'tail'",
        r"plan.goal.torso_rate: value \['3 m'\]: a length .* rate of turning",
        r"plan.bounds: value 3: .*\[plan.bounds\]",
        "plan: key: value 'durations': .*'duration'",
        "plan.duration: no value",
        r"plan.path: value \[\]",
        "plan.tolerance: value '3 s': a time .* deg, rad",
        "plan.options.jit: value True",
    ]
    assert_told(lines_of(st.PlanningError, plan_arguments, table), expected)
    assert_told(lines_of(st.PlanningError, plan_arguments, {"duration": 1}), ["plan.start: no val"])


def test_the_keys_of_a_plan_are_what_plan_takes():
    arguments = {"start", "goal", "duration", "bounds", "design", "free_start", *PROBLEM_SETTINGS}
    arguments |= PLACES.keys() | {"design_totals"}
    assert set(PLAN.keys) == arguments - set(CODE_ONLY)
    assert set(GOAL) == {entry.name for entry in fields(st.Goal)}
    assert set(BOUNDS) == {entry.name for entry in fields(st.Bounds)}


# Slips of units.


def test_a_slip_of_units_is_told():
    tables = {"simulate": SIMULATE, "plan": PLAN}
    rows = [
        ("simulate", {"duration": 1200.0}, 'duration: value 1200 s: .*"1200 ms"'),
        ("simulate", {"start": {"height": 340.0}}, 'start.height: value 340 m: .*"340 mm"'),
        ("simulate", {"start": {"pitch": -80}}, 'start.pitch: value -80 rad: .*"-80 deg"'),
        ("simulate", {"legs": {"gamma": [210.0, 1]}}, r'legs.gamma\[0\]: value 210 .*"210 deg"'),
        ("simulate", {"legs": {"moves": [{"delta": -75}]}}, r"legs.moves\[0\].delta: value -75"),
        ("simulate", {"reference": {"bends": [[[0, 90]]]}}, r"bends\[0\]\[0\]\[1\]: value 90 rad"),
        ("plan", {"start": {"q": [0, 0, 340, 1, 0, 0, 0]}}, r"start.q\[2\]: value 340 m"),
        ("plan", {"start": {"q": [0] * 8 + [32]}}, r'start.q\[8\]: value 32 rad: .*"32 deg"'),
    ]
    for where, table, words in rows:
        with row(table), pytest.warns(st.UnusualSize, match=rf"{where}\..*{words}") as caught:
            read(table, tables[where], where, Refusals(ValueError))
        assert len(caught) == 1
    wide = {"bounds": {"angle": 100.0, "rate": 1e6}, "time_limit": 1e5}  # no slips
    assert read(wide, PLAN, "plan", Refusals(ValueError)) == wide


@pytest.mark.filterwarnings("always::serpentail.basics.errors.UnusualSize")
def test_a_scene_in_grams_millimetres_and_degrees_is_told(scene, capsys):
    """Each slip is one line on stderr, and the report is as always."""
    given = ["--set", "torso_mass=105.7", "--set", "hip=[22.5, -18, 11.25]"]
    given += ["--set", "start.pitch=20", "--set", "duration=0.001", "--set", "start.height=300"]
    folder = str(zoo.folder("feet_tail"))
    assert cli.main(["simulate", scene(), "--folder", folder, *given, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("{") and out.count("\n") == 1
    expected = [
        rf'serpentail: warning: .*{name}.*"{words}"\?$'
        for name, words in (("torso_mass", "105.7 g"), ("pitch", "20 deg"), ("height", "300 mm"))
    ]
    assert_told(err.splitlines(), expected)
