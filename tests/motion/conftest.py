"""Motions of the repository's scenes, and motions made by hand of their models."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of
from tests.support.scenes import SCENES

from .analytic import motion


@cache
def scene_of(name, **changes):
    path = SCENES / f"{name}.toml"
    return st.scenario(path, folder_of(load_scene(path)), changes)


@cache
def simulated(name):
    return scene_of(name).simulate()


@pytest.fixture
def flight():
    """Forty-one samples of the analytic motion."""
    return motion(np.linspace(0, 0.4, 41))


@pytest.fixture
def kick():
    """1201 samples of the kick: feet touch, tail and torso pass through the ground."""
    return simulated("kick")


@pytest.fixture
def rat():
    """The kick's model: feet touch, torso and tail do not."""
    return scene_of("kick").model


@pytest.fixture
def leap():
    """The jump of (3,4): feet and tail touch."""
    return simulated("tail_support_jump")


def made(model, q, *, t=None, forces=None, points=None, events=(), legs=None):
    """A motion of configurations q (K, nq), at rest, with forces (K, points, 3) of the ground."""
    rows = len(q)
    zeros = np.zeros((rows, 3))
    contact = None
    if model.contacts:
        count = sum(model.contacts.values())
        forces = np.zeros((rows, count, 3)) if forces is None else forces
        points = np.zeros_like(forces) if points is None else points
        contact = st.Contact(points, forces, np.zeros((rows, count, 2)), model.contacts, legs)
    arrays = {
        "t": np.arange(float(rows)) if t is None else t,
        "q": q,
        "v": np.zeros((rows, model.nv)),
        "tau": np.zeros((rows, model.nv - 6)),
        "kinetic": np.zeros(rows),
        "potential": np.zeros(rows),
        "linear_momentum": zeros,
        "angular_momentum": zeros,
    }
    info = {"events": list(events)}
    return st.Trajectory(**arrays, info=info, contact=contact, model=model)


def at_height(model, height, rows=3):
    """Configurations (rows, nq) of a level torso and a straight tail."""
    q = np.zeros((rows, model.nq))
    q[:, 2], q[:, 3] = height, 1
    return q


def down(group, time):
    return {"time": time, "group": group, "kind": "touch_down"}


def off(group, time):
    return {"time": time, "group": group, "kind": "take_off"}
