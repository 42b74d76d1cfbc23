"""A model with all that other tools differentiate, random states of it, and PyTorch."""

import os
from importlib import import_module

import numpy as np
import pytest

import serpentail as st

from ..support.models import model_folder

NAMES = ["forward_dynamics", "forward_dynamics_derivatives", "inverse_dynamics", "mass_matrix"]
RUNS = 21


@pytest.fixture(scope="session")
def model():
    names = [*NAMES, "inverse_dynamics_derivatives"]
    return st.load(model_folder(2, 2, functions=names))


@pytest.fixture(scope="session")
def states(model):
    """q whose quaternions are of any norm, v and tau, RUNS of each."""
    rng = np.random.default_rng(4)
    q, v = 0.4 * rng.normal(size=(RUNS, model.nq)), rng.normal(size=(RUNS, model.nv))
    q[:, 3] += 1.5
    return q, v, 1e-3 * rng.normal(size=(RUNS, 2 * model.segments))


@pytest.fixture(scope="session")
def jax():
    found = import_module("jax")
    found.config.update("jax_enable_x64", True)
    return found


@pytest.fixture(scope="session")
def torch():
    """PyTorch, which is not in the extra "dev": with libraries for graphics cards it is 5 GB."""
    try:
        return import_module("torch")
    except ImportError:
        why = 'needs PyTorch, 5 GB that "dev" does not bring: pip install "serpentail[torch]"'
        (pytest.fail if os.environ.get("CI") else pytest.skip)(why)


def by_differences(function, x, h=1e-3):
    """Jacobian of a function of one vector, by differences of order 4 each way."""
    columns = []
    for unit in np.eye(len(x)) * h:
        values = [np.asarray(function(x + k * unit)) for k in (-2, -1, 1, 2)]
        columns.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(columns, axis=-1)


def assert_near(found, expected, digits):
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= digits * np.abs(expected).max()
