"""Motions to convert: a flight of known functions, drops on the ground, runs that end early."""

import numpy as np
import pytest

import serpentail as st
from tests.motion.conftest import motion
from tests.support import zoo

SETTINGS = {"legs": st.Legs.fixed(3.6, -0.3), "output_step": 0.002, "rtol": 1e-6}


def tired(t, q, v):
    """A controller that gives up at 0.01 s, above 1 m."""
    if t > 0.01 and q[2] > 1:
        raise st.SimulationError("it is tired")
    return np.zeros(2)


@pytest.fixture
def flight():
    """An analytic motion without a model."""
    return motion(np.linspace(0, 0.4, 41))


@pytest.fixture(scope="module")
def drop():
    """A rat that falls on its feet."""
    q = [0, 0, 0.06, 1, 0, 0, 0, 0.1, 0]
    return st.simulate(zoo.model("feet_tail"), q, np.zeros(8), t_span=0.1, **SETTINGS)


@pytest.fixture(scope="module")
def runs():
    """Three runs with frictions of their own; run 1 fails at 0.01 s, run 2 never gets off."""
    q = np.tile([0, 0, 0.06, 1, 0, 0, 0, 0.1, 0], (3, 1))
    q[1, 2] = 2
    own = {"mu": [0.1, 0.2, 0.3], "tail_mount": np.tile([0, -0.04, 0.004], (3, 1))}
    settings = {"parameters": own, "controller": tired, "t_span": 0.04, **SETTINGS}
    return st.simulate(zoo.model("feet_tail"), q, np.zeros(8), **settings)
