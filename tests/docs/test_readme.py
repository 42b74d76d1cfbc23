"""The README: short, and true as pasted."""

import re

import numpy as np
import pytest
from scipy.integrate import simpson

import serpentail as st
from tests.docs.blocks import PAGES, blocks
from tests.docs.running import run_page
from tests.docs.test_blocks import of_c, of_python

README = PAGES["README"].read_text(encoding="utf-8")


def test_it_is_little_more_than_a_screen():
    assert len(README.splitlines()) <= 110
    lines = {
        block.language: len(block.text.splitlines())
        for block in blocks(PAGES["README"])
        if block.language in ("python", "c")
    }
    assert lines["python"] <= 12 and lines["c"] <= 15


def test_its_figures_are_those_of_the_benchmarks():
    table = README.split("## How fast, how accurate")[1].split("## ")[0]
    rows = re.findall(r"^\| (?!what|---)(.*) \|$", table, re.MULTILINE)
    measured = PAGES["benchmarks"].read_text(encoding="utf-8")
    assert len(rows) == 5
    for row in rows:
        for number in re.findall(r"(?<![\w.-])\d[\d.e-]*(?:x| us| ms)?(?![\w.])", row):
            bare = number.removesuffix(" us")
            assert bare in measured, (row, number)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """What the README's blocks left, all of them run in order."""
    return run_page(PAGES["README"], tmp_path_factory.mktemp("readme"))


@pytest.mark.slow
def test_the_ten_lines_do_what_they_say(ran):
    of_python(ran)
    (height,) = re.findall(r"after 0.5 s: height (\S+) m", ran.printed)
    fallen = 0.3 + 2 * 0.5 - 9.8 / 2 * 0.5**2
    assert float(height) == pytest.approx(fallen, abs=0.1)  # of B, not of the centre of mass
    assert {"flight.html", "leap.html"} <= {path.name for path in ran.folder.iterdir()}


@pytest.mark.slow
def test_the_ten_lines_of_c_agree_with_python(ran):
    (ran.folder / "fall").stat()
    of_c(ran)


@pytest.mark.slow
def test_the_demo_writes_its_files(ran):
    demo = ran.folder / "output" / "demo"
    for scene in ("kangaroo_rat_m1_n3", "kangaroo_rat_m3_n4"):
        flight = st.Trajectory.load(demo / f"{scene}.npz")
        assert flight.t[-1] == pytest.approx(0.58)
        damped = simpson(-np.sum(flight.tau * flight.v[:, 6:], axis=1), x=flight.t)
        assert flight.energy[0] - flight.energy[-1] == pytest.approx(damped, rel=1e-3)
        for picture in ("film", "time"):
            assert (demo / f"{scene}_{picture}.png").read_bytes()[:4] == b"\x89PNG"
    for picture in ("kick_film.png", "righting_film.png"):
        assert (demo / picture).read_bytes()[:4] == b"\x89PNG"
    assert (demo / "righting.gif").read_bytes()[:6] == b"GIF89a"
    assert "0.00 deg with the planned tail" in ran.printed
    drifts = re.findall(r"constant to (\S+),", ran.printed)
    differences = re.findall(r"differ by (\S+) at most", ran.printed)
    assert len(drifts) == 4
    assert max(map(float, drifts)) < 1e-9
    assert max(map(float, differences)) < 1e-8
