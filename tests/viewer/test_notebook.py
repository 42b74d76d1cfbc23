"""Motions in a notebook: their text and their page in a frame, whatever happens."""

import dataclasses
from html.parser import HTMLParser

import numpy as np
import pytest

import serpentail as st
from serpentail.viewer import view as viewer
from tests.support import zoo
from tests.support.page import data_of

from .conftest import flown, plan, silent


class Output(HTMLParser):
    """An output as a browser reads it: text outside of the frame, the frame's attributes."""

    def __init__(self, html):
        super().__init__()
        self.words, self.frame = "", None
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        if tag == "iframe":
            self.frame = dict(attributes)

    def handle_data(self, data):
        self.words += data


def shown(thing, tmp_path):
    """The data of the page in an output, and the text above it."""
    html = thing._repr_html_()
    assert len(html) < 1e6
    output = Output(html)
    page = tmp_path / "frame.html"
    page.write_text(output.frame["srcdoc"], encoding="utf-8")
    return data_of(page), output.words


def test_a_motion_is_shown_with_its_text(kick, tmp_path):
    """Up to 601 samples whole, such as 0.6 s at 1 kHz; of more every second one."""
    data, words = shown(kick, tmp_path)
    assert words == repr(kick)
    (run,) = data["runs"]
    assert run["rows"] == 601
    assert run["arrays"]["pose"][-1] == pytest.approx(kick.q[-1, :7], rel=1e-6)
    assert any("one of 2 samples" in note for note in data["notes"])
    for samples, rows in ((601, 601), (602, 302)):
        (run,) = shown(flown(zoo.model("m1_n3"), samples), tmp_path)[0]["runs"]
        assert run["rows"] == rows


def test_the_frame_is_the_page_itself_and_may_run_scripts_and_nothing_else(flight, tmp_path):
    frame = Output(flight._repr_html_()).frame
    assert frame["srcdoc"] == flight.view(tmp_path / "run.html").read_text(encoding="utf-8")
    assert frame["sandbox"] == "allow-scripts" and int(frame["height"]) > 400 and frame["title"]


def test_many_runs_show_the_first_that_began(tmp_path):
    def tired(t, q, v):
        if t > 0.01 and q[2] > 1:
            raise st.SimulationError("it is tired")
        return np.zeros(4)

    q = np.tile([0, 0, 0.5, 1, 0, 0, 0, 0.1, 0, 0, 0], (6, 1))
    q[1, 2] = 2
    runs = st.simulate(zoo.model("arcs2"), q, np.zeros(10), controller=tired, t_span=0.02)
    data, words = shown(runs, tmp_path)
    assert words == repr(runs) and "1 failed, the first run 1" in words
    assert [run["name"] for run in data["runs"]] == ["run 0", "run 1", "run 2"]
    rows = [run["rows"] for run in data["runs"]]
    assert rows[0] == rows[2] == 201 > rows[1] > 1


def test_a_plan_shows_what_it_does_in_truth(tmp_path):
    data, words = shown(plan(), tmp_path)
    assert words == repr(plan())
    assert [run["name"] for run in data["runs"]] == ["planned", "true", "passive"]
    lost = dataclasses.replace(plan().trajectory, model=None)
    without = dataclasses.replace(plan(), trajectory=lost)
    assert "no model" in Output(without._repr_html_()).words


def test_several_motions_are_shown_without_a_file(flight, kick, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    both = st.view([flight, flight], None, names=["one", "other"])
    output = Output(both._repr_html_())
    assert list(tmp_path.iterdir()) == [] and output.words == "" and len(repr(both)) < 80
    page = st.view([flight, flight], "both.html", names=["one", "other"])
    assert output.frame["srcdoc"] == page.read_text(encoding="utf-8")
    assert output.frame["sandbox"] == "allow-scripts"
    assert shown(st.view(kick, None), tmp_path)[0]["runs"][0]["rows"] == 601
    with pytest.raises(st.ViewError, match="names"):
        st.view([flight, flight], None, names=["one"])


def test_without_a_page_a_line_says_why(flight, monkeypatch, tmp_path):
    loaded = st.Trajectory.load(flight.save(tmp_path / "flight.npz"))
    for motion, words in ((loaded, "has no model"), (silent(), "without &#x27;tail_points&#x27;")):
        html = motion._repr_html_()
        assert Output(html).frame is None and words in html
        assert Output(html).words.startswith(repr(motion))
    for info in ({"events": 3, "warnings": {"a": 1}}, {"method": None}, {}):
        motion = dataclasses.replace(flight, info=info, model=None)
        assert Output(motion._repr_html_()).words.startswith("<Trajectory of a tail")
    monkeypatch.setattr(viewer, "PAGE", tmp_path / "none.html")
    assert "not built" in Output(flight._repr_html_()).words
