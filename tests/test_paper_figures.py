"""The paper's figures: numbers that independent computations of its studies gave must come out of the models."""

from itertools import pairwise

import numpy as np
import pytest

import serpentail as st
from models import model_folder

STEPS = 200
DIFFERENCE = {2: -0.148, 4: -0.400, 8: -0.333, 16: -0.211, 32: -0.120}  # deg, articulated less continuum, Fig. 8b


def com_direction(x, y):
    """Angle of a tail's centre of mass from the straight tail, Eq. 49."""
    return np.arctan2(x, -y)


def articulated_com(links, beta):
    """Direction of the COM of n equal links, each turned by beta against the one before."""
    angles = beta * np.arange(1, links + 1)
    middle = np.cumsum(np.stack([np.sin(angles), -np.cos(angles)], axis=1), axis=0)
    middle -= 0.5 * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    return com_direction(*middle.mean(axis=0))


def joint_angle(links, target):
    """The joint angle that gives a COM direction, by bisection."""
    low, high = 0.0, np.pi / links * 1.5
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if articulated_com(links, middle) < target else (low, middle)
    return (low + high) / 2


def continuum_com(theta):
    """Direction of the COM of an arc bent by theta."""
    return np.arctan2(theta - np.sin(theta), 1 - np.cos(theta)) if theta else 0.0


def final_yaw(model, shapes):
    """Yaw (deg) that the torso is left with when the tail goes through shapes at zero momentum."""
    q = np.zeros(model.nq)
    q[3] = 1.0
    for before, after in pairwise(shapes):
        q[8] = (before + after) / 2
        H = model.mass_matrix(q)
        turn = -np.linalg.solve(H[:6, :6], H[:6, 7])[3:] * (after - before)
        q[3:7] = multiplied(q[3:7], turn)
    q[8] = shapes[-1]
    return np.degrees(st.pitch_roll_yaw(q)[2])


def multiplied(quaternion, turn):
    """Quaternion after a small rotation vector in the body frame."""
    angle = np.linalg.norm(turn)
    w, x, y, z = quaternion
    dw = np.cos(angle / 2)
    dx, dy, dz = 0.5 * np.sinc(angle / 2 / np.pi) * turn
    return np.array(
        [
            w * dw - x * dx - y * dy - z * dz,
            w * dx + x * dw + y * dz - z * dy,
            w * dy - x * dz + y * dw + z * dx,
            w * dz + x * dy - y * dx + z * dw,
        ]
    )


@pytest.fixture(scope="module")
def continuum_yaw():
    model = st.load(model_folder(1, None, functions=["mass_matrix"]))
    return final_yaw(model, np.linspace(0, np.pi, STEPS + 1))


def test_the_continuum_turns_the_torso_as_in_fig_8a(continuum_yaw):
    assert continuum_yaw == pytest.approx(-21.450, abs=1e-3)


@pytest.mark.parametrize("links", DIFFERENCE)
def test_the_articulated_tail_differs_as_in_fig_8b(continuum_yaw, links):
    model = st.load(model_folder(1, links, functions=["mass_matrix"]))
    targets = [continuum_com(theta) for theta in np.linspace(0, np.pi, STEPS + 1)]
    yaw = final_yaw(model, np.array([joint_angle(links, target) for target in targets]))
    assert yaw - continuum_yaw == pytest.approx(DIFFERENCE[links], abs=1e-3)
