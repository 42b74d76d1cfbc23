"""Attitudes: products, rates, and angles by inversion of the product of rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from serpentail.attitude import pitch_roll_yaw, product, quaternion_rate, rotation_matrix
from tests.support.rows import row

from .conftest import top

RNG = np.random.default_rng(5)
A, B = RNG.normal(size=(2, 7, 4))


def scipys(quaternion):
    """The rotations of (w, x, y, z) as SciPy has them."""
    return Rotation.from_quat(np.roll(quaternion.reshape(-1, 4), -1, axis=-1))


def euler(angles):
    """R = Rz(phi_z) Rx(phi_x) Ry(phi_y) of angles (..., 3) ordered x, y, z."""
    return Rotation.from_euler("ZXY", angles[..., [2, 0, 1]].reshape(-1, 3)).as_matrix()


def configurations(quaternion):
    """Configurations (..., 7) with these attitudes."""
    return np.concatenate([np.zeros((*quaternion.shape[:-1], 3)), quaternion], axis=-1)


def near(found, expected, most):
    np.testing.assert_allclose(found, expected, rtol=0, atol=most)


def test_a_product_turns_as_one_rotation_after_the_other():
    entries = np.stack(product(A.T, B.T), axis=-1)
    near(rotation_matrix(entries), (scipys(A) * scipys(B)).as_matrix(), 1e-14)
    norms = np.linalg.norm(A, axis=-1) * np.linalg.norm(B, axis=-1)
    np.testing.assert_allclose(np.linalg.norm(entries, axis=-1), norms, rtol=1e-14)
    one, i, j, k = np.eye(4)
    for a, b, expected in ((i, j, k), (j, k, i), (k, i, j), (i, i, -one), (j, i, -k)):
        np.testing.assert_array_equal(product(a, b), expected)


def test_a_rate_is_the_derivative_of_the_attitude():
    step = 1e-5
    omega = RNG.normal(size=(7, 3))
    unit = A / np.linalg.norm(A, axis=-1, keepdims=True)
    rate = np.stack(quaternion_rate(unit.T, omega.T), axis=-1)
    slope = (rotation_matrix(unit + step * rate) - rotation_matrix(unit - step * rate)) / (2 * step)
    x, y, z = np.moveaxis(omega, -1, 0)
    cross = np.stack([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]]).transpose(2, 0, 1)
    near(slope, rotation_matrix(unit) @ cross, 1e-8)


def test_angles_invert_the_product_of_rotations():
    """Of any shape, about single axes, and near the pitch where roll and yaw are not unique."""
    quaternion = np.random.default_rng(4).normal(size=(5, 200, 4))
    rotation = rotation_matrix(quaternion).reshape(-1, 3, 3)
    near(rotation, scipys(quaternion).as_matrix(), 1e-15)
    angles = pitch_roll_yaw(configurations(quaternion))
    assert angles.shape == (5, 200, 3) and np.abs(angles[..., 0]).max() <= np.pi / 2
    near(euler(angles), rotation, 1e-15)
    single = np.hstack([np.full((3, 1), np.cos(0.35)), np.sin(0.35) * np.eye(3)])
    near(pitch_roll_yaw(configurations(single)), 0.7 * np.eye(3), 1e-15)
    for short in (0, 1e-3, 1e-8, 1e-12):
        turns = np.broadcast_arrays(np.pi / 2 - short, 0.4, np.linspace(-3, 3, 50))
        rotation = euler(np.stack(turns, axis=-1))
        steep = np.roll(Rotation.from_matrix(rotation).as_quat(), 1, axis=-1)
        with row("short of the pole by", short):
            near(euler(pitch_roll_yaw(configurations(steep))), rotation, 2e-15)


def test_unwrapped_pitch_counts_the_turns_of_a_somersault():
    """Also over so many samples that they must be unwrapped at once, without loss of digits."""
    for end, count, most in ((5 * np.pi, 300, 1e-12), (3e4, 3 * 10**5, 1e-9)):
        turn = np.linspace(0, end, count)
        quaternion = np.stack([np.cos(turn / 2), np.sin(turn / 2), 0 * turn, 0 * turn], axis=1)
        found = pitch_roll_yaw(configurations(quaternion), unwrap=True)
        near(found, np.stack([turn, 0 * turn, 0 * turn], axis=1), most)
    # a time axis is needed, but may have no sample
    assert pitch_roll_yaw(np.zeros((0, 9)), unwrap=True).shape == (0, 3)
    with pytest.raises(ValueError, match="1 dimensions"):
        pitch_roll_yaw(np.array([0, 0, 0, 1.0, 0, 0, 0]), unwrap=True)


def test_unwrapped_angles_are_continuous_the_attitude_and_nearest_to_those_before():
    attitude, _ = top(np.linspace(0, 2, 4001))
    unwrapped = pitch_roll_yaw(configurations(attitude), unwrap=True)
    assert np.abs(np.diff(unwrapped, axis=0)).max() < 0.1
    near(euler(unwrapped), rotation_matrix(attitude), 2e-14)
    turns = 2 * np.pi * np.arange(-9, 10)
    for step in (0.05, 0.4, 4.0):
        walk = np.cumsum(step * np.random.default_rng(7).normal(size=(200, 4)), axis=0)
        unwrapped = pitch_roll_yaw(configurations(walk), unwrap=True)
        once = pitch_roll_yaw(configurations(walk))
        for before, angles, found in zip(unwrapped, once[1:], unwrapped[1:], strict=False):
            other = [np.pi - angles[0], angles[1] + np.pi, angles[2] + np.pi]
            ways = [np.add.outer(branch, turns) - before[:, None] for branch in (angles, other)]
            nearest = min(np.abs(way).min(axis=1).sum() for way in ways)
            assert np.abs(found - before).sum() == pytest.approx(nearest, abs=1e-9), step
        near(euler(unwrapped), rotation_matrix(walk), 1e-13)
