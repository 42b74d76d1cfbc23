"""Laws of sampled motions: interpolation against analytic motions, files bit by bit, angles by
inversion.
"""

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from serpentail.attitude import pitch_roll_yaw, rotation_matrix

from .analytic import top


def euler(angles):
    """R = Rz(phi_z) Rx(phi_x) Ry(phi_y) of angles (..., 3) ordered x, y, z."""
    return Rotation.from_euler("ZXY", angles[..., [2, 0, 1]].reshape(-1, 3)).as_matrix()


def configurations(quaternion):
    """Configurations (..., 7) with these attitudes."""
    return np.concatenate([np.zeros((*quaternion.shape[:-1], 3)), quaternion], axis=-1)


def test_rotation_matrix_agrees_with_scipy():
    quaternion = np.random.default_rng(3).normal(size=(4, 50, 4))
    expected = Rotation.from_quat(quaternion.reshape(-1, 4)[:, [1, 2, 3, 0]]).as_matrix()
    np.testing.assert_allclose(
        rotation_matrix(quaternion).reshape(-1, 3, 3), expected, rtol=0, atol=1e-15
    )


def test_pitch_roll_yaw_inverts_the_product_of_rotations():
    quaternion = np.random.default_rng(4).normal(size=(5, 200, 4))
    angles = pitch_roll_yaw(configurations(quaternion))
    assert angles.shape == (5, 200, 3)
    assert np.abs(angles[..., 0]).max() <= np.pi / 2
    np.testing.assert_allclose(
        euler(angles), rotation_matrix(quaternion).reshape(-1, 3, 3), rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_about_one_axis_is_that_angle(axis):
    quaternion = np.zeros(4)
    quaternion[0], quaternion[1 + axis] = np.cos(0.35), np.sin(0.35)
    np.testing.assert_allclose(
        pitch_roll_yaw(configurations(quaternion)), 0.7 * np.eye(3)[axis], rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("short", [0, 1e-3, 1e-8, 1e-12])
def test_pitch_roll_yaw_inverts_near_the_singularity(short):
    angles = np.stack(np.broadcast_arrays(np.pi / 2 - short, 0.4, np.linspace(-3, 3, 50)), axis=-1)
    rotation = euler(angles)
    quaternion = Rotation.from_matrix(rotation).as_quat()[:, [3, 0, 1, 2]]
    np.testing.assert_allclose(
        euler(pitch_roll_yaw(configurations(quaternion))), rotation, rtol=0, atol=2e-15
    )


def test_unwrapped_pitch_counts_the_turns_of_a_somersault():
    angle = np.linspace(0, 5 * np.pi, 300)
    quaternion = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)
    unwrapped = pitch_roll_yaw(configurations(quaternion), unwrap=True)
    np.testing.assert_allclose(
        unwrapped, np.stack([angle, 0 * angle, 0 * angle], axis=1), rtol=0, atol=1e-12
    )


def test_unwrapped_angles_are_continuous_and_still_the_attitude():
    t = np.linspace(0, 2, 4001)
    attitude, _ = top(t)
    unwrapped = pitch_roll_yaw(configurations(attitude), unwrap=True)
    assert np.abs(np.diff(unwrapped, axis=0)).max() < 0.1
    np.testing.assert_allclose(euler(unwrapped), rotation_matrix(attitude), rtol=0, atol=2e-14)


@pytest.mark.parametrize("step", [0.05, 0.4, 4.0])
def test_unwrapped_angles_are_the_nearest_to_those_before(step):
    walk = np.cumsum(step * np.random.default_rng(7).normal(size=(200, 4)), axis=0)
    unwrapped = pitch_roll_yaw(configurations(walk), unwrap=True)
    once = pitch_roll_yaw(configurations(walk))
    turns = 2 * np.pi * np.arange(-9, 10)
    for before, angles, found in zip(unwrapped, once[1:], unwrapped[1:], strict=False):
        other = [np.pi - angles[0], angles[1] + np.pi, angles[2] + np.pi]
        ways = [np.add.outer(branch, turns) - before[:, None] for branch in (angles, other)]
        nearest = min(np.abs(way).min(axis=1).sum() for way in ways)
        assert np.abs(found - before).sum() == pytest.approx(nearest, abs=1e-9)
    np.testing.assert_allclose(euler(unwrapped), rotation_matrix(walk), rtol=0, atol=1e-13)


def test_many_samples_are_unwrapped_at_once():
    angle = np.linspace(0, 3e4, 300_000)
    quaternion = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)
    begun = time.process_time()
    pitch = pitch_roll_yaw(configurations(quaternion), unwrap=True)[:, 0]
    assert time.process_time() - begun < 3.0
    np.testing.assert_allclose(pitch, angle, rtol=0, atol=1e-9)


def test_no_sample_is_no_angle():
    assert pitch_roll_yaw(np.zeros((0, 9)), unwrap=True).shape == (0, 3)


def test_unwrapping_needs_a_time_axis():
    with pytest.raises(ValueError, match=r"give \(K, 7 \+ 2m\)"):
        pitch_roll_yaw(np.array([0, 0, 0, 1.0, 0, 0, 0]), unwrap=True)
