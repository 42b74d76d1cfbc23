"""Motions in a notebook: their text and their page in a frame, whatever happens."""

import dataclasses
from html.parser import HTMLParser

import numpy as np
import pytest
from selenium.webdriver.support.ui import WebDriverWait

import serpentail as st
from serpentail.viewer import view as viewer
from tests.support import chromium
from tests.support.chromium import requests
from tests.support.page import data_of, need

from .conftest import flown, model_of

PLANNED = ["energy", "momentum", "rollout", "tail_points", "mass_matrix", "inverse_dynamics"]


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
    data, words = shown(kick, tmp_path)
    assert words == repr(kick)
    (run,) = data["runs"]
    assert run["rows"] == 601  # every second of 1201
    assert run["arrays"]["pose"][-1] == pytest.approx(kick.q[-1, :7], rel=1e-6)
    assert any("one of 2 samples is shown" in note for note in data["notes"])


def test_a_motion_of_601_samples_is_shown_whole(tmp_path):
    """0.6 s at 1 kHz; of one sample more, every second one is shown."""
    model = model_of(1, 2)
    (run,) = shown(flown(model, samples=601), tmp_path)[0]["runs"]
    assert run["rows"] == 601
    (run,) = shown(flown(model, samples=602), tmp_path)[0]["runs"]
    assert run["rows"] == 302


def test_the_frame_is_the_page_itself(flight, tmp_path):
    page = flight.view(tmp_path / "run.html").read_text(encoding="utf-8")
    assert Output(flight._repr_html_()).frame["srcdoc"] == page


def test_the_frame_may_run_scripts_and_nothing_else(flight):
    frame = Output(flight._repr_html_()).frame
    assert frame["sandbox"] == "allow-scripts" and int(frame["height"]) > 400 and frame["title"]


def test_many_runs_show_the_first_that_began(tmp_path):
    def tired(t, q, v):
        if t > 0.01 and q[2] > 1:
            raise st.SimulationError("it is tired")
        return np.zeros(4)

    q = np.tile([0, 0, 0.5, 1, 0, 0, 0, 0.1, 0, 0, 0], (6, 1))
    q[1, 2] = 2
    runs = st.simulate(model_of(2, None), q, np.zeros(10), controller=tired, t_span=0.02)
    data, words = shown(runs, tmp_path)
    assert words == repr(runs) and "1 failed, the first run 1" in words
    assert [run["name"] for run in data["runs"]] == ["run 0", "run 1", "run 2"]
    rows = [run["rows"] for run in data["runs"]]
    assert rows[0] == rows[2] == 201 > rows[1] > 1


def test_a_plan_shows_what_it_does_in_truth(tmp_path):
    model = model_of(1, 3, (*PLANNED,))
    start = np.array([0, 0, 0, 1, 0.1, 0, 0, 0, 0]), np.zeros(8)
    free = st.Goal(attitude=None, torso_rate=None)
    plan = st.plan(model, start=start, goal=free, duration=0.1, tolerance=None, intervals=4)
    data, words = shown(plan, tmp_path)
    assert words == repr(plan)
    assert [run["name"] for run in data["runs"]] == ["planned", "true", "passive"]
    without = dataclasses.replace(plan, trajectory=dataclasses.replace(plan.trajectory, model=None))
    assert "which has no model" in Output(without._repr_html_()).words


def test_several_motions_are_shown_without_a_file(flight, kick, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    both = st.view([flight, flight], None, names=["one", "other"])
    output = Output(both._repr_html_())
    assert list(tmp_path.iterdir()) == [] and output.words == "" and len(repr(both)) < 80
    page = st.view([flight, flight], "both.html", names=["one", "other"])
    assert output.frame["srcdoc"] == page.read_text(encoding="utf-8")
    assert output.frame["sandbox"] == "allow-scripts"
    short = tmp_path / "short.html"
    short.write_text(Output(st.view(kick, None)._repr_html_()).frame["srcdoc"], encoding="utf-8")
    assert [run["rows"] for run in data_of(short)["runs"]] == [601]  # every second of 1201
    with pytest.raises(st.ViewError, match="names"):
        st.view([flight, flight], None, names=["one"])


def test_without_a_page_a_line_says_why(flight, monkeypatch, tmp_path):
    loaded = st.Trajectory.load(flight.save(tmp_path / "flight.npz"))
    silent = flown(model_of(1, 2, ("energy", "momentum", "rollout")))
    for motion, words in [
        (loaded, "which has no model"),
        (silent, "without &#x27;tail_points&#x27;"),
    ]:
        html = motion._repr_html_()
        assert Output(html).frame is None and words in html
        assert Output(html).words.startswith(repr(motion))
    monkeypatch.setattr(viewer, "PAGE", tmp_path / "none.html")
    assert "the page was not built" in Output(flight._repr_html_()).words


@pytest.mark.parametrize("info", [{"events": 3, "warnings": {"a": 1}}, {"method": None}, {}])
def test_whatever_a_motion_says_of_itself(flight, info):
    motion = dataclasses.replace(flight, info=info, model=None)
    assert Output(motion._repr_html_()).words.startswith("<Trajectory of a tail")


def test_it_runs_in_a_browser_and_fetches_nothing(kick, tmp_path):
    """A page with two outputs, as a notebook has them."""
    need(chromium.need_chromium)
    notebook = tmp_path / "notebook.html"
    body = f"<p>A motion</p>{kick._repr_html_()}<p>again</p>{kick._repr_html_()}"
    text = f'<!doctype html><meta charset="utf-8"><body>{body}</body>'
    notebook.write_text(text, encoding="utf-8")
    done = "return window.serpentail && (serpentail.ready || serpentail.error)"
    with chromium.chromium() as driver:
        driver.get(notebook.as_uri())
        for frame in driver.find_elements("css selector", "iframe"):
            driver.switch_to.frame(frame)
            WebDriverWait(driver, 60).until(lambda browser: browser.execute_script(done))
            assert driver.execute_script("return serpentail.error") is None
            driver.execute_script("serpentail.seek(0.6)")
            time = driver.execute_script("return Number(document.getElementById('time').value)")
            assert time == pytest.approx(0.6, abs=0.003)
            assert driver.execute_script("return origin") == "null"
            driver.switch_to.default_content()
        assert driver.get_log("browser") == []
        ours = (notebook.as_uri(), "about:srcdoc")
        assert [each for each in requests(driver) if each not in ours] == []
