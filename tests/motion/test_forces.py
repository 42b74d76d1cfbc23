"""Forces and impulses of the ground, against sums by hand and the change of momentum."""

import numpy as np
import pytest

from serpentail.motion.summary import summary

from .conftest import at_height, made, scene_of, simulated

MASS, GRAVITY = 0.10572 + 0.00351, 9.8  # kg of torso and tail, m/s^2: the rat's


@pytest.mark.parametrize("name", ["kick", "tail_support_jump"])
def test_the_ground_s_impulse_is_what_momentum_and_weight_leave(name):
    motion = simulated(name)
    told = summary(motion.model, motion)
    span = motion.t[-1] - motion.t[0]
    expected = motion.linear_momentum[-1] - motion.linear_momentum[0]
    expected[2] += MASS * GRAVITY * span
    np.testing.assert_allclose(told["ground_impulse_N_s"], expected, rtol=0, atol=5e-5)
    assert expected[2] > 1
    # whereas samples of the force 1 ms apart miss what a blow gives
    sampled = np.trapezoid(motion.contact.forces.sum(axis=1)[:, 2], motion.t)
    assert abs(sampled - expected[2]) > 0.1


def test_peaks_by_hand():
    """Forces of feet (right 0 to 2, left 3 to 5) and tail at three samples."""
    model = scene_of("tail_support_jump").model
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
    assert (
        told["peak_foot_force_N"] == pytest.approx(np.sqrt(90)) and told["peak_tail_force_N"] == 2
    )


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
