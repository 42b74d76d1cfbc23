"""Motions: of functions of time, of the repository's scenes, and made by hand of their models."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.motion.summary import summary
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of
from tests.support.scenes import SCENES

PRECESSION, TILT, SPIN = 7.0, 0.6, 11.0  # rad/s, rad, rad/s of a torque-free symmetric top


def motion(t, segments=2):
    """A torque-free top, R = Rz(a t) Rx(tilt) Rz(b t), in parabolic flight, its tail swinging in
    sines.
    """
    turns = np.stack([PRECESSION * t, TILT + 0 * t, SPIN * t], axis=1)
    rotation = Rotation.from_euler("ZXZ", turns)
    attitude = rotation.as_quat(canonical=False)[:, [3, 0, 1, 2]]
    omega = PRECESSION * rotation.as_matrix()[:, 2, :] + [0, 0, SPIN]  # a R^T z + b z
    phase = 12 * t[:, None] + np.arange(2 * segments)
    position = np.stack([0 * t, 0.6 * t, 2.8 * t - 4.9 * t**2], axis=1)
    rate = np.stack([0 * t, 0.6 + 0 * t, 2.8 - 9.8 * t], axis=1)
    parameters = {"gravity": 9.8, "torso_inertia": (1, 2, 3)}
    return st.Trajectory(
        t=t,
        q=np.hstack([position, attitude, 0.5 * np.sin(phase)]),
        v=np.hstack([rate, omega, 6 * np.cos(phase)]),
        tau=np.sign(np.sin(phase)),
        kinetic=1 + rate[:, 2] ** 2 / 2,
        potential=9.8 * position[:, 2],
        linear_momentum=rate,
        angular_momentum=np.tile([1e-3, 2e-3, 3e-3], (len(t), 1)),
        info={"method": "analytic", "steps": len(t), "parameters": parameters},
    )


def fields(trajectory):
    """The arrays and the info of a flight by name."""
    found = {each.name: getattr(trajectory, each.name) for each in dataclasses.fields(trajectory)}
    return {name: value for name, value in found.items() if value is not None}


@cache
def scene_of(name, **changes):
    path = SCENES / f"{name}.toml"
    return st.scenario(path, folder_of(load_scene(path)), changes)


@cache
def simulated(name):
    return scene_of(name).simulate()


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


def made(model, q=0.1, *, t=None, forces=None, points=None, events=(), legs=None):
    """A motion at rest of configurations (K, nq), or of a level torso at a height; forces (K,
    points, 3) are the ground's, events have kind, group and time.
    """
    if not isinstance(q, np.ndarray):
        like = next((each for each in (t, forces, points) if each is not None), range(3))
        q = at_height(model, q, len(like))
    rows, contact = len(q), None
    if model.contacts:
        count = sum(model.contacts.values())
        forces = np.zeros((rows, count, 3)) if forces is None else forces
        points = np.zeros_like(forces) if points is None else points
        contact = st.Contact(points, forces, np.zeros((rows, count, 2)), model.contacts, legs)
    still = {"v": np.zeros((rows, model.nv)), "tau": np.zeros((rows, model.nv - 6))}
    still |= dict.fromkeys(("kinetic", "potential"), np.zeros(rows))
    still |= dict.fromkeys(("linear_momentum", "angular_momentum"), np.zeros((rows, 3)))
    t = np.arange(float(rows)) if t is None else t
    keys = ("kind", "group", "time")
    info = {"events": [dict(zip(keys, event, strict=True)) for event in events]}
    return st.Trajectory(t=t, q=q, info=info, contact=contact, model=model, **still)


def at_height(model, height, rows=3):
    """Configurations (rows, nq) of a level torso and a straight tail."""
    q = np.zeros((rows, model.nq))
    q[:, 2], q[:, 3] = height, 1
    return q


def told(motion):
    return summary(motion.model, motion)
