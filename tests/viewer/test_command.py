"""Pages from the command line: of a simulation, of saved files."""

import json
import shutil
from pathlib import Path

import pytest

import serpentail as st
from serpentail import cli
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of
from tests.support.page import data_of
from tests.support.scenes import SCENES

KICK = str(SCENES / "kick.toml")


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Return a function from arguments to status, stdout and stderr; kick's model is built."""
    monkeypatch.chdir(tmp_path)
    st.build("kick")

    def invoke(*arguments):
        status = cli.main(list(arguments))
        return status, *capsys.readouterr()

    return invoke


def test_simulate_writes_a_page(run):
    options = ["--set", "duration=0.05", "--set", "mu=0.5", "--json", "-"]
    status, out, err = run("simulate", KICK, "--view", "kick.html", *options)
    assert (status, err, json.loads(out)["model"]) == (0, "", "kick")
    assert data_of(Path("kick.html"))["runs"][0]["rows"] == 51


def test_a_simulation_that_fails_has_a_page_up_to_there(run):
    few = ["--set", "most_steps=300", "--set", "start={height=0.1}"]
    status, out, err = run("simulate", KICK, "--view", "kick.html", *few)
    assert (status, out) == (2, "") and "t = " in err
    data = data_of(Path("kick.html"))
    assert data["notes"][0].endswith(err.strip())
    assert 1 < data["runs"][0]["rows"] < 1201


def test_a_wrong_name_is_refused_before_the_work(run):
    for verb, scene in (("simulate", "kick"), ("plan", "righting_m1_n3")):
        words = (verb, str(SCENES / f"{scene}.toml"), "--view", "kick.htm", "--save", "kick.npz")
        status, out, err = run(*words)
        assert (status, out) == (2, "") and "kick.htm" in err and ".html" in err
        assert not list(Path().iterdir())


def test_saved_motions_find_their_model(run):
    options = ["--save", "kick.npz", "--view", "own.html", "--set", "duration=0.02"]
    assert run("simulate", KICK, *options)[0] == 0
    assert run("view", "kick.npz") == (0, "kick.html\n", "")
    assert Path("kick.html").read_bytes() == Path("own.html").read_bytes()
    shutil.copy("kick.npz", "again.npz")
    status, out, _ = run("view", "kick.npz", "again.npz", "--output", "two.html", "--json", "-")
    assert (status, json.loads(out)) == (0, {"page": "two.html"})
    names = [run["name"] for run in data_of(Path("two.html"))["runs"]]
    assert names == ["kick.npz", "again.npz"]


def test_saved_motions_whose_model_is_elsewhere(run, tmp_path, monkeypatch):
    made = folder_of(load_scene(KICK))
    arguments = ["--folder", str(made), "--set", "duration=0.02"]
    assert run("simulate", KICK, "--save", "kick.npz", *arguments)[0] == 0
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    status, out, err = run("view", "kick.npz")
    assert (status, out) == (2, "") and "generated/kick" in err
    assert "'kick'" in err and "--folder" in err
    assert run("view", "kick.npz", "--folder", str(made))[0] == 0
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "empty"))
    Path("generated").mkdir()
    Path("generated/kick").symlink_to(made)
    assert run("view", "kick.npz")[0] == 0

    # another model of the same name
    Path("generated/kick").unlink()
    Path("generated/kick").symlink_to(folder_of(load_scene(SCENES / "contact_m1_n3.toml")))
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "none"))
    assert run("view", "kick.npz")[0] == 2


def test_files_that_are_no_motions(run):
    Path("bad.npz").write_text("bad")
    for name, words in (("none.npz", "no trajectory"), ("bad.npz", "damaged")):
        status, out, err = run("view", name)
        assert (status, out) == (2, "") and f"file: value {name!r}" in err and words in err
