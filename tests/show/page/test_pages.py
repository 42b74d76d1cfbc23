"""Pages from the command line and in notebooks, and what cannot be a page."""

import dataclasses
import json
import re
import shutil
from html import unescape
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.cli import cli
from serpentail.show.page import view as viewer
from serpentail_codegen.scene.parse import load_scene
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.page import data_of
from tests.support.rows import row
from tests.support.scenes import SCENES

from .conftest import flown, plan

KICK = str(SCENES / "kick.toml")


def silent():
    """A motion of a model that lacks ``tail_points``."""
    return dataclasses.replace(flown(zoo.model("m1_n1")), model=zoo.model("bare"))


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Return a function from arguments to status, stdout and stderr; kick's model is built."""
    monkeypatch.chdir(tmp_path)
    st.build("kick")

    def invoke(*arguments):
        status = cli.main(list(arguments))
        return status, *capsys.readouterr()

    return invoke


def test_simulate_writes_a_page_of_what_was_done_before_it_failed(run):
    few = ["--set", "most_steps=300", "--set", "start={height=0.1}"]
    status, out, err = run("simulate", KICK, "--view", "kick.html", *few)
    assert (status, out) == (2, "") and "t = " in err
    data = data_of(Path("kick.html"))
    (note,) = data["notes"]
    assert note.endswith(err.strip()) and data["warnings"]
    assert 1 < data["runs"][0]["rows"] < 1201
    options = ["--set", "duration=0.05", "--set", "mu=0.5", "--json", "-"]
    status, out, err = run("simulate", KICK, "--view", "kick.html", *options)
    assert (status, err, json.loads(out)["model"]) == (0, "", "kick")
    assert data_of(Path("kick.html"))["runs"][0]["rows"] == 51


def test_a_wrong_name_or_file_is_refused_before_the_work(run):
    for verb, scene in (("simulate", "kick"), ("plan", "righting_m1_n3")):
        words = (verb, str(SCENES / f"{scene}.toml"), "--view", "kick.htm", "--save", "kick.npz")
        status, out, err = run(*words)
        assert (status, out) == (2, "") and "kick.htm" in err and ".html" in err
        assert not list(Path().iterdir())
    Path("bad.npz").write_text("bad")
    for name, words in (("none.npz", "no trajectory"), ("bad.npz", "damaged")):
        status, out, err = run("view", name)
        assert (status, out) == (2, "") and f"file: value {name!r}" in err and words in err


def test_saved_motions_find_their_model_or_are_told_where_it_is(run, tmp_path, monkeypatch):
    options = ["--save", "kick.npz", "--view", "own.html", "--set", "duration=0.02"]
    assert run("simulate", KICK, *options)[0] == 0
    assert run("view", "kick.npz") == (0, "kick.html\n", "")
    assert Path("kick.html").read_bytes() == Path("own.html").read_bytes()
    shutil.copy("kick.npz", "again.npz")
    status, out, _ = run("view", "kick.npz", "again.npz", "--output", "two.html", "--json", "-")
    assert (status, json.loads(out)) == (0, {"page": "two.html"})
    names = [each["name"] for each in data_of(Path("two.html"))["runs"]]
    assert names == ["kick.npz", "again.npz"]

    # of a model that is elsewhere: named, then in a folder here
    made = folder_of(load_scene(KICK))
    options = ["--save", "kick.npz", "--folder", str(made), "--set", "duration=0.02"]
    assert run("simulate", KICK, *options)[0] == 0
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "cache"))
    status, out, err = run("view", "kick.npz")
    assert (status, out) == (2, "")
    assert all(each in err for each in ("generated/kick", "'kick'", "--folder"))
    assert run("view", "kick.npz", "--folder", str(made))[0] == 0
    Path("generated").mkdir()
    for k, (other, status) in enumerate(((KICK, 0), (SCENES / "contact_m1_n3.toml", 2))):
        monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / f"empty {k}"))
        Path("generated/kick").unlink(missing_ok=True)
        Path("generated/kick").symlink_to(folder_of(load_scene(other)))
        assert run("view", "kick.npz")[0] == status, other


def test_paths_and_names(tmp_path, flight):
    file = tmp_path / "file"
    file.write_text("no folder")
    for path, words in (
        (tmp_path / "run.png", r"run\.png.*\.html"),
        (tmp_path, r"\.html"),
        (file / "run.html", r"run\.html.*not.*written|run\.html.*cannot be written"),
        (3, r"3.*\.html"),
    ):
        with row(path), pytest.raises(st.ViewError, match=rf"path: value .*{words}"):
            flight.view(path)
    for names in ("ab", ["a"], ["a", "a"], ["a", ""], ["a", 1], ["a", "b", "c"], 3):
        for path in (tmp_path / "run.html", None):
            with row(names), pytest.raises(st.ViewError, match=r"names: value .* 2 "):
                st.view([flight, flight], path, names=names)
    assert list(tmp_path.iterdir()) == [file]


def test_motions_models_and_a_page_that_is_not_there(tmp_path, flight, monkeypatch):
    path = tmp_path / "run.html"
    path.write_text("before")
    loaded = st.Trajectory.load(flight.save(tmp_path / "flight.npz"))
    for motions, model, words in (
        ([flight, 3], None, r"motions\[1\]: type int"),
        (None, None, r"motions\[0\]: type NoneType"),
        ([], None, "motions: none"),
        (loaded, None, r"motions\[0\]: .*model"),
        (loaded, "generated", "model: value 'generated'"),
        (loaded, zoo.model("m1_n3"), r"motions\[0\]: .*11 .*m1_n3 .*9"),
        (silent(), None, "tail_points"),
    ):
        with row(words), pytest.raises((st.ModelError, st.ViewError), match=words):
            st.view(motions, path, model=model)
    monkeypatch.setattr(viewer, "PAGE", tmp_path / "none.html")
    with pytest.raises(st.ViewError, match=r"Node\.js 18 .*make setup"):
        flight.view(path)
    assert path.read_text() == "before"


class Output:
    """An output as a browser reads it: text outside of the frame, the frame's attributes."""

    def __init__(self, thing):
        text, tag, more = thing._repr_html_().partition("<iframe ")
        self.words = unescape(re.sub("<[^>]*>", "", text))
        pairs = re.findall(r'([a-z]+)="([^"]*)"', more)
        self.frame = {name: unescape(value) for name, value in pairs} if tag else None


def shown(thing, tmp_path):
    """The runs of the page in an output, and its notes; the text above it is the usual one."""
    output, page = Output(thing), tmp_path / "frame.html"
    assert len(output.frame["srcdoc"]) < 1e6 and output.words in ("", repr(thing))
    page.write_text(output.frame["srcdoc"], encoding="utf-8")
    data = data_of(page)
    return data["runs"], data["notes"]


def test_a_motion_is_shown_with_its_text(kick, tmp_path):
    """Up to 601 samples whole, such as 0.6 s at 1 kHz; of more every second one."""
    (run,), notes = shown(kick, tmp_path)
    assert run["rows"] == 601 and Output(kick).words == repr(kick)
    assert run["arrays"]["pose"][-1] == pytest.approx(kick.q[-1, :7], rel=1e-6)
    assert any("one of 2 samples" in note for note in notes)
    for samples, rows in ((601, 601), (602, 302)):
        assert shown(flown(zoo.model("m1_n3"), samples), tmp_path)[0][0]["rows"] == rows


def test_the_frame_is_the_page_itself_and_may_run_scripts_and_nothing_else(
    flight, kick, tmp_path, monkeypatch
):
    frame = Output(flight).frame
    assert frame["srcdoc"] == flight.view(tmp_path / "run.html").read_text(encoding="utf-8")
    assert frame["sandbox"] == "allow-scripts" and int(frame["height"]) > 400 and frame["title"]
    # several motions, without a file
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    both = st.view([flight, flight], None, names=["one", "other"])
    output = Output(both)
    assert list(Path().iterdir()) == [] and output.words == "" and len(repr(both)) < 80
    page = st.view([flight, flight], "both.html", names=["one", "other"])
    assert output.frame | {"srcdoc": ""} == frame | {"srcdoc": ""}
    assert output.frame["srcdoc"] == page.read_text(encoding="utf-8")
    assert shown(st.view(kick, None), tmp_path)[0][0]["rows"] == 601


def test_many_runs_show_the_first_that_began(tmp_path):
    def tired(t, q, v):
        if t > 0.01 and q[2] > 1:
            raise st.SimulationError("it is tired")
        return np.zeros(4)

    q = np.tile([0, 0, 0.5, 1, 0, 0, 0, 0.1, 0, 0, 0], (6, 1))
    q[1, 2] = 2
    how = {"controller": tired, "t_span": 0.02}
    runs = st.simulate(zoo.model("arcs2"), q, np.zeros(10), **how)
    begun, _ = shown(runs, tmp_path)
    assert Output(runs).words == repr(runs) and "1 failed, the first run 1" in repr(runs)
    assert [run["name"] for run in begun] == ["run 0", "run 1", "run 2"]
    assert begun[0]["rows"] == begun[2]["rows"] == 21 > begun[1]["rows"] > 1


def test_without_a_page_a_line_says_why(flight, monkeypatch, tmp_path):
    loaded = st.Trajectory.load(flight.save(tmp_path / "flight.npz"))
    lost = dataclasses.replace(plan().trajectory, model=None)
    for thing, words in (
        (loaded, "has no model"),
        (silent(), "without 'tail_points'"),
        (dataclasses.replace(plan(), trajectory=lost), "no model"),
    ):
        output = Output(thing)
        assert output.frame is None and words in output.words
        assert output.words.startswith(repr(thing))
    odd = dataclasses.replace(loaded, info={"method": None})
    assert Output(odd).words.startswith("<Trajectory of a tail")
    monkeypatch.setattr(viewer, "PAGE", tmp_path / "none.html")
    assert "not built" in Output(flight).words
