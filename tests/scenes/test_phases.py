"""Tables [[phase]] of scene files: one scene and one command for a jump, a flight and a landing."""

import json
import tomllib

import pytest

import serpentail as st
from serpentail import cli
from tests.sequence.landing import SCENE, folder


def written(tmp_path, change):
    """A scene like that of the landing, with some of its lines changed."""
    text = SCENE.read_text()
    for old, new in change.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return str(path)


def test_one_command_makes_the_landing(capsys):
    assert cli.main(["simulate", str(SCENE), "--folder", str(folder()), "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["landed"] and told["landing_group"] == "feet"
    assert list(told["phases"]) == ["kick", "right", "land"]
    assert (
        told["phases"]["right"]["plan_is_true"] and told["phases"]["land"]["ended_by"] == "duration"
    )


def test_phases_can_be_changed():
    scene = st.scenario(SCENE, folder(), {"phase.0.duration": "0.1 s", "phase.0.moves": []})
    run = scene.sequence()
    assert not run.complete and run.trajectory.t[-1] == pytest.approx(0.1)


WRONG = {
    'name = "kick"': ('nam = "kick"', "phase[0]: key: value 'nam': did you mean 'name'?"),
    'until = "airborne"': ('until = "up"', "until: value 'up': needs 'airborne'"),
    'clearance = "10 mm"': ('clearance = "10 s"', "phase[0].clearance: value '10 s'"),
    'torso_rate = "free"': ('torso_rat = "free"', "phase[1].plan.goal: key: value 'torso_rat'"),
    "[phase.plan]": ("[phase.plan]\nstart = {}", "phase 'right': plan.start: value {}: needs none"),
    'name = "land"': ('name = "kick"', "two are called 'kick'"),
    "rtol = 1e-5": ("duration = 2.0", "simulate.duration: beside tables [[phase]]"),
    'delta = "-15 deg"': ('delta = "-15 deg"\nmoves = []', "simulate.legs.moves: beside"),
    "damping = 5e-3": ("damping = -5e-3", "phase 'land': damping: value -0.005"),
}


@pytest.mark.parametrize("old", WRONG)
def test_what_a_phase_cannot_be_is_named(tmp_path, capsys, old):
    new, words = WRONG[old]
    path = written(tmp_path, {old: new})
    assert cli.main(["simulate", path, "--folder", str(folder())]) == 2
    assert words in capsys.readouterr().err


def test_all_that_is_wrong_is_told_at_once(tmp_path, capsys):
    path = written(tmp_path, {'until = "airborne"': "until = 3", 'name = "land"': "name = 3"})
    assert cli.main(["simulate", path, "--folder", str(folder())]) == 2
    told = capsys.readouterr().err
    assert "until" in told and "name: value 3" in told


def test_the_schema_knows_phases():
    import jsonschema

    from serpentail.scenes.schema import scene_schema

    schema, scene = scene_schema(), tomllib.loads(SCENE.read_text())
    jsonschema.validate(scene, schema)
    scene["phase"][0]["until"] = "up"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(scene, schema)
