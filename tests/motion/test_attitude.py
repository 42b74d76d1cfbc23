"""Quaternions: products are rotations one after another, rates are derivatives of attitudes."""

import numpy as np
from scipy.spatial.transform import Rotation

from serpentail.attitude import product, quaternion_rate, rotation_matrix

RNG = np.random.default_rng(5)
A, B = RNG.normal(size=(2, 7, 4))


def scipys(quaternion):
    """The rotation of (w, x, y, z) as SciPy has it."""
    return Rotation.from_quat(np.roll(quaternion, -1, axis=-1))


def test_a_product_turns_as_one_rotation_after_the_other():
    entries = np.stack(product(A.T, B.T), axis=-1)
    expected = (scipys(A) * scipys(B)).as_matrix()
    np.testing.assert_allclose(rotation_matrix(entries), expected, atol=1e-14)
    norms = np.linalg.norm(A, axis=-1) * np.linalg.norm(B, axis=-1)
    np.testing.assert_allclose(np.linalg.norm(entries, axis=-1), norms, rtol=1e-14)


def test_a_product_has_the_table_of_units():
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
    np.testing.assert_allclose(slope, rotation_matrix(unit) @ cross, atol=1e-8)
