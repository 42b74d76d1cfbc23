"""JAX and PyTorch as the tests of both see them; neither is imported before a test needs it."""

import numpy as np
import pytest

import serpentail as st


class Jax:
    """Arrays, derivatives and maps of JAX, with 64 bits."""

    functions = staticmethod(st.jax_functions)

    def __init__(self):
        self.jax = pytest.importorskip("jax")
        self.jax.config.update("jax_enable_x64", True)
        self.map = self.jax.vmap

    def arrays(self, values):
        return list(values)

    def jacobians(self, function, given):
        return self.jax.jacrev(function, tuple(range(len(given))))(*given)


class Torch:
    """The same of PyTorch, which "dev" does not bring: with its libraries it is 5 GB."""

    functions = staticmethod(st.torch_functions)

    def __init__(self):
        self.torch = pytest.importorskip("torch")
        self.map = self.torch.vmap

    def arrays(self, values, **options):
        return [self.torch.tensor(value, **options) for value in values]

    def jacobians(self, function, given):
        return self.torch.autograd.functional.jacobian(function, tuple(self.arrays(given)))


TOOLS = {"jax": Jax, "torch": Torch}
FUNCTIONS = ("forward_dynamics", "inverse_dynamics")
RUNS = 21


def states():
    """q whose quaternions are of any norm, v and tau, RUNS of each."""
    rng = np.random.default_rng(4)
    q, v = 0.4 * rng.normal(size=(RUNS, 11)), rng.normal(size=(RUNS, 10))
    q[:, 3] += 1.5
    return q, v, 1e-3 * rng.normal(size=(RUNS, 4))


def arguments(name):
    """Arguments of a function: its last is tau or v_dot."""
    q, v, tau = states()
    return (q, v, tau if name == "forward_dynamics" else 3 * np.roll(v, 1, axis=0))


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
