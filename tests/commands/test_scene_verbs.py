"""Scenes from the command line: examples, new ones, their C; and what a shell completes."""

import json
import re
import subprocess
import tomllib
from pathlib import Path

import pytest

import serpentail as st
from serpentail import cli
from serpentail_codegen.scene.parse import load_scene
from tests.support.scenes import SCENES


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Return a function from arguments to status, stdout and stderr, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments):
        status = cli.main(list(arguments))
        return status, *capsys.readouterr()

    return invoke


def test_examples_are_the_scenes_of_the_checkout(run):
    status, out, err = run("examples", "--json", "-")
    assert (status, err) == (0, "")
    assert sorted(json.loads(out)) == sorted(path.stem for path in SCENES.glob("*.toml"))
    lines = run("examples")[1].splitlines()
    ends = {line.split()[0]: line.rpartition(" (")[2] for line in lines}
    assert (ends["kick"], ends["contact_m1_n3"]) == ("simulate)", "model only)")
    for path in SCENES.glob("*.toml"):
        assert ("simulate" in ends[path.stem]) == ("simulate" in tomllib.loads(path.read_text()))


@pytest.mark.parametrize("verb", ["verify", "info"])
def test_a_name_that_is_no_model_is_told_what_is_like_it(run, verb):
    status, _, err = run(verb, "kick_an_land")
    assert status and "did you mean 'kick_and_land'?" in err


def test_an_option_that_cannot_write_names_its_file_once(run):
    err = run("simulate", "cat", "--set", "duration=0.02", "--view", "/proc/x.html")[2]
    (told,) = [line for line in err.splitlines() if "--view" in line]
    assert told.count("x.html") == 1 and "could not be written: " in told


@pytest.mark.parametrize(
    ("options", "contacts"),
    [
        (["--segments", "2", "--links", "4"], ()),
        (["--tail", "continuum", "--segments", "2"], ()),
        (["--contacts", "torso", "feet"], ("feet", "torso")),
        (["--tail", "continuum", "--contacts", "tail"], ("tail",)),
    ],
)
def test_a_new_scene_is_commented_and_simulates(run, options, contacts):
    assert run("new", "rat.toml", *options)[0] == 0
    text, scene = Path("rat.toml").read_text(), load_scene("rat.toml")
    assert text.count("#") > 10 and scene.contacts == contacts
    assert scene.kind == ("continuum" if "continuum" in options else "articulated")
    status, out, _ = run("simulate", "rat.toml", "--set", "duration=0.02", "--json", "-")
    assert status == 0 and json.loads(out)["model"] == "rat"


def test_the_values_that_a_new_scene_shows_are_the_defaults(run):
    run("new", "rat.toml", "--contacts", "feet")
    text = Path("rat.toml").read_text()
    shown, count = re.subn(r"(?m)^# (\w+ = )", r"\1", text)
    assert count == 7
    Path("all.toml").write_text(shown)
    assert load_scene("all.toml").parameters == load_scene("rat.toml").parameters


def test_the_drop_of_a_new_scene_stands(run):
    run("new", "rat.toml", "--contacts", "feet", "tail", "torso")
    told = json.loads(run("simulate", "rat.toml", "--json", "-")[1])
    assert told["standing_end"] is True and told["warnings"] == []
    assert told["peak_ground_force_weights"] < 15


def test_a_copy_of_an_example(run):
    assert run("new", "mine.toml", "--example", "kick")[0] == 0
    assert tomllib.loads(Path("mine.toml").read_text()) == tomllib.loads(
        (SCENES / "kick.toml").read_text()
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a.txt"], "needs a name ending in .toml"),
        (["there.toml"], "is there; name another one"),
        (["a.toml", "--segments", "0"], "segments: value 0: needs a whole number"),
        (["a.toml", "--links", "-1"], "links: value -1"),
        (["a.toml", "--tail", "continuum", "--links", "2"], "a continuum tail has none"),
        (["a.toml", "--example", "kik"], "did you mean 'kick'"),
    ],
)
def test_what_cannot_be_a_new_scene(run, arguments, words):
    Path("there.toml").write_text("")
    status, out, err = run("new", *arguments)
    assert (status, out) == (2, "") and words in err
    assert [path.name for path in Path().iterdir()] == ["there.toml"]


def test_generate_is_the_generator(run):
    assert run("generate", "kick", "--functions", "energy", "--name", "small")[0] == 0
    assert st.load("generated/small").generated == ("energy",)
    assert run("generate", "none.toml")[0] == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--help"], "usage: serpentail generate"),
        ([], "scene: no value: give a scene file, or --tail and --segments"),
        (["--tail", "continuum"], "give a scene file, or --tail and --segments"),
        (["--tail", "continuum", "--segments", "1", "--links", "3"], "links: value 3"),
        (["kick", "--functions", "energi"], "did you mean 'energy'"),
    ],
)
def test_generate_says_what_it_needs(capfd, monkeypatch, tmp_path, arguments, words):
    monkeypatch.chdir(tmp_path)
    status = cli.main(["generate", *arguments])
    assert status == (0 if "--help" in arguments else 2)
    told = capfd.readouterr()
    assert words in (told.err or told.out) and "Traceback" not in told.err


def test_the_version(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["--version"])
    assert ended.value.code == 0 and capsys.readouterr().out == f"serpentail {st.__version__}\n"


def test_bash_takes_the_completion(run):
    status, out, err = run("completion", "bash")
    assert (status, err) == (0, "") and "simulate" in out
    subprocess.run(["bash", "-n"], input=out.encode(), check=True)


def test_a_scene_is_a_model_to_tell_about(run):
    status, out, _ = run("info", "righting_m1_n3", "--json", "-")
    assert status == 0 and json.loads(out)["links"] == 3
