"""Scenes from the command line: examples, new ones, their C; and what a shell completes."""

import json
import re
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.cli import cli
from serpentail.scenes.simulate import scenario_of
from serpentail_codegen.scene.parse import load_scene
from tests.support import zoo
from tests.support.scenes import SCENES

from ..support.rows import row


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments):
        status = cli.main(list(arguments))
        return status, *capfd.readouterr()

    return invoke


def test_examples_are_the_scenes_of_the_checkout_and_stand_for_models(run, capfd):
    status, out, err = run("examples", "--json", "-")
    assert (status, err) == (0, "")
    assert sorted(json.loads(out)) == sorted(path.stem for path in SCENES.glob("*.toml"))
    ends = {text.split()[0]: text.rpartition(" (")[2] for text in run("examples")[1].splitlines()}
    for path in SCENES.glob("*.toml"):
        assert ("simulate" in ends[path.stem]) == ("simulate" in tomllib.loads(path.read_text()))
    assert ends["contact_m1_n3"] == "model only)"
    status, out, _ = run("info", "righting_m1_n3", "--json", "-")
    assert status == 0 and json.loads(out)["links"] == 3
    for verb in ("verify", "info"):
        status, _, err = run(verb, "kick_an_land")
        assert status and "did you mean 'kick_and_land'?" in err
    status, out, err = run("completion", "bash")
    assert (status, err) == (0, "") and "simulate" in out
    subprocess.run(["bash", "-n"], input=out.encode(), check=True)
    with pytest.raises(SystemExit, match=r"^0$"):
        run("--version")
    assert capfd.readouterr().out == f"serpentail {st.__version__}\n"


NEW = [  # options, what the scene then is, and a model of the zoo that suits it
    ("--segments 2 --links 2", ("articulated", 2, 2, ()), "m2_n2"),
    ("--tail continuum --segments 2", ("continuum", 2, 1, ()), "arcs2"),
    ("--contacts torso feet", ("articulated", 1, 3, ("feet", "torso")), "ground"),
    ("--tail continuum --contacts tail", ("continuum", 1, 1, ("tail",)), None),
]


def test_a_new_scene_is_commented_and_simulates(run):
    for options, expected, name in NEW:
        with row(options):
            Path("of.toml").unlink(missing_ok=True)
            assert run("new", "of.toml", *options.split())[0] == 0
            text, scene = Path("of.toml").read_text(), load_scene("of.toml")
            assert (scene.kind, scene.segments, scene.links, scene.contacts) == expected
            simulated = tomllib.loads(text)["simulate"]
            assert ("legs" in simulated) == ("feet" in scene.contacts)
            if name:
                described = scenario_of(zoo.model(name), simulated, Path())
                motion = described.simulate(t_span=0.01)
                assert motion.t[-1] == 0.01 and np.isfinite(motion.q).all()
            # the values that it shows are the defaults
            shown, count = re.subn(r"(?m)^# (\w+ = )", r"\1", text)
            Path("of.toml").write_text(shown)
            assert count == 6 + bool(scene.contacts)
            assert load_scene("of.toml").parameters == scene.parameters


def test_a_copy_of_an_example_a_drop_that_stands_and_what_cannot_be(run):
    assert run("new", "mine.toml", "--example", "kick")[0] == 0
    found, expected = (path.read_text() for path in (Path("mine.toml"), SCENES / "kick.toml"))
    assert tomllib.loads(found) == tomllib.loads(expected)
    run("new", "rat.toml", "--contacts", "feet", "tail", "torso")
    told = json.loads(run("simulate", "rat.toml", "--json", "-")[1])
    assert told["model"] == "rat" and told["standing_end"] is True and told["warnings"] == []
    assert told["peak_ground_force_weights"] < 15
    Path("there.toml").write_text("")
    made = {path.name for path in Path().iterdir()}
    for arguments, words in (
        (["a.txt"], "'a.txt'"),
        (["there.toml"], "'there.toml': is there"),
        (["a.toml", "--segments", "0"], "segments: value 0"),
        (["a.toml", "--tail", "continuum", "--links", "2"], "links: value 2"),
        (["a.toml", "--example", "kik"], "did you mean 'kick'"),
    ):
        with row(arguments):
            status, out, err = run("new", *arguments)
            assert (status, out) == (2, "") and words in err
    assert {path.name for path in Path().iterdir()} == made


def test_generate_is_the_generator(run):
    assert run("generate", "kick", "--functions", "energy", "--name", "small")[0] == 0
    assert st.load("generated/small", compiled=False).generated == ("energy",)
    for arguments, status, words in (
        (["none.toml"], 2, "none.toml"),
        (["--help"], 0, "usage: serpentail generate"),
        ([], 2, "scene: no value"),
        (["kick", "--functions", "energi"], 2, "did you mean 'energy'"),
    ):
        with row(arguments):
            found, out, err = run("generate", *arguments)
            assert found == status and words in (err or out) and "Traceback" not in err
