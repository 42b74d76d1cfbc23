"""Linear equations: the solvers solve, exactly where the arithmetic is exact."""

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import unroll
from serpentail_codegen.ir.ldl import ldl_factor, ldl_solve, pair_factor, pair_solve
from tests.support.algebras import FLOATS, RATIONAL
from tests.support.program_runs import outputs


def positive_definite(rng, size):
    """A random symmetric positive definite matrix of small integers."""
    half = [[rng.randint(-3, 3) for _ in range(size)] for _ in range(size)]
    return [
        [sum(a * b for a, b in zip(x, y, strict=True)) + (i == j) for j, y in enumerate(half)]
        for i, x in enumerate(half)
    ]


@pytest.mark.parametrize("size", range(1, 9))
def test_solver_is_exact_in_rational_arithmetic(size):
    rng = random.Random(size)
    A, b = positive_definite(rng, size), [rng.randint(-9, 9) for _ in range(size)]
    lower = [[Fraction(x) for x in row[: k + 1]] for k, row in enumerate(A)]
    factors, pivots = ldl_factor(RATIONAL, lower)
    x = ldl_solve(RATIONAL, factors, [Fraction(value) for value in b])
    assert [sum(a * value for a, value in zip(row, x, strict=True)) for row in A] == b
    minors = [Fraction(round(np.linalg.det(np.array(A)[k:, k:]))) for k in reversed(range(size))]
    assert [math.prod(pivots[: k + 1]) for k in range(size)] == minors
    assert [
        list(map(Fraction, row[: k + 1])) for k, row in enumerate(A)
    ] == lower  # the arguments are left alone


@pytest.mark.parametrize("size", [1, 3, 9, 22])
def test_solver_agrees_with_numpy(size):
    rng = np.random.default_rng(size)
    half = rng.normal(size=(size, size))
    A, b = half @ half.T + 0.1 * np.eye(size), rng.normal(size=size)
    factors, pivots = ldl_factor(FLOATS, [row[: k + 1] for k, row in enumerate(A.tolist())])
    x = ldl_solve(FLOATS, factors, b.tolist())
    np.testing.assert_allclose(
        x, np.linalg.solve(A, b), rtol=0, atol=1e-14 * np.linalg.cond(A) * np.abs(x).max()
    )
    assert min(pivots) > 0


def test_pivots_show_what_is_not_positive_definite():
    _, pivots = ldl_factor(RATIONAL, [[Fraction(1)], [Fraction(2), Fraction(3)]])
    assert pivots == [3, Fraction(-1, 3)]


@pytest.mark.parametrize("size", [1, 3, 8])
def test_pair_solver_is_exact_in_rational_arithmetic(size):
    rng = random.Random(size)
    A, b = positive_definite(rng, size), [rng.randint(-9, 9) for _ in range(size)]
    A = [[x + rng.choice((-1, 1)) * (k != j) for j, x in enumerate(row)] for k, row in enumerate(A)]
    turned = [list(column) for column in zip(*A, strict=True)]
    triangles = [
        [[Fraction(x) for x in row[: k + 1]] for k, row in enumerate(rows)] for rows in (A, turned)
    ]
    *factors, pivots = pair_factor(RATIONAL, *triangles)
    x = pair_solve(RATIONAL, *factors, [Fraction(value) for value in b])
    assert [sum(a * value for a, value in zip(row, x, strict=True)) for row in A] == b
    minors = [Fraction(round(np.linalg.det(np.array(A)[k:, k:]))) for k in reversed(range(size))]
    assert [math.prod(pivots[: k + 1]) for k in range(size)] == minors


def test_pair_statement_solves_in_place():
    """[[2, 7], [1, 4]] x = [11, 6]: triangles of it and of its transpose, rows 8 apart."""
    b = Builder("solve", "A x = x.")
    a, x = b.array("a", 32, role="input"), b.array("x", 2, role="output")
    A = b.array("A", 32)
    b.copy(A[0], a[0])
    b.fill(x[0], 11, 6)
    b.factor_pair(A, 2)
    b.solve_pair(A, x[0])
    rows = [[2, 99], [1, 4], [2, 99], [7, 4]]
    assert outputs(b, a=[y for row in rows for y in [*row, *[0] * 6]]) == [2, 1]
    *_, guards = unroll(b.finish())
    assert [status for status, _ in guards] == ["NOT_POSITIVE_DEFINITE"] * 2


def test_solve_statement_solves_in_place():
    """[[2, 1], [1, 3]] x = [5, 10]: the lower triangle, rows 8 apart."""
    b = Builder("solve", "A x = x.")
    a, x = b.array("a", 16, role="input"), b.array("x", 2, role="output")
    A = b.array("A", 16)
    b.copy(A[0], a[0])
    b.fill(x[0], 5, 10)
    b.factor(A, 2)
    b.solve(A, x[0])
    assert outputs(b, a=[2, 99, *[0] * 6, 1, 3, *[0] * 6]) == [1, 3]
    *_, guards = unroll(b.finish())
    assert [status for status, _ in guards] == ["NOT_POSITIVE_DEFINITE"] * 2
