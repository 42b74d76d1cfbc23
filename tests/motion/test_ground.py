"""The ground's forces and impulses, against sums by hand and the change of momentum; feet that
slide until friction stops them: their path is v^2 / (2 mu g).
"""

import dataclasses

import numpy as np
import pytest

import serpentail as st
from serpentail.motion.summary import summary
from tests.support import zoo

from .conftest import at_height, made

MASS, GRAVITY = 0.10572 + 0.00351, 9.8  # kg of torso and tail, m/s^2: the rat's
MU, SPEED = 0.05, 0.3
LEGS = st.Legs.fixed(np.radians(210), np.radians(-15))


def test_the_ground_s_impulse_is_what_momentum_and_weight_leave(kick, leap):
    for motion in (kick, leap):
        told = summary(motion.model, motion)
        span = motion.t[-1] - motion.t[0]
        expected = motion.linear_momentum[-1] - motion.linear_momentum[0]
        expected[2] += MASS * GRAVITY * span
        np.testing.assert_allclose(told["ground_impulse_N_s"], expected, rtol=0, atol=5e-5)
        assert expected[2] > 1
        # whereas samples of the force 1 ms apart miss what a blow gives
        sampled = np.trapezoid(motion.contact.forces.sum(axis=1)[:, 2], motion.t)
        assert abs(sampled - expected[2]) > 0.1


def test_peaks_by_hand(leap):
    """Forces of feet (right 0 to 2, left 3 to 5) and tail at three samples."""
    model = leap.model
    forces = np.zeros((3, 18, 3))
    forces[0, 0], forces[0, 3] = (3, 0, 4), (0, 0, 5)  # a pair: (3, 0, 9)
    forces[1, 1], forces[1, 5] = (0, 0, 8), (0, 6, 0)  # right 8, left 6, both 10
    forces[2, 2], forces[2, 7], forces[2, 17] = (0, 0, 1), (0, 0, 2), (2, 0, 0)
    told = summary(model, made(model, at_height(model, 0.1), forces=forces))
    weight = MASS * GRAVITY
    group = {"feet": 10, "tail": np.sqrt(8), "right_foot": 8, "left_foot": 6}
    assert told["peak_ground_force_N"] == 10
    assert told["peak_ground_force_weights"] == pytest.approx(10 / weight)
    assert told["body_weight_N"] == pytest.approx(weight)
    assert told["peak_group_force_N"] == pytest.approx(group)
    weights = {name: force / weight for name, force in group.items()}
    assert told["peak_group_force_weights"] == pytest.approx(weights)
    assert told["peak_foot_force_N"] == pytest.approx(np.sqrt(90))
    assert told["peak_tail_force_N"] == 2


def test_the_kick_s_peak_is_of_both_feet_together(kick):
    told = summary(kick.model, kick)
    every = np.linalg.norm(kick.contact.forces.sum(axis=1), axis=1).max()
    assert told["peak_ground_force_N"] == pytest.approx(every) == pytest.approx(764, abs=20)
    assert told["peak_ground_force_weights"] == pytest.approx(every / MASS / GRAVITY)
    assert told["peak_ground_force_N"] > 1.7 * told["peak_foot_force_N"]


def test_without_gravity_there_are_no_body_weights(kick):
    model = kick.model.with_parameters(gravity=0.0)
    told = summary(model, kick)
    assert told["peak_ground_force_N"] > 700 and told["com_rise_m"] is None
    assert told["body_weight_N"] is told["peak_ground_force_weights"] is None
    assert set(told["peak_group_force_weights"].values()) == {None}
    assert not any("body weights" in each for each in told["warnings"])


def test_forces_that_overflow_are_no_numbers(rat):
    forces = np.zeros((2, 6, 3))
    forces[1] = 1e308
    told = summary(rat, made(rat, at_height(rat, 0.1, 2), forces=forces))
    assert told["peak_ground_force_N"] is told["peak_group_force_N"]["feet"] is None


# Slips.


def slid(name, speed, mu):
    """Paths of a rat that comes to rest on the ground, and is then pushed along x."""
    model = zoo.model(name).with_parameters(mu=mu)
    settings = {"legs": LEGS, "controller": st.Damping(1e-3)}
    q, v, bristles = st.settle(
        model, at_height(model, 0.06, 1)[0], rounds=3, duration=0.4, **settings
    )
    v[0] = speed
    motion = st.simulate(model, q, v, bristles0=bristles, t_span=0.8, output_step=2e-3, **settings)
    return summary(model, motion)["slip_m"]


def test_the_path_of_sliding_feet_tail_and_torso():
    """Who sticks does not slip, although its springs stretch. With the paper's friction it is the
    path of the point: its springs pull it back, so that it is longer than a sliding block's way.
    """
    wanted = SPEED**2 / (2 * MU * GRAVITY)
    found = slid("ground", SPEED, MU)
    assert found == pytest.approx(dict.fromkeys(["feet", "tail", "torso"], wanted), rel=0.01)
    assert max(slid("ground", 0.01, mu=1.0).values()) < 1e-4
    assert slid("paper", SPEED, MU)["feet"] > wanted


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
    points, forces = np.zeros((2, 3, 6, 3))
    points[:, 0, 0] = [0, 1, 3]
    assert summary(rat, made(rat, q, points=points, forces=forces))["slip_m"] == {"feet": 0.0}
    forces[1:, 0, 2] = 1
    assert summary(rat, made(rat, q, points=points, forces=forces))["slip_m"] == {"feet": 2.0}
