"""Stages in C: collocation solved inside, exact derivatives of what they lead to, and threads; and
what they are of: collocation rules against exact integrals, and meshes.
"""

import ctypes
import os
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from scipy.interpolate import BPoly

import serpentail as st
from serpentail.planning.nlp.mesh import Mesh, refined, uniform
from serpentail.planning.nlp.rules import MOST_DEGREE, collocation_rule
from serpentail.planning.staged import fatrop
from serpentail.planning.staged import thread_pool as helpers
from serpentail.planning.staged.fatrop import kernel
from tests.support.rows import row
from tests.support.stages import first_stage
from tests.support.tumbling import AGAIN, rat, start

H = np.array([1e-4, -2e-4, 5e-5])  # kg m^2/s
CASES = [
    ((1, 3), {}),
    ((1, 3), {"controls": 2, "objective": "energy", "damping": 1e-4}),
    ((1, 3), {"degree": 5, "objective": "time", "duration": (0.4, 0.4)}),
    ((1, 3), {"degree": 1}),
    ((2, 2), {"controls": 3, "damping": 1e-4}),
]
LIMIT = 30  # s, of a test that waits for a thread


def state(nt: int) -> np.ndarray:
    random = np.random.default_rng(1)
    tail, rate = 0.2 * random.normal(size=nt), 0.3 * random.normal(size=nt)
    return np.concatenate([[0.9, 0.3, 0.2, -0.1], tail, rate])


def variables(stage, x: np.ndarray) -> np.ndarray:
    controls = 0.5 * np.random.default_rng(2).normal(size=stage.size - len(x) - 1)
    return np.concatenate([controls, x, [0.4]])


def differences(function, v, step=1e-5):
    rows = [(function(v + step * e) - function(v - step * e)) / (2 * step) for e in np.eye(len(v))]
    return np.stack(rows, axis=-1)


def test_derivatives_are_central_differences():
    for tail, settings in CASES:
        model = rat(*tail)
        x = state(model.layout.nt)
        with row(tail, settings), first_stage(model, x, H, **settings) as stage:
            v = variables(stage, x)
            J = stage.slopes(v)
            own = differences(stage.values, v)
            np.testing.assert_allclose(J, own, atol=1e-6 * np.abs(J).max())
            mu = np.random.default_rng(3).normal(size=len(J))
            found = stage.hessian(v, mu)
            np.testing.assert_array_equal(found, found.T)
            wanted = mu @ np.moveaxis(differences(stage.slopes, v), 0, 1)
            np.testing.assert_allclose(found, wanted, atol=1e-5 * np.abs(found).max())


def filling(number, status):
    """A function of a node of (1, 3) that gives one number everywhere, and its status."""

    def node(*pointers):
        numbers = ctypes.cast(pointers[4], ctypes.POINTER(ctypes.c_double))
        np.ctypeslib.as_array(numbers, (11,))[:] = number
        return status

    return ctypes.CFUNCTYPE(ctypes.c_int, *(ctypes.c_void_p,) * 6)(node)


def test_a_stage_without_numbers_has_no_results_until_it_has_them_again():
    model, x = rat(), state(2)
    for given in ((np.nan, 0), (np.inf, 0), (1e300, 0), (0.0, 1)):
        functions = dict.fromkeys(("rates", "slopes", "curvature"), filling(*given))
        with row(*given), first_stage(model, x, H, functions=functions) as stage:
            v = variables(stage, x)
            assert stage.values(v) is None and stage.slopes(v) is None
            assert stage.hessian(v, np.ones(1000)) is None
    with first_stage(model, x, H) as stage:
        v = variables(stage, x)
        wanted, far = stage.values(v), np.where(np.arange(len(v)) < 6, 1e9, v)
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
        factors, X, x, pivots = A.copy(), B.copy(), b.copy(), np.zeros(n, np.intc)
        assert code.factorise(n, factors.ctypes.data, pivots.ctypes.data) == 0
        code.solve(n, factors.ctypes.data, pivots.ctypes.data, 7, X.ctypes.data)
        code.solve_transposed(n, factors.ctypes.data, pivots.ctypes.data, x.ctypes.data)
        np.testing.assert_allclose(A @ X, B, atol=1e-11)
        np.testing.assert_allclose(A.T @ x, b, atol=1e-11)
    for singular in (np.zeros((3, 3)), np.ones((2, 2)), np.full((2, 2), np.nan)):
        pivots = np.zeros(len(singular), np.intc)
        assert code.factorise(len(singular), singular.ctypes.data, pivots.ctypes.data) == 1


@contextmanager
def program():
    """Yield a function that evaluates six stages by a factor, the code and the program."""
    model, x = rat(), state(2)
    with first_stage(model, x, H) as stage:
        code, own = kernel(), stage.size
        code.program_slopes.argtypes = (ctypes.c_void_p,) * 2
        w, nu = np.zeros(code.program_variables(stage.program)), own - len(x) - 1
        w[nu] = 0.4
        for k in range(1, 6):
            first = k * own - len(x)
            w[first + nu : first + own] = [*x, 0.4]

        def slopes(factor=1.0):
            code.program_slopes(stage.program, (factor * w).ctypes.data)
            assert all(each.sloped for each in stage.all[:6])
            shape = stage.stage.results, own
            return [np.ctypeslib.as_array(each.Jr, shape).copy() for each in stage.all[:6]]

        yield slopes, code, stage.program


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_stages_have_the_numbers_of_one_thread():
    with program() as (slopes, *_):
        wanted = slopes()
    for crew in (1, 2, 5):
        with program() as (slopes, code, own), helpers.helped(code, own, crew):
            for a, b in zip(wanted, slopes(), strict=True):
                np.testing.assert_array_equal(a, b)
            child = os.fork()
            if child == 0:  # evaluates alone
                slopes(1.001)
                pairs = zip(wanted, slopes(), strict=True)
                os._exit(0 if all(np.allclose(a, b) for a, b in pairs) else 1)
            assert os.waitpid(child, 0)[1] == 0


def test_plans_have_as_many_threads_as_the_model_allows_and_do_not_depend_on_them(monkeypatch):
    """But few stages have one; none of the threads is left afterwards."""
    seen, before, found = set(), threading.active_count(), []
    monkeypatch.setattr(fatrop, "stop_reason", lambda: seen.add(threading.active_count()))
    monkeypatch.delenv("SERPENTAIL_THREADS", raising=False)
    given = AGAIN | {"start": start(rat()), "solver": "fatrop"}
    for count, intervals, used in ((1, 30, 1), (3, 30, 3), (3, 6, 1)):
        monkeypatch.setattr(rat().batch_library, "threads", count)
        found.append(st.plan(rat(), **given, intervals=intervals))
        assert seen == {before + used - 1}
        seen.clear()
    assert threading.active_count() == before
    assert found[0].report["iterations"] == found[1].report["iterations"]
    np.testing.assert_array_equal(found[0].solution.w, found[1].solution.w)


SCHEMES = [("trapezoidal", None), ("hermite-simpson", None)]
SCHEMES += [(name, d) for name in ("lobatto", "radau") for d in range(1, MOST_DEGREE + 1)]


def test_rules_are_exact_up_to_their_order_and_no_further():
    """Quadrature; and states of x = s^p from its rates at the nodes: p up to their number."""
    for name, degree in SCHEMES:
        found, s = collocation_rule(name, degree), np.linspace(0, 1, 5)
        with row(name, degree):
            for power in range(found.order):
                total = found.weights @ found.nodes**power
                assert total == pytest.approx(1 / (power + 1), abs=1e-13)
            beyond = found.weights @ found.nodes**found.order - 1 / (found.order + 1)
            assert abs(beyond) > 1e-10
            for power in range(1, len(found.nodes) + 1):
                states, rates = found.supports**power, power * found.nodes ** (power - 1)
                np.testing.assert_allclose(found.states @ states, found.slopes @ rates, atol=2e-12)
                np.testing.assert_allclose(found.integrals(s) @ rates, s**power, atol=2e-12)
                wanted = power * s ** (power - 1)
                np.testing.assert_allclose(found.basis(s) @ rates, wanted, atol=2e-11)
            values = np.random.default_rng(0).normal(size=len(found.nodes))
            coefficients = found.bernstein() @ values  # beyond which no polynomial goes
            inside = BPoly(coefficients[:, None], [0, 1])(s)
            np.testing.assert_allclose(inside, found.basis(s) @ values, atol=1e-11)


def test_meshes_are_split_refined_and_guarded():
    """Refinement splits where errors are and obeys the most; guards are for the intervals beside,
    too, and stay.
    """
    mesh = Mesh(np.array([0.0, 0.2, 1.0]), np.array([True, False]), None).split(np.array([2, 1]))
    np.testing.assert_allclose(mesh.ends, [0, 0.1, 0.2, 1])
    assert mesh.guarded.tolist() == [True, True, False]
    points = mesh.points(collocation_rule("hermite-simpson"))
    np.testing.assert_allclose(points, [0, 0.05, 0.1, 0.15, 0.2, 0.6, 1])

    errors = np.array([1e-8, 1e-8, 1e-3, 1e-8])
    mesh = refined(uniform(4), errors, 0.1, 5, 100)
    assert mesh.intervals > 4 and np.count_nonzero(mesh.widths < 0.25) == mesh.intervals - 3
    assert refined(uniform(4), errors, 1e-9, 5, 6).intervals <= 6

    third, last = (np.arange(8) == k for k in (2, 7))
    mesh = uniform(8).with_guards(third)
    assert np.flatnonzero(mesh.guarded).tolist() == [1, 2, 3]
    assert np.flatnonzero(mesh.with_guards(last).guarded).tolist() == [1, 2, 3, 6, 7]
