"""Quadratic programs with bounds, as a predictive controller's ticks solve them, against SciPy."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from serpentail.planning.predictive.kernel import kernel


def quadratic(H, g, lower, upper):
    """The solution by the controller's C, and what it returned."""
    n = len(g)
    d, chosen, memory = np.zeros(n), np.zeros(n, np.intc), np.zeros(n * (n + 3))
    arrays = [np.ascontiguousarray(a, float) for a in (H, g, lower, upper)]
    places = [a.ctypes.data for a in (*arrays, d, chosen, memory)]
    return d, kernel().mpc_quadratic(n, *places)


@pytest.mark.parametrize("n", [1, 2, 12, 36])
def test_quadratic_programs_are_solved_as_by_scipy(n):
    random, active = np.random.default_rng(n), 0
    for _ in range(30):
        A, b = random.normal(size=(n + 3, n)), random.normal(size=n + 3)
        size = random.uniform(0.01, 1)
        lower, upper = -size * random.uniform(0, 1, n), size * random.uniform(0, 1, n)
        lower[0] = 0.0
        wanted = lsq_linear(A, b, (lower, upper + 1e-12), method="bvls", tol=1e-15).x
        found, changes = quadratic(A.T @ A, -A.T @ b, lower, upper)
        assert changes >= 0
        np.testing.assert_allclose(found, wanted, atol=1e-8)
        active += int(((found == lower) | (found == upper)).sum())
    assert active > 10


@pytest.mark.parametrize("H", [-np.eye(2), np.full((2, 2), np.nan), np.zeros((2, 2))])
def test_quadratic_programs_without_a_minimum_are_refused(H):
    assert quadratic(H, np.ones(2), -np.ones(2), np.ones(2))[1] == -1
