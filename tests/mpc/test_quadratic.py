"""The controller's quadratic programs against SciPy."""

import ctypes

import numpy as np
from scipy.optimize import lsq_linear

from serpentail.mpc.kernel import kernel
from tests.support.predictive import least_squares


class Bounded(ctypes.Structure):
    """``mpc_bounded`` of native/mpc.h for double."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("n", "rows", "most")),
        *((name, ctypes.c_void_p) for name in ("R", "c", "A", "lower", "upper")),
        ("price", ctypes.c_double),
        ("d", ctypes.c_void_p),
        ("paid", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("memory", "set")),
    )


def solved(R, c, A, lower, upper, price=1e9, most=200):
    """Return d, the number of changes and the largest multiplier, by the controller's C."""
    n, rows = len(c), len(A)
    given = [np.ascontiguousarray(a, float) for a in (R, c, A, lower, upper)]
    d, memory, chosen = np.zeros(n), np.zeros(2 * n * (n + 2)), np.zeros(3 * n + rows, np.intc)
    places = [array.ctypes.data for array in (*given, d, memory, chosen)]
    qp = Bounded(n, rows, most, *places[:5], price, places[5], 0.0, *places[6:])
    return d, kernel("double").code.mpc_quadratic(ctypes.addressof(qp)), qp.paid


def test_quadratic_programs_are_solved_as_by_scipy():
    """The minimum of |R d + c| within bounds of d, and of rows A d."""
    for n, rows in ((1, 0), (2, 4), (12, 0), (12, 24), (36, 0)):
        random, active = np.random.default_rng(n), 0
        for _ in range(20):
            J, b = random.normal(size=(n + 3, n)), random.normal(size=n + 3)
            Q, R = np.linalg.qr(J)
            lower, upper = random.uniform(0.01, 1) * random.uniform(0, 1, (2, n)) * [[-1], [1]]
            lower[0] = 0.0
            A = random.normal(size=(rows, n))
            low, high = A @ random.uniform(lower, upper) + random.uniform(0, 0.3, (2, rows)) * [
                [-1],
                [1],
            ]
            found, changes, _ = solved(R, Q.T @ b, A, [*lower, *low], [*upper, *high])
            if rows:
                sides = np.stack([lower, upper], 1)
                wanted = least_squares(R, Q.T @ b, sides, [(high, -A), (-low, A)])
            else:
                wanted = lsq_linear(J, -b, (lower, upper + 1e-12), method="bvls", tol=1e-15).x
            assert 0 <= changes < 200
            np.testing.assert_allclose(found, wanted, atol=1e-6 if rows else 1e-8)
            held = np.concatenate([found - lower, upper - found, A @ found - low, high - A @ found])
            assert held.min() > -1e-12
            active += int((np.abs(held) < 1e-12).sum())
        assert active > 10
    for R in (np.full((2, 2), np.nan), np.zeros((2, 2))):  # without a minimum
        assert solved(R, np.ones(2), np.zeros((0, 2)), -np.ones(2), np.ones(2))[1] == -1
    R, zero = np.eye(12), np.zeros(12)
    assert solved(R, zero - 9, R[:0], zero, zero + 1, most=5)[1] == 5  # of 12
    # a row that cannot hold costs its price: d^2 / 2 + 3 (2 - d) is least at d = 1, its bound
    one, far = np.eye(1), [[-1.0, 2.0], [1.0, 4.0]]
    assert solved(one, np.zeros(1), one, *far, price=3.0)[0] == 1.0
    assert solved(one, np.zeros(1), one, *far, price=0.5)[0] == 0.5
