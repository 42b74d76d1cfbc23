"""Collocation rules and the program that is built of them, compared with exact integrals and an
exact optimum.
"""

import casadi
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.sparse import coo_matrix

import serpentail as st
from serpentail.planning.nlp.mesh import Mesh, refined, uniform
from serpentail.planning.nlp.node import PARAMETERS, Node, Variables
from serpentail.planning.nlp.rules import MOST_DEGREE, collocation_rule
from serpentail.planning.nlp.transcription import collocate, indices_of

SCHEMES = [
    ("trapezoidal", None),
    ("hermite-simpson", None),
    *(("lobatto", d) for d in range(1, MOST_DEGREE + 1)),
]
SCHEMES += [("radau", d) for d in range(1, MOST_DEGREE + 1)]
every_rule = pytest.mark.parametrize(("name", "degree"), SCHEMES)


@every_rule
def test_quadrature_is_exact_up_to_the_order_and_no_further(name, degree):
    found = collocation_rule(name, degree)
    for power in range(found.order):
        assert found.weights @ found.nodes**power == pytest.approx(1 / (power + 1), abs=1e-13)
    assert abs(found.weights @ found.nodes**found.order - 1 / (found.order + 1)) > 1e-10


@every_rule
def test_defects_vanish_for_polynomials(name, degree):
    """The states of x = s^p, its rates at the nodes: p up to the number of nodes."""
    found = collocation_rule(name, degree)
    for power in range(1, len(found.nodes) + 1):
        states, rates = found.supports**power, power * found.nodes ** (power - 1)
        np.testing.assert_allclose(found.states @ states, found.slopes @ rates, atol=2e-12)
        s = np.linspace(0, 1, 5)
        np.testing.assert_allclose(found.integrals(s) @ rates, s**power, atol=2e-12)
        np.testing.assert_allclose(found.basis(s) @ rates, power * s ** (power - 1), atol=2e-11)


def test_known_rules():
    np.testing.assert_allclose(collocation_rule("trapezoidal").slopes, [[0.5, 0.5]], atol=1e-15)
    simpson = collocation_rule("hermite-simpson")
    np.testing.assert_allclose(
        simpson.slopes, [[5 / 24, 1 / 3, -1 / 24], [1 / 6, 2 / 3, 1 / 6]], atol=1e-15
    )
    np.testing.assert_allclose(collocation_rule("radau", 2).nodes, [1 / 3, 1], atol=1e-15)


@pytest.mark.parametrize(
    ("name", "degree"),
    [("midpoint", None), ("radau", 0), ("radau", 6), ("radau", 2.0), ("trapezoidal", 3)],
)
def test_unknown_rules_are_refused(name, degree):
    with pytest.raises(
        st.PlanningError, match="rule: value 'midpoint'" if name == "midpoint" else "degree: value"
    ):
        collocation_rule(name, degree)


# A harmonic oscillator x_ddot = u - x, brought from rest at 0 to rest at 1 within T with the
# least effort.

T = 2.0


def least_effort() -> float:
    """d^T W^-1 d with the Gramian W of the oscillator, by quadrature far beyond rounding."""
    A, b = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([0.0, 1.0])
    x, w = np.polynomial.legendre.leggauss(40)
    W = sum(
        weight * np.outer(expm(A * t) @ b, expm(A * t) @ b)
        for t, weight in zip(T * (x + 1) / 2, w, strict=True)
    )
    return float(np.linalg.solve(T / 2 * W, [1, 0])[0])


def oscillator() -> tuple[Variables, Node]:
    """The oscillator as a node: zeta = (T, x, x_dot, u); its rate is a call, as dynamics is."""
    from serpentail.planning.nlp.node_calls import linear_call

    zeta, p = casadi.SX.sym("zeta", 4), casadi.SX.sym("p", PARAMETERS + 1)
    state, u = casadi.SX.sym("state", 2), casadi.SX.sym("u")
    f = casadi.Function("f", [state, u], [casadi.vertcat(state[1], u - state[0])])
    call = linear_call(f, zeta, [zeta[1:3], zeta[3]])
    result = casadi.SX.sym("result", 2)
    y = casadi.vertcat(zeta[0] * result, zeta[0] * zeta[3] ** 2)
    node = Node(casadi.Function("node", [zeta, p, result], [y]), (call,), 2, 0, ())
    return Variables((("x", 2),), (), {"x": np.ones(2), "torque": np.ones(1)}), node


def found_effort(name, degree, intervals) -> float:
    """The optimum of the program on a mesh."""
    variables, node = oscillator()
    scheme = uniform(intervals), collocation_rule(name, degree)
    indices = indices_of(variables, *scheme)
    functions = collocate(node, indices, scheme, coo_matrix((0, indices.size))).functions()
    least, most = -np.full(indices.size, np.inf), np.full(indices.size, np.inf)
    least[0] = most[0] = T
    least[indices.states[0]] = most[indices.states[0]] = 0
    least[indices.states[-1]] = most[indices.states[-1]] = [1, 0]
    options = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-12}
    options |= {key: functions[key] for key in ("grad_f", "jac_g", "hess_lag")}
    solver = casadi.nlpsol("solver", "ipopt", functions["nlp"], options)
    found = solver(x0=0, p=0, lbx=least, ubx=most, lbg=0, ubg=0)
    assert solver.stats()["success"]
    return float(found["f"])


@pytest.mark.parametrize(
    ("name", "degree", "coarse", "order"),
    [
        ("trapezoidal", None, 16, 2),
        ("hermite-simpson", None, 6, 4),
        ("radau", 2, 8, 3),
        ("radau", 3, 4, 5),
    ],
)
def test_optimum_converges_at_the_order_of_the_rule(name, degree, coarse, order):
    errors = [abs(found_effort(name, degree, n) - least_effort()) for n in (coarse, 2 * coarse)]
    assert errors[1] < 1e-2
    assert np.log2(errors[0] / errors[1]) > order - 0.5


# Meshes.


def test_split_meshes_keep_their_ends():
    mesh = Mesh(np.array([0.0, 0.2, 1.0]), np.array([True, False]), None).split(np.array([2, 1]))
    np.testing.assert_allclose(mesh.ends, [0, 0.1, 0.2, 1])
    assert mesh.guarded.tolist() == [True, True, False]
    points = mesh.points(collocation_rule("hermite-simpson"))
    np.testing.assert_allclose(points, [0, 0.05, 0.1, 0.15, 0.2, 0.6, 1])


def test_refinement_splits_where_errors_are_and_obeys_the_most():
    errors = np.array([1e-8, 1e-8, 1e-3, 1e-8])
    mesh = refined(uniform(4), errors, 0.1, 5, 100)
    assert mesh.intervals > 4 and np.count_nonzero(mesh.widths < 0.25) == mesh.intervals - 3
    assert refined(uniform(4), errors, 1e-9, 5, 6).intervals <= 6


def test_guards_are_for_the_intervals_beside_too_and_stay():
    third, last = (np.arange(8) == k for k in (2, 7))
    mesh = uniform(8).with_guards(third)
    assert np.flatnonzero(mesh.guarded).tolist() == [1, 2, 3]
    assert np.flatnonzero(mesh.with_guards(last).guarded).tolist() == [1, 2, 3, 6, 7]
