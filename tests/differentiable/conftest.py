"""A model with all that other tools differentiate, and random states of it."""

import numpy as np
import pytest

from ..support import zoo

RUNS = 21
FUNCTIONS = ("forward_dynamics", "inverse_dynamics")
REFUSED = [  # by both tools: arguments, and what is told of them
    ({"q": np.zeros(10)}, r"forward_dynamics: q has shape \(10,\), not \(\.\.\., 11\)"),
    ({"v": np.zeros((5, 10))}, r"leading axes differ \(\(21, 11\), \(5, 10\), \(21, 4\)\)"),
    ({"tau": np.zeros(4, complex)}, r"forward_dynamics: tau: type .*complex128"),
    ({"tau": np.zeros(4, bool)}, r"forward_dynamics: tau: type .*bool"),
]


@pytest.fixture(scope="session")
def model():
    return zoo.model("m2_n2")


@pytest.fixture(scope="session")
def states():
    """q whose quaternions are of any norm, v and tau, RUNS of each."""
    rng = np.random.default_rng(4)
    q, v = 0.4 * rng.normal(size=(RUNS, 11)), rng.normal(size=(RUNS, 10))
    q[:, 3] += 1.5
    return q, v, 1e-3 * rng.normal(size=(RUNS, 4))


def arguments(states, name):
    """Arguments of a function: its last is tau or v_dot."""
    q, v, tau = states
    return (q, v, tau if name == "forward_dynamics" else 3 * np.roll(v, 1, axis=0))


def by_differences(function, x, h=1e-3):
    """Jacobian of a function of one vector, by differences of order 4 each way."""
    columns = []
    for unit in np.eye(len(x)) * h:
        values = [np.asarray(function(x + k * unit)) for k in (-2, -1, 1, 2)]
        columns.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(columns, axis=-1)


def jacobians(function, given):
    """Jacobians of a function by each of its arguments, by differences."""
    return [
        by_differences(lambda x, k=k: function(*given[:k], x, *given[k + 1 :]), given[k])
        for k in range(len(given))
    ]


def assert_near(found, expected, digits):
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= digits * np.abs(expected).max()
