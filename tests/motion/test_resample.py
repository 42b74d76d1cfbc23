"""Motions between their samples, against analytic motions."""

import dataclasses

import numpy as np
import pytest

from serpentail.attitude import rotation_matrix
from tests.support.rows import row

from .analytic import assert_same, motion


def test_resample_reproduces_the_samples(flight):
    again = flight.resample(flight.t)
    assert again.info == flight.info
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(flight, name), rtol=0, atol=4e-16)
    for name in ("v", "kinetic", "potential", "linear_momentum", "angular_momentum"):
        np.testing.assert_allclose(
            getattr(again, name), getattr(flight, name), rtol=1e-14, atol=1e-15
        )


def errors(trajectory):
    """Largest errors of attitude (rad), tail and velocities."""
    truth = motion(trajectory.t)
    turn = rotation_matrix(truth.attitude).swapaxes(1, 2) @ rotation_matrix(trajectory.attitude)
    angle = np.linalg.norm(turn - np.eye(3), axis=(1, 2)).max() / np.sqrt(2)
    return np.array(
        [angle, np.abs(trajectory.tail - truth.tail).max(), np.abs(trajectory.v - truth.v).max()]
    )


def test_resample_converges_to_the_free_top_and_the_sines():
    fine = np.linspace(0, 0.4, 1234)
    coarse, half = (errors(motion(np.linspace(0, 0.4, n)).resample(fine)) for n in (41, 81))
    assert coarse[0] < 2e-5
    np.testing.assert_allclose(np.log2(coarse / half)[:2], 4, atol=0.1)
    assert np.log2(coarse / half)[2] > 3.5 and coarse[2] < 1e-3


def test_resample_is_exact_for_a_parabolic_flight_and_keeps_unit_quaternions(flight):
    t = np.linspace(0, 0.4, 997)
    dense = flight.resample(t)
    np.testing.assert_allclose(dense.q[:, :3], motion(t).q[:, :3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(dense.v[:, :3], motion(t).v[:, :3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(dense.attitude, axis=1), 1, rtol=0, atol=4e-16)
    # whatever the signs of the quaternions
    q = flight.q.copy()
    q[1:, 3:7] *= np.random.default_rng(2).choice([-1.0, 1.0], len(q) - 1)[:, None]
    np.testing.assert_array_equal(dataclasses.replace(flight, q=q).resample(t).q, dense.q)


def test_torque_is_linear_and_energies_do_not_overshoot(flight):
    t = np.linspace(0, 0.4, 777)
    step = np.where(flight.t < 0.2, 0.0, 1.0)
    dense = dataclasses.replace(flight, kinetic=step).resample(t)
    assert dense.kinetic.min() == 0 and dense.kinetic.max() == 1
    expected = np.stack([np.interp(t, flight.t, column) for column in flight.tau.T], axis=1)
    np.testing.assert_allclose(dense.tau, expected, rtol=0, atol=1e-14)


def test_no_motion_goes_on_beyond_its_samples(flight):
    """The first time outside is named; what rounding adds at the ends is inside."""
    for t, first in (([0.1, 0.5, 0.6], "0.5"), ([-0.25, 0.1], "-0.25")):
        with pytest.raises(ValueError, match=f"t = {first} s .* 0.0 to 0.4"):
            flight.resample(t)
    for samples in (1, 2, 41):
        short = motion(np.linspace(0.4, 0, samples)[::-1])
        for beyond in (-1e-3, -1e-9, 0.4 + 1e-9, 0.401, 1e9, -1e300):
            for t in ([beyond], sorted([0.4, beyond])):
                with row(samples, t), pytest.raises(ValueError, match="outside"):
                    short.resample(t)
    assert flight.resample([0.0, np.nextafter(0.4, 1)]).t[-1] == 0.4


def test_bad_times_are_errors(flight):
    for t in ([], [0.2, 0.1], [[0.1, 0.2]], [np.nan], 0.1):
        with row(t), pytest.raises(ValueError, match=r"^t"):
            flight.resample(t)


def test_one_sample_and_no_tail_resample_too():
    alone = motion(np.array([0.1]), segments=0)
    again = alone.resample([0.1])
    np.testing.assert_allclose(again.q, alone.q, rtol=0, atol=4e-16)
    assert_same(dataclasses.replace(again, q=alone.q), alone)
    assert motion(np.linspace(0, 1, 101), segments=0).resample([0.5]).tau.shape == (1, 0)
