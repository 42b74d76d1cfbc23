"""Stages in C: collocation solved inside, and exact derivatives of what they lead to."""

import ctypes

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from serpentail.attitude import quaternion_rate
from serpentail.planning.condensed.fatrop import kernel
from tests.support.stages import first_stage
from tests.support.tumbling import rat

H = np.array([1e-4, -2e-4, 5e-5])  # kg m^2/s
CASES = [
    ((1, 3), {}),
    ((1, 3), {"controls": 2, "objective": "energy", "damping": 1e-4}),
    ((1, 3), {"degree": 5, "objective": "time", "duration": (0.4, 0.4)}),
    ((1, 3), {"degree": 1}),
    ((3, 2), {"controls": 3, "damping": 1e-4}),
]
every_case = pytest.mark.parametrize(("tail", "settings"), CASES)


def state(nt: int, seed: int = 1) -> np.ndarray:
    """A state in units: the quaternion not of norm 1."""
    random = np.random.default_rng(seed)
    return np.concatenate(
        [[0.9, 0.3, 0.2, -0.1], 0.2 * random.normal(size=nt), 0.3 * random.normal(size=nt)]
    )


def variables(stage, x: np.ndarray, size: float = 0.5) -> np.ndarray:
    random = np.random.default_rng(2)
    controls = size * random.normal(size=stage.size - len(x) - 1)
    return np.concatenate([controls, x, [0.4]])


def differences(function, v, step=1e-5):
    """Central differences (.., v) of a function."""
    rows = [(function(v + step * e) - function(v - step * e)) / (2 * step) for e in np.eye(len(v))]
    return np.stack(rows, axis=-1)


@every_case
def test_slopes_are_those_of_the_results(tail, settings):
    model = rat(*tail)
    x = state(model.layout.nt)
    with first_stage(model, x, H, **settings) as stage:
        v = variables(stage, x)
        J = stage.slopes(v)
        np.testing.assert_allclose(J, differences(stage.values, v), atol=1e-6 * np.abs(J).max())


@every_case
def test_hessians_are_those_of_the_weighted_results(tail, settings):
    model = rat(*tail)
    x = state(model.layout.nt)
    with first_stage(model, x, H, **settings) as stage:
        v = variables(stage, x)
        mu = np.random.default_rng(3).normal(size=len(stage.values(v)))
        found = stage.hessian(v, mu)
        np.testing.assert_array_equal(found, found.T)
        wanted = mu @ np.moveaxis(differences(stage.slopes, v), 0, 1)
        np.testing.assert_allclose(found, wanted, atol=1e-5 * np.abs(found).max())


def test_the_end_is_that_of_the_equations_of_motion():
    """By SciPy, of the model's own forward dynamics; omega carries the angular momentum."""
    model = rat()
    nt, x = model.layout.nt, state(model.layout.nt)
    with first_stage(model, x, H, degree=5) as stage:
        v = variables(stage, x, 0.0)
        end = stage.values(v)[: len(x)]

    def turning(c, tail, rate):
        q = np.concatenate([np.zeros(3), c / np.linalg.norm(c), tail])
        still = np.concatenate([np.zeros(6), rate])
        basis = np.eye(model.nv)[3:6]
        own = np.column_stack([model.momentum(q, row)[1] for row in basis])
        return q, np.linalg.solve(own, H - model.momentum(q, still)[1])

    def slope(_t, y):
        c, tail, rate = np.split(y, [4, 4 + nt])
        q, omega = turning(c, tail, rate)
        velocity = np.concatenate([np.zeros(3), omega, rate])
        rates = model.forward_dynamics(q, velocity, np.zeros(nt))[6:]
        return np.concatenate([quaternion_rate(c, omega), rate, rates])

    si = np.concatenate([x[: 4 + nt], 10 * x[4 + nt :]])
    true = solve_ivp(slope, (0, 0.4 / 6), si, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(end * np.repeat([1, 1, 10], [4, nt, nt]), true, atol=2e-6)


NODE = ctypes.CFUNCTYPE(ctypes.c_int, *(ctypes.c_void_p,) * 6)
SLOPES = ctypes.CFUNCTYPE(ctypes.c_int, *(ctypes.c_void_p,) * 7)
CURVATURE = ctypes.CFUNCTYPE(ctypes.c_int, *(ctypes.c_void_p,) * 9)


def broken(number: float, status: int) -> dict:
    """Functions of a node of (1, 3) that give one number everywhere."""

    def filled(address, count):
        numbers = ctypes.cast(address, ctypes.POINTER(ctypes.c_double))
        np.ctypeslib.as_array(numbers, (count,))[:] = number

    def node(*pointers):
        filled(pointers[4], 11)
        return status

    def slopes(*pointers):
        filled(pointers[5], 110)
        return node(*pointers)

    def curvature(*pointers):
        filled(pointers[7], 100)
        return slopes(*pointers[:4], *pointers[5:])

    return {"rates": NODE(node), "slopes": SLOPES(slopes), "curvature": CURVATURE(curvature)}


@pytest.mark.parametrize(("number", "status"), [(np.nan, 0), (np.inf, 0), (1e300, 0), (0.0, 1)])
def test_nodes_that_give_no_numbers_leave_a_stage_without_results(number, status):
    model, x = rat(), state(2)
    with first_stage(model, x, H, functions=broken(number, status)) as stage:
        v = variables(stage, x)
        assert stage.values(v) is None
        assert stage.slopes(v) is None
        assert stage.hessian(v, np.ones(1000)) is None


def test_a_stage_that_had_no_results_has_them_again():
    model, x = rat(), state(2)
    with first_stage(model, x, H) as stage:
        v = variables(stage, x)
        wanted = stage.values(v)
        far = v.copy()
        far[:6] = 1e9
        assert stage.values(far) is None
        np.testing.assert_allclose(stage.values(v), wanted, atol=1e-10)


def test_linear_equations_are_solved_and_singular_ones_refused():
    code, random = kernel(), np.random.default_rng(4)
    code.factorise.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
    code.solve.argtypes = (ctypes.c_int, *(ctypes.c_void_p,) * 2, ctypes.c_int, ctypes.c_void_p)
    code.solve_transposed.argtypes = (ctypes.c_int, *(ctypes.c_void_p,) * 3)
    for n in (1, 2, 5, 24):
        A, B, b = random.normal(size=(n, n)), random.normal(size=(n, 7)), random.normal(size=n)
        A[0, 0] = 0.0 if n > 1 else 2.0  # needs another pivot
        factors, X, x = A.copy(), B.copy(), b.copy()
        pivots = np.zeros(n, np.intc)
        assert code.factorise(n, factors.ctypes.data, pivots.ctypes.data) == 0
        code.solve(n, factors.ctypes.data, pivots.ctypes.data, 7, X.ctypes.data)
        code.solve_transposed(n, factors.ctypes.data, pivots.ctypes.data, x.ctypes.data)
        np.testing.assert_allclose(A @ X, B, atol=1e-11)
        np.testing.assert_allclose(A.T @ x, b, atol=1e-11)
    for singular in (np.zeros((3, 3)), np.ones((2, 2)), np.full((2, 2), np.nan)):
        pivots = np.zeros(len(singular), np.intc)
        assert code.factorise(len(singular), singular.ctypes.data, pivots.ctypes.data) == 1
