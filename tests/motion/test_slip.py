"""Feet that slide until friction stops them: their path is v^2 / (2 mu g)."""

import dataclasses

import numpy as np
import pytest

import serpentail as st
from serpentail.motion.summary import summary

from .conftest import at_height, made

MU, SPEED, GRAVITY = 0.05, 0.3, 9.81
LEGS = st.Legs.fixed(np.radians(210), np.radians(-15))


def slid(contacts, speed, **changes):
    """A rat that comes to rest on the ground, and is then pushed along x."""
    names = ["contact_points", "contact_dynamics", "rollout", "energy", "momentum", "implicit"]
    model = st.build("contact_m1_n3", contacts=contacts, functions=names, **changes)
    settings = {"legs": LEGS, "controller": st.Damping(1e-3)}
    q, v, bristles = st.settle(
        model, at_height(model, 0.06, 1)[0], rounds=3, duration=0.4, **settings
    )
    v[0] = speed
    motion = st.simulate(model, q, v, bristles0=bristles, t_span=0.8, output_step=2e-3, **settings)
    return summary(model, motion)["slip_m"]


def test_the_path_of_sliding_feet_tail_and_torso():
    found = slid(["feet", "tail", "torso"], SPEED, mu=MU)
    wanted = SPEED**2 / (2 * MU * GRAVITY)
    assert found == pytest.approx(dict.fromkeys(["feet", "tail", "torso"], wanted), rel=0.01)


def test_who_sticks_does_not_slip_although_its_springs_stretch():
    found = slid(["feet", "tail", "torso"], 0.01, mu=1.0)
    assert max(found.values()) < 1e-4


def test_the_paper_s_friction_counts_the_path_of_the_point():
    """Its springs pull the points back: the path is longer than the way of a sliding block."""
    found = slid(["feet"], SPEED, mu=MU, friction="paper")
    assert found["feet"] > SPEED**2 / (2 * MU * GRAVITY)


def test_a_rolling_torso_does_not_slip_and_a_spinning_one_does(rat):
    """A sphere of radius 2 cm that rolls along x by 3 rad in 1 s; then the same without rolling."""
    t, radius, turn = np.linspace(0, 1, 501), 0.02, 3.0
    for rolls in (True, False):
        q = at_height(rat, radius, len(t))
        q[:, 0] = radius * turn * t * rolls
        half = turn * t / 2
        q[:, 3:7] = np.stack([np.cos(half), 0 * t, np.sin(half), 0 * t], axis=1)
        points = q[:, None, :3] * [1, 1, 0]
        v = np.zeros((len(t), rat.nv))
        v[:, 0], v[:, 4] = radius * turn * rolls, turn
        forces = np.zeros_like(points)
        forces[..., 2] = 1.0
        contact = st.Contact(points, forces, np.zeros((len(t), 1, 2)), {"torso": 1})
        motion = dataclasses.replace(made(rat, q, t=t), v=v, contact=contact)
        wanted = 0.0 if rolls else radius * turn
        assert summary(rat, motion)["slip_m"]["torso"] == pytest.approx(wanted, abs=1e-6)


def test_a_point_in_the_air_does_not_slip(rat):
    q = at_height(rat, 0.1)
    points = np.zeros((3, 6, 3))
    points[:, 0, 0] = [0, 1, 3]
    forces = np.zeros((3, 6, 3))
    assert summary(rat, made(rat, q, points=points, forces=forces))["slip_m"] == {"feet": 0.0}
    forces[1:, 0, 2] = 1
    assert summary(rat, made(rat, q, points=points, forces=forces))["slip_m"] == {"feet": 2.0}
