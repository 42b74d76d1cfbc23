"""Tables [[phase]] of scene files: one scene and one command for a jump, a flight and a landing."""

import json
import re

import pytest

import serpentail as st
from serpentail import cli
from tests.support import zoo
from tests.support.rows import row
from tests.support.scenes import SCENES

SCENE = SCENES / "kick_and_land.toml"


@pytest.fixture
def changed(tmp_path, capsys):
    """Return a function from changes of the scene's text to what the command says against it."""

    def told(change):
        text = SCENE.read_text()
        for old, new in change.items():
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "scene.toml"
        path.write_text(text)
        assert cli.main(["simulate", str(path), "--folder", str(zoo.folder("ground"))]) == 2
        return capsys.readouterr().err

    return told


def test_one_command_makes_the_landing(capsys):
    folder = str(zoo.folder("ground"))
    assert cli.main(["simulate", str(SCENE), "--folder", folder, "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["landed"] and told["landing_group"] == "feet"
    assert list(told["phases"]) == ["kick", "right", "land"]
    assert told["phases"]["right"]["plan_is_true"]
    assert told["phases"]["land"]["ended_by"] == "duration"


def test_phases_can_be_changed():
    changes = {"phase.0.duration": "0.1 s", "phase.0.moves": []}
    scene = st.scenario(SCENE, zoo.folder("ground"), changes)
    run = scene.sequence()
    assert not run.complete and run.trajectory.t[-1] == pytest.approx(0.1)
    with pytest.raises(st.SimulationError, match="t_span"):
        scene.simulate(t_span=0.1)


def test_what_a_phase_cannot_be_is_named(changed):
    rows = {
        'name = "kick"': ('nam = "kick"', r"phase\[0\]: key: value 'nam': .*'name'"),
        'name = "right"': ("", r"phase\[1\].name: no value"),
        "duration = 1.5": ("", r"phase\[1\].duration: no value"),
        'until = "airborne"': ('until = "up"', "until: value 'up': .*'airborne'"),
        'clearance = "10 mm"': ('clearance = "10 s"', r"phase\[0\].clearance: value '10 s'"),
        'torso_rate = "free"': ('torso_rat = 1', r"phase\[1\].plan.goal: key: value 'torso_rat'"),
        "[phase.plan]": ("[phase.plan]\nstart = {}", "'right': plan.start: value {}"),
        'name = "land"': ('name = "kick"', "'kick'"),
        "rtol = 1e-5": ("duration = 2.0", r"simulate.duration: .*\[\[phase\]\]"),
        'delta = "-15 deg"': ('delta = "-15 deg"\nmoves = []', r"simulate.legs.moves: .*phase"),
        "damping = 5e-3": ("damping = -5e-3", "'land': damping: value -0.005"),
    }  # fmt: skip
    for old, (new, words) in rows.items():
        with row(old):
            assert re.search(words, changed({old: new}))
    told = changed({'until = "airborne"': "until = 3", 'name = "land"': "name = 3"})
    assert "until" in told and "name: value 3" in told  # all at once
