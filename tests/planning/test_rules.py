"""Collocation rules against exact integrals, coordinates of attitudes, and meshes."""

import casadi
import numpy as np
import pytest
from scipy.interpolate import BPoly

import serpentail as st
from serpentail.attitude import from_angles, rotation_matrix
from serpentail.planning.nlp.coordinates import Attitude
from serpentail.planning.nlp.mesh import Mesh, refined, uniform
from serpentail.planning.nlp.rules import MOST_DEGREE, collocation_rule
from tests.support.rows import row

SCHEMES = [
    ("trapezoidal", None),
    ("hermite-simpson", None),
    *(("lobatto", d) for d in range(1, MOST_DEGREE + 1)),
]
SCHEMES += [("radau", d) for d in range(1, MOST_DEGREE + 1)]


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


def test_known_rules():
    np.testing.assert_allclose(collocation_rule("trapezoidal").slopes, [[0.5, 0.5]], atol=1e-15)
    simpson = collocation_rule("hermite-simpson")
    np.testing.assert_allclose(
        simpson.slopes, [[5 / 24, 1 / 3, -1 / 24], [1 / 6, 2 / 3, 1 / 6]], atol=1e-15
    )
    np.testing.assert_allclose(collocation_rule("radau", 2).nodes, [1 / 3, 1], atol=1e-15)


def test_unknown_rules_are_refused():
    for words, name, degree in (
        ("rule: value 'midpoint'", "midpoint", None),
        ("degree: value 0", "radau", 0),
        ("degree: value 6", "radau", MOST_DEGREE + 1),
        ("degree: value 2.0", "radau", 2.0),
        ("degree: value 3", "trapezoidal", 3),
    ):
        with row(words), pytest.raises(st.PlanningError, match=words):
            collocation_rule(name, degree)


def test_attitude_coordinates_agree():
    """Rates of both coordinates turn the same matrix."""
    random = np.random.default_rng(0)
    angles, omega, step = random.uniform(-1, 1, 3), random.normal(size=3), 1e-6
    quaternion = from_angles(angles)
    for kind, c in (("euler", angles), ("quaternion", quaternion)):
        coordinates = Attitude(kind)
        slope = np.array(coordinates.rate(casadi.DM(c), casadi.DM(omega))).ravel()
        R = [rotation_matrix(coordinates.as_quaternion(c + s * slope)) for s in (-step, step)]
        turn = rotation_matrix(quaternion).T @ (R[1] - R[0]) / (2 * step)
        np.testing.assert_allclose([turn[2, 1], turn[0, 2], turn[1, 0]], omega, atol=1e-9)
        found = np.array(coordinates.quaternion(casadi.DM(c))).ravel()
        np.testing.assert_allclose(found, quaternion)


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
