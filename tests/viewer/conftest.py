"""Motions to show: the kick on the ground, and flights."""

import dataclasses
from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.scenes.simulate import scenario
from serpentail_codegen.scene.parse import load_scene
from tests.support import page
from tests.support.models import folder_of, model_folder
from tests.support.scenes import SCENES

MEASURES = ("kinetic", "potential", "linear_momentum", "angular_momentum")
SHOWN = ["energy", "momentum", "rollout", "tail_points", "center_of_mass"]


@pytest.fixture(autouse=True)
def built():
    """The page."""
    page.need(page.need_page)


@cache
def scene_of(name):
    path = SCENES / f"{name}.toml"
    return scenario(path, folder_of(load_scene(path)))


@cache
def simulated(name):
    return scene_of(name).simulate()


@pytest.fixture
def kick_scene():
    return scene_of("kick")


@pytest.fixture
def kick():
    """1201 samples of the kick."""
    return simulated("kick")


@cache
def model_of(segments, links, functions=(*SHOWN,)):
    return st.load(model_folder(segments, links, functions=[*functions]))


def flown(model, samples=41, spin=9.0):
    """A tumble of a model."""
    q = np.concatenate([[0, 0, 0.5, 1, 0, 0, 0], 0.3 * np.cos(np.arange(model.layout.nt))])
    v = np.concatenate([[0, 0, 1, spin, 1, 2], np.zeros(model.layout.nt)])
    step = 0.2 / (samples - 1)
    return st.simulate(model, q, v, controller=st.Damping(1e-3), t_span=0.2, output_step=step)


@pytest.fixture
def flight():
    """41 samples of a flight of a continuum tail."""
    return flown(model_of(2, None))


@pytest.fixture
def single(flight):
    """Its first sample alone."""
    return dataclasses.replace(
        flight, **{n: getattr(flight, n)[:1] for n in ("t", "q", "v", "tau", *MEASURES)}
    )
