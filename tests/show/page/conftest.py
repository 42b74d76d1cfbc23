"""Motions to show: the kick on the ground, flights, and a plan."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from tests.motion.conftest import simulated
from tests.support import page, zoo


@pytest.fixture(autouse=True)
def built():
    page.need(page.need_page)


@pytest.fixture(scope="module")
def browser():
    chromium = pytest.importorskip("tests.support.chromium")
    page.need(chromium.need_chromium)
    with chromium.chromium() as driver:
        yield driver


@pytest.fixture
def kick():
    return simulated("kick")


def flown(model, samples=41):
    """A tumble of a model."""
    q = np.concatenate([[0, 0, 0.5, 1, 0, 0, 0], 0.3 * np.cos(np.arange(model.layout.nt))])
    v = np.concatenate([[0, 0, 1, 9, 1, 2], np.zeros(model.layout.nt)])
    step = 0.2 / (samples - 1)
    return st.simulate(model, q, v, controller=st.Damping(1e-3), t_span=0.2, output_step=step)


@pytest.fixture
def flight():
    """41 samples of a flight of a continuum tail."""
    return flown(zoo.model("arcs2"))


@cache
def plan():
    """A plan that straightens a tail while the torso turns as it likes."""
    q = np.array([0, 0, 0, 1, 0, 0, 0, 0.4, 0])
    goal = st.Goal(attitude=None, tail=(0.0, 0.0))
    settings = {"duration": 0.2, "mesh": st.Mesh(intervals=4, rounds=0)}
    settings["tolerances"] = st.Tolerances(attitude=None)
    return st.plan(zoo.model("m1_n3"), start=(q, np.zeros(8)), goal=goal, **settings)
