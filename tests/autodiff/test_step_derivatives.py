"""Tangents and adjoints of random steps: what SymPy says of the same formulas."""

from fractions import Fraction
from itertools import combinations

import mpmath
import pytest
import sympy

from serpentail_codegen.autodiff.step import adjoint, tangent
from tests.support.random_steps import (
    FRACTIONS,
    INPUTS,
    LEAVES,
    OUTPUTS,
    SEEDS,
    assert_close,
    evaluated,
    flat,
    point,
    random_step,
)

ONLY_ARITHMETIC = ("neg", "add", "sub", "mul", "div", "select")


def subsets(vectors):
    """All sets of names of some vectors but the empty one."""
    names = [name for name, _ in vectors]
    return [frozenset(c) for size in range(1, len(names) + 1) for c in combinations(names, size)]


def jacobian(expressions, vectors, exact=False):
    """SymPy's derivatives at a point: one row for each result, one column for each symbol."""
    derivatives = [[sympy.diff(e, leaf) for leaf in LEAVES] for e in expressions]
    at = flat(vectors, [name for name, _ in INPUTS])
    if exact:
        values = {leaf: sympy.Rational(x) for leaf, x in zip(LEAVES, at, strict=True)}
        return [[Fraction(str(d.subs(values))) for d in row] for row in derivatives]
    return sympy.lambdify(LEAVES, derivatives, modules="mpmath")(*at)


def masked(vectors, spans, names, prefix):
    """The scalars of all vectors, zero where a vector is not named."""
    scalars = ((name, scalar) for name, _ in spans for scalar in vectors[prefix + name])
    return [scalar if name in names else 0 for name, scalar in scalars]


@pytest.mark.parametrize("seed", SEEDS)
def test_tangents_are_sympys_derivatives_in_a_direction(seed):
    step, expressions = random_step(seed)
    vectors = point(seed)
    J, values = jacobian(expressions, vectors), evaluated(step, vectors)
    for active in subsets(INPUTS):
        direction = masked(vectors, INPUTS, active, "d_")
        found = evaluated(tangent(step, active), vectors)
        assert_close(
            flat(found, ["u", "w"], "d_"),
            [sum(a * b for a, b in zip(row, direction, strict=True)) for row in J],
        )
        assert {name: found[name] for name in ("u", "w")} == values


@pytest.mark.parametrize("seed", SEEDS)
def test_adjoints_are_sympys_gradients_of_a_weighted_sum(seed):
    step, expressions = random_step(seed)
    vectors = point(seed)
    J = jacobian(expressions, vectors)
    for given in subsets(OUTPUTS):
        weights = masked(vectors, OUTPUTS, given, "b_")
        gradient = iter(
            [
                sum(w * a for w, a in zip(weights, column, strict=True))
                for column in zip(*J, strict=True)
            ]
        )
        expected = {name: [next(gradient) for _ in range(size)] for name, size in INPUTS}
        for wanted in subsets(INPUTS):
            found = evaluated(adjoint(step, wanted, given), vectors)
            assert set(found) == {f"b_{name}" for name in wanted}
            for name in wanted:
                assert_close(found[f"b_{name}"], expected[name])


@pytest.mark.parametrize("seed", SEEDS)
def test_both_are_exact_in_rational_arithmetic(seed):
    """Without functions nothing rounds: the derivatives are SymPy's, to the last digit."""
    step, expressions = random_step(seed, operations=ONLY_ARITHMETIC, length=18)
    vectors = point(seed, exact=True)
    J = jacobian(expressions, vectors, exact=True)
    direction = masked(vectors, INPUTS, "xyz", "d_")
    found = evaluated(tangent(step, frozenset("xyz")), vectors, FRACTIONS)
    expected = [sum(a * b for a, b in zip(row, direction, strict=True)) for row in J]
    assert flat(found, ["u", "w"], "d_") == expected
    weights = masked(vectors, OUTPUTS, "uw", "b_")
    found = evaluated(adjoint(step, frozenset("xyz"), frozenset("uw")), vectors, FRACTIONS)
    expected = [
        sum(w * a for w, a in zip(weights, column, strict=True)) for column in zip(*J, strict=True)
    ]
    assert flat(found, "xyz", "b_") == expected


@pytest.mark.parametrize("seed", SEEDS)
def test_adjoints_are_the_transpose_of_tangents(seed):
    """b^T (J d) = (J^T b)^T d."""
    step, _ = random_step(seed)
    vectors = point(seed)
    for active in subsets(INPUTS):
        for given in subsets(OUTPUTS):
            forward, back = (
                evaluated(tangent(step, active), vectors),
                evaluated(adjoint(step, active, given), vectors),
            )
            one = sum(
                a * b
                for n in given
                for a, b in zip(vectors[f"b_{n}"], forward[f"d_{n}"], strict=True)
            )
            two = sum(
                a * b
                for n in active
                for a, b in zip(back[f"b_{n}"], vectors[f"d_{n}"], strict=True)
            )
            assert_close([one], [two])


@pytest.mark.parametrize("seed", SEEDS)
def test_tangents_of_adjoints_are_the_symmetric_hessian(seed):
    step, expressions = random_step(seed, length=16)
    vectors = point(seed)
    second = tangent(adjoint(step, frozenset("xyz"), frozenset("u")), frozenset("xyz"))
    at, H = flat(vectors, "xyz"), []
    for k in range(len(LEAVES)):
        unit = iter(mpmath.mpf(j == k) for j in range(len(LEAVES)))
        directions = {f"d_{name}": [next(unit) for _ in range(size)] for name, size in INPUTS}
        H.append(
            flat(evaluated(second, vectors | {"b_u": [mpmath.mpf(1)]} | directions), "xyz", "d_b_")
        )
    terms = [sympy.diff(expressions[0], a, b) for a in LEAVES for b in LEAVES]
    expected = sympy.lambdify(LEAVES, terms, modules="mpmath")(*at)
    assert_close(flat({"": [h for row in H for h in row]}, [""]), expected)
    assert_close([h for row in H for h in row], [h for row in zip(*H, strict=True) for h in row])
