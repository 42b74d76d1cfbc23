"""Coefficients of the methods fulfil the order conditions: by rooted trees (Butcher), and those of
W-methods.
"""

from functools import cache
from itertools import combinations_with_replacement

import numpy as np
import pytest

from serpentail_codegen.targets.c.tableaux import RK4, ROS34PW2, TSIT5, transformed

ROUNDING = 3e-14  # coefficients of up to 88, printed with 16 digits


@cache
def trees(order):
    """Rooted trees of an order, as sorted tuples of their branches."""
    if order == 1:
        return [()]
    found = set()
    for count in range(1, order):
        smaller = [(size, tree) for size in range(1, order) for tree in trees(size)]
        for branches in combinations_with_replacement(smaller, count):
            if sum(size for size, _ in branches) == order - 1:
                found.add(tuple(sorted(tree for _, tree in branches)))
    return sorted(found)


def weight(tree, A):
    """Elementary weight of every stage of a tree, and its density."""
    stages, density, size = np.ones(len(A)), 1, 1
    for branch in tree:
        inner, inner_density, inner_size = weight(branch, A)
        stages, density, size = stages * (A @ inner), density * inner_density, size + inner_size
    return stages, density * size, size


def square(rows):
    return np.array([[*row, *[0.0] * (len(rows) - len(row))] for row in rows])


def residuals(method, weights, order):
    A = square(method.rows)
    for tree in (tree for size in range(1, order + 1) for tree in trees(size)):
        stages, density, _ = weight(tree, A)
        yield abs(np.dot(weights, stages) - 1 / density)


def test_trees_are_as_many_as_there_are():
    assert [len(trees(order)) for order in range(1, 6)] == [1, 1, 2, 4, 9]


def test_explicit_methods_have_their_order():
    for method, order in ((RK4, 4), (TSIT5, 5)):
        assert max(residuals(method, method.weights, order)) < ROUNDING
        assert max(residuals(method, method.weights, order + 1)) > 1e-5
        rows = square(method.rows).sum(axis=1)
        np.testing.assert_allclose(rows, method.nodes, rtol=0, atol=1e-14)


def test_tsit5_embeds_order_four_and_interpolates_with_it():
    embedded = np.subtract(TSIT5.weights, TSIT5.error)
    assert max(residuals(TSIT5, embedded, 4)) < ROUNDING
    assert max(residuals(TSIT5, embedded, 5)) > 1e-4
    for x in (0.1, 0.5, 0.9, 1.0):
        weights = np.array(TSIT5.dense) @ [x, x**2, x**3, x**4]
        for tree in (tree for size in range(1, 5) for tree in trees(size)):
            stages, density, size = weight(tree, square(TSIT5.rows))
            assert np.dot(weights, stages) == pytest.approx(x**size / density, abs=ROUNDING)


def test_ros34pw2_has_order_three_with_any_jacobian():
    """Rang and Angermann 2005: alpha and gamma each fulfil the conditions, whatever J is."""
    method = ROS34PW2
    alpha, gamma = square(method.alpha), square(method.below) + method.gamma * np.eye(4)
    one, b, e = np.ones(4), np.array(method.weights), np.array(method.embedded)
    a, g = alpha @ one, gamma @ one
    expected = [(b @ one, 1), (b @ a, 1 / 2), (b @ g, 0), (b @ a**2, 1 / 3), (b @ alpha @ a, 1 / 6)]
    expected += [(b @ alpha @ g, 0), (b @ gamma @ a, 0), (b @ gamma @ g, 0)]
    expected += [(e @ one, 1), (e @ a, 1 / 2), (e @ g, 0)]
    np.testing.assert_allclose(*zip(*expected, strict=True), rtol=0, atol=1e-14)
    assert abs(e @ a**2 - 1 / 3) > 1e-2
    np.testing.assert_allclose(alpha[3] + gamma[3], [*b[:3], b[3]], atol=1e-15)  # stiffly accurate


def rosenbrock_step(method, f, J, y, h):
    """One step as Tableau.Rosenbrock states it."""
    u, W = [], np.eye(len(y)) - h * method.gamma * J
    for row, coupling in zip(method.rows, method.couplings, strict=True):
        at = y + sum((a * x for a, x in zip(row, u, strict=True)), np.zeros_like(y))
        right = h * method.gamma * f(at) + method.gamma * sum(
            (c * x for c, x in zip(coupling, u, strict=True)), 0 * y
        )
        u.append(np.linalg.solve(W, right))
    return y + np.array(method.weights) @ u


def test_the_transformed_method_converges():
    """On a pendulum, with its Jacobian and with any matrix."""

    def f(y):
        return np.array([y[1], -np.sin(y[0]) - 0.2 * y[1]])

    for rows in ([[0, 1], [-np.cos(0.7), -0.2]], [[1.0, -2], [3, -1]]):
        J, ends = np.array(rows), []
        for steps in (20, 40, 80, 1000):
            y = np.array([0.7, 1.0])
            for _ in range(steps):
                y = rosenbrock_step(transformed(ROS34PW2), f, J, y, 1 / steps)
            ends.append(y)
        errors = np.linalg.norm(np.subtract(ends[:3], ends[3]), axis=1)
        assert (np.log2(errors[:2] / errors[1:]) > 2.8).all()
