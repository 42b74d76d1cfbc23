"""Stages in C: collocation solved inside, exact derivatives of the whole program, and threads; and
what they are of: collocation rules against exact integrals, and meshes.
"""

import ctypes
import os
import threading

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import BPoly

import serpentail as st
from serpentail.optimal import fatrop, terms
from serpentail.optimal import thread_pool as helpers
from serpentail.optimal.control_mesh import bernstein
from serpentail.optimal.library import kernel
from serpentail.optimal.mesh import TimeMesh, refined, uniform
from serpentail.optimal.rules import MOST_DEGREE, collocation_rule
from tests.support import zoo
from tests.support.rows import row
from tests.support.stages import whole_program
from tests.support.tumbling import AGAIN, keyed, rat, start

DURATIONS = {"duration": (0.3, 0.5)}
INERTIA = ((6e-5, 3.6e-5, 7e-5), (7e-5, 4e-5, 8e-5))
DESIGN = {"design": {"tail_length": (0.08, 0.25), "torso_inertia": INERTIA}}
FREE = {"tail": ((-0.4, -0.1), (0.4, 0.2)), "tail_rate": (-8, 8), "torso_rate": (-4, 4)}
WHOLLY_FREE = FREE | {"attitude": (-0.1, 1), "position": (-1, 1), "velocity": (-4, 4)}
STEEP = {"bounds": st.Bounds(angle=1.0, rate=30.0, torque_rate=1.0)}
GOAL = st.Goal(attitude=(1, 0, 0, 0.1), tail=(0.1, None), tail_rate=(None, 0.0))


def seen(point):
    """What a path may see of a node, with a parameter of the model."""
    turning = point.torso_rate[0] * point.time, ca.sumsqr(point.drift), point.torque[0]
    length = point.parameters["tail_length"]
    return ca.vertcat(point.tip * length, point.height, point.duration**2, *turning)


def own(point):
    """An objective of a model's parameter, too."""
    inertia = point.parameters["torso_inertia"][1] / 4e-5
    return ca.sumsqr(point.torque / 1e-3) * inertia + ca.sumsqr(point.torso_rate) * point.time


PATH = {"path": ((seen, -50.0, 50.0),)}
ALL = {"free_start": WHOLLY_FREE, "objective": own} | DESIGN | PATH | STEEP | DURATIONS
CASES = [
    ("m1_n3", DURATIONS),
    ("m1_n3", {"controls": 2, "objective": "energy", "damping": 1e-4}),
    ("m1_n3", {"degree": 5, "objective": "time"} | DURATIONS),
    ("m1_n3", {"degree": 1, "goal": GOAL}),
    ("m2_n2", {"controls": 3, "damping": 1e-4}),
    ("arcs1", {}),
    ("elastic", {"objective": own}),
    ("m1_n3", {"intervals": 3} | PATH | DURATIONS),
    ("m1_n3", {"intervals": 3, "objective": own} | PATH | STEEP | DURATIONS),
    *(
        pytest.param("m1_n1", {"intervals": 3, "goal": None} | each, marks=pytest.mark.slow)
        for each in (DESIGN, {"free_start": FREE})
    ),
    pytest.param("m1_n1", {"intervals": 3} | ALL, marks=pytest.mark.slow),
]
LIMIT = 30  # s, of a test that waits for a thread


def differences(function, w, step=1e-5):
    rows = [(function(w + step * e) - function(w - step * e)) / (2 * step) for e in np.eye(len(w))]
    return np.stack(rows, axis=-1)


@pytest.mark.parametrize(("name", "asked"), CASES)
def test_derivatives_are_central_differences(name, asked):
    """Of the whole program, beside a guess; the Hessian has no entries between stages."""
    random = np.random.default_rng(2)
    with whole_program(zoo.model(name), **asked) as program:
        w = program.w + 0.02 * random.normal(size=program.w.size)
        J, wanted = program.slopes(w), differences(program.values, w)
        largest = np.abs(wanted).max(axis=1, keepdims=True)
        assert (np.abs(J - wanted) <= 2e-6 * np.maximum(largest, 1.0)).all()
        weights = random.normal(size=len(J))
        H, wanted = (
            program.curvature(w, weights),
            differences(lambda x: weights @ program.slopes(x), w),
        )
        np.testing.assert_array_equal(H, H.T)
        np.testing.assert_allclose(H, wanted, atol=1e-6 * np.abs(H).max())


def filling(number, status):
    """A function of a node of (1, 3) that gives one number everywhere, and its status."""

    def node(*pointers):
        numbers = ctypes.cast(pointers[4], ctypes.POINTER(ctypes.c_double))
        np.ctypeslib.as_array(numbers, (11,))[:] = number
        return status

    return ctypes.CFUNCTYPE(ctypes.c_int, *(ctypes.c_void_p,) * 6)(node)


def test_stages_without_numbers_have_no_results_until_they_have_them_again():
    def lost(program, w):
        found = np.abs(program.values(w)).max()
        assert np.isnan(program.slopes(w)).any()
        assert program.curvature(w, np.ones(1 + program.sparse.rows)) is None
        return found >= 1e8  # a finite number that is worse than all others

    for given in ((np.nan, 0), (np.inf, 0), (1e300, 0), (0.0, 1)):
        functions = dict.fromkeys(("rates", "slopes", "curvature"), filling(*given))
        with row(*given), whole_program(rat(), functions=functions) as program:
            assert lost(program, program.w)
    with whole_program(rat()) as program:
        w, far = program.w, np.where(np.arange(program.w.size) < 6, 1e9, program.w)
        wanted = program.values(w)
        assert lost(program, far)
        np.testing.assert_allclose(program.values(w), wanted, atol=1e-10)
        assert np.isfinite(program.slopes(w)).all()


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


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_stages_have_the_numbers_of_one_thread():
    with whole_program(rat()) as program:
        wanted = program.slopes(program.w)
    for crew in (1, 2, 5):
        with whole_program(rat()) as program:
            address = program.sparse.program
            with helpers.helped(kernel(), address, crew):
                np.testing.assert_array_equal(program.slopes(program.w), wanted)
                child = os.fork()
                if child == 0:  # evaluates alone
                    program.slopes(1.001 * program.w)
                    found = program.slopes(program.w)
                    os._exit(0 if np.allclose(found, wanted) else 1)
                assert os.waitpid(child, 0)[1] == 0


def test_plans_have_as_many_threads_as_the_model_allows_and_do_not_depend_on_them(monkeypatch):
    """But few stages have one; none of the threads is left afterwards."""
    seen, before, found = set(), threading.active_count(), []
    monkeypatch.setattr(fatrop, "stop_reason", lambda: seen.add(threading.active_count()))
    monkeypatch.delenv("SERPENTAIL_THREADS", raising=False)
    given = AGAIN | {"start": start(rat()), "solver": "fatrop"}
    for count, intervals, used in ((1, 30, 1), (3, 30, 3), (3, 6, 1)):
        monkeypatch.setattr(rat().batch_library, "threads", count)
        found.append(keyed(rat(), **given, intervals=intervals))
        assert seen == {before + used - 1}
        seen.clear()
    assert threading.active_count() == before
    assert found[0].report["iterations"] == found[1].report["iterations"]
    np.testing.assert_array_equal(
        found[0].solution.samples.states, found[1].solution.samples.states
    )


def test_rules_are_exact_up_to_their_order_and_no_further():
    """Quadrature; and states of x = s^p from its rates at the nodes: p up to their number."""
    for degree in range(1, MOST_DEGREE + 1):
        found, s = collocation_rule(degree), np.linspace(0, 1, 5)
        with row(degree):
            for power in range(found.order):
                total = found.weights @ found.nodes**power
                assert total == pytest.approx(1 / (power + 1), abs=1e-13)
            beyond = found.weights @ found.nodes**found.order - 1 / (found.order + 1)
            assert abs(beyond) > 1e-10
            for power in range(1, degree + 1):
                states, rates = found.nodes**power, power * found.nodes ** (power - 1)
                defects = found.states @ np.append(0.0, states) - rates
                np.testing.assert_allclose(defects, 0, atol=1e-11)
                np.testing.assert_allclose(found.integrals(s) @ rates, s**power, atol=2e-12)
                wanted = power * s ** (power - 1)
                np.testing.assert_allclose(found.basis(s) @ rates, wanted, atol=2e-11)
            values = np.random.default_rng(0).normal(size=degree)
            by_powers = s[:, None] ** np.arange(degree) @ (values @ found.powers())
            np.testing.assert_allclose(by_powers, found.basis(s) @ values, atol=1e-11)
            inside = BPoly(values[:, None], [0, 1])(s)  # by coefficients, which it never exceeds
            np.testing.assert_allclose(bernstein(s, degree) @ values, inside, atol=1e-13)


def test_meshes_are_split_and_refined():
    """Refinement splits where errors are and obeys the most; controls keep their intervals."""
    mesh = TimeMesh(np.array([0.0, 0.2, 1.0]), np.array([0, 1])).split(np.array([2, 1]))
    np.testing.assert_allclose(mesh.ends, [0, 0.1, 0.2, 1])
    assert mesh.controls.tolist() == [0, 0, 1]
    points, (a, b) = mesh.points(collocation_rule(2)), (0.1 / 3, 0.2 + 0.8 / 3)
    np.testing.assert_allclose(points, [0, a, 0.1, 0.1 + a, 0.2, b, 1])

    errors = np.array([1e-8, 1e-8, 1e-3, 1e-8])
    mesh = refined(uniform(4), errors, 0.1, 5, 100)
    assert mesh.intervals > 4 and np.count_nonzero(mesh.widths < 0.25) == mesh.intervals - 3
    assert refined(uniform(4), errors, 1e-9, 5, 6).intervals <= 6
    halved = uniform(4).halved(np.array([False, True, True, False]), 5)
    np.testing.assert_allclose(halved.ends, [0, 0.25, 0.375, 0.5, 0.75, 1])


def test_short_functions_alone_are_compiled(monkeypatch):
    """Long ones take longer to compile than plans take."""
    e, given = ca.SX.sym("e", 2), ca.SX.sym("given")
    for most, compiled in ((terms.MOST_COMPILED, True), (10, False)):
        monkeypatch.setattr(terms, "MOST_COMPILED", most)
        assert terms.terms_of(e, given, given * e[0] * ca.sin(e)).compiled == compiled
