"""Tangents and adjoints of steps: what SymPy says of the same formulas, rule by rule and of random
steps, and which vectors they take and give.
"""

import random
from fractions import Fraction
from functools import cache, partial
from itertools import chain, combinations, product
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy

from serpentail_codegen.autodiff.step import adjoint, tangent
from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import (
    BINARY,
    TERNARY,
    UNARY,
    Tape,
    live_nodes,
    operation_count,
    replay,
)
from tests.support.rows import row

INPUTS = (("x", 2), ("y", 1), ("z", 2))
OUTPUTS = (("u", 1), ("w", 2))
SYMBOLS = {name: sympy.symbols(f"{name}:{size}", real=True) for name, size in INPUTS}
LEAVES = list(chain(*SYMBOLS.values()))
CONSTANTS = (0, 1, -1, 2, Fraction(1, 3), Fraction(-5, 2))
SEEDS = range(15)
MANY = Numbers(mpmath.mp, mpmath.mpf)
FRACTIONS = Numbers(SimpleNamespace(sin=None, cos=None, sqrt=None), Fraction)
RESIDUE = 1e-35  # of values that lose at most 15 digits
ALL, BOTH = frozenset("xyz"), frozenset("uw")


@pytest.fixture(autouse=True)
def many_digits():
    with mpmath.workdps(50):
        yield


def grow(rng):
    """A tape of random operations, and pairs of a node and its SymPy expression; operands may
    repeat.
    """
    tape = Tape()
    pool = [(tape.input(k), leaf) for k, leaf in enumerate(LEAVES)]
    while len(pool) < 30:
        op = rng.choice((*UNARY, *BINARY, *BINARY, *TERNARY))
        (a, x), (b, y) = operand(rng, tape, pool), operand(rng, tape, pool)
        if rng.random() < 0.15:
            b, y = a, x
        if op == "sqrt":  # of a node that is positive for every operand
            a, x = tape.add(tape.mul(a, a), tape.const(1)), x * x + 1
        if op == "div":
            b, y = tape.add(tape.mul(b, b), tape.const(2)), y * y + 2
        if op in UNARY:
            pool.append((getattr(tape, op)(a), -x if op == "neg" else getattr(sympy, op)(x)))
        elif op in TERNARY:
            c, z = operand(rng, tape, pool)
            pool.append((tape.select(c, a, b), sympy.Piecewise((x, z > 0), (y, True))))
        else:
            e = {"add": x + y, "sub": x - y, "mul": x * y, "div": x / y}[op]
            pool.append((getattr(tape, op)(a, b), e))
    return tape, pool


def operand(rng, tape, pool):
    """Return a constant, or an earlier node; later ones are more likely."""
    if rng.random() < 0.15:
        value = rng.choice(CONSTANTS)
        return tape.const(value), sympy.Rational(value)
    return pool[max(rng.randrange(len(pool)), rng.randrange(len(pool)))]


@cache
def random_step(seed):
    """A random step and the expressions of its results, one of them an input now and then."""
    rng = random.Random(seed)
    tape, pool = grow(rng)
    chosen = [rng.choice(pool[-6:]), rng.choice(pool), rng.choice(pool[-6:])]
    results, expressions = zip(*chosen, strict=True)
    return Step(f"random{seed}", "", INPUTS, OUTPUTS, tuple(tape.nodes), results), expressions


def point(seed):
    """Return a value for every symbol, and a weight or direction for everything that needs one."""
    rng = random.Random(1000 + seed)

    def number():
        return mpmath.mpf(rng.randint(-90, 90)) / rng.randint(7, 30)

    vectors = {name: [number() for _ in range(size)] for name, size in INPUTS}
    vectors |= {f"d_{name}": [number() for _ in range(size)] for name, size in INPUTS}
    return vectors | {f"b_{name}": [number() for _ in range(size)] for name, size in OUTPUTS}


def evaluated(step, vectors, algebra=MANY):
    """The outputs of a step by name."""
    nodes = replay(step.nodes, flat(vectors, [name for name, _ in step.inputs]), algebra)
    results = iter(step.results)
    return {name: [nodes[next(results)] for _ in range(size)] for name, size in step.outputs}


def flat(vectors, names, prefix=""):
    """The scalars of named vectors in order."""
    return [scalar for name in names for scalar in vectors[prefix + name]]


def assert_close(found, expected):
    for one, other in zip(found, expected, strict=True):
        assert abs(one - other) <= RESIDUE * (1 + abs(other)), (one, other)


def subsets(vectors):
    """All sets of names of some vectors but the empty one."""
    names = [name for name, _ in vectors]
    return [frozenset(c) for size in range(1, len(names) + 1) for c in combinations(names, size)]


def jacobian(expressions, vectors):
    """SymPy's derivatives at a point: one row for each result, one column for each symbol."""
    derivatives = [[sympy.diff(e, leaf) for leaf in LEAVES] for e in expressions]
    at = flat(vectors, [name for name, _ in INPUTS])
    return sympy.lambdify(LEAVES, derivatives, modules="mpmath")(*at)


def masked(vectors, spans, names, prefix):
    scalars = ((name, scalar) for name, _ in spans for scalar in vectors[prefix + name])
    return [scalar if name in names else 0 for name, scalar in scalars]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


# Random steps


@pytest.mark.parametrize("seed", SEEDS)
def test_tangents_and_adjoints_are_sympys(seed):
    """Derivatives in a direction, gradients of a weighted sum, and b^T (J d) = (J^T b)^T d."""
    step, expressions = random_step(seed)
    vectors = point(seed)
    J, values = jacobian(expressions, vectors), evaluated(step, vectors)
    forward = {active: evaluated(tangent(step, active), vectors) for active in subsets(INPUTS)}
    for active, found in forward.items():
        direction = masked(vectors, INPUTS, active, "d_")
        assert_close(flat(found, "uw", "d_"), [dot(entries, direction) for entries in J])
        assert {name: found[name] for name in "uw"} == values
    for given in subsets(OUTPUTS):
        weights = masked(vectors, OUTPUTS, given, "b_")
        gradient = iter([dot(weights, column) for column in zip(*J, strict=True)])
        expected = {name: [next(gradient) for _ in range(size)] for name, size in INPUTS}
        for wanted in subsets(INPUTS):
            found = evaluated(adjoint(step, wanted, given), vectors)
            assert set(found) == {f"b_{name}" for name in wanted}
            for name in wanted:
                assert_close(found[f"b_{name}"], expected[name])
            one = sum(dot(vectors[f"b_{n}"], forward[wanted][f"d_{n}"]) for n in given)
            assert_close([one], [sum(dot(found[f"b_{n}"], vectors[f"d_{n}"]) for n in wanted)])


def test_rows_are_their_directions_one_by_one():
    for seed in SEEDS:
        vectors, rng = point(seed), random.Random(seed)
        rows = {
            f"d_{n}": [np.array([mpmath.mpf(rng.randint(-9, 9)) for _ in "abc"]) for _ in range(s)]
            for n, s in INPUTS
        }
        forward = tangent(random_step(seed)[0], ALL)
        wide = evaluated(forward, vectors | rows)
        for lane in range(3):
            one = {name: [x[lane] for x in xs] for name, xs in rows.items()}
            alone = evaluated(forward, vectors | one)
            for name in ("d_u", "d_w"):
                with row(seed, lane, name):
                    assert [MANY.lane(x, lane) for x in wide[name]] == alone[name]


def test_derivatives_are_compact():
    """No node and no vector is left that no output needs."""
    some = frozenset("xz")
    for seed, derive in product(SEEDS, (tangent, partial(adjoint, given=frozenset("u")))):
        step = derive(random_step(seed)[0], some)
        assert live_nodes(step.nodes, step.results) == list(range(len(step.nodes)))
        read, first = {args[0] for op, *args in step.nodes if op == "input"}, 0
        for _, size in step.inputs:
            assert read & set(range(first, first + size))
            first += size


# One rule after the other

X, Y = sympy.symbols("x y", positive=True)
RULES = {
    "neg": (lambda t, x: t.neg(x), -X),
    "sin": (lambda t, x: t.sin(x), sympy.sin(X)),
    "cos": (lambda t, x: t.cos(x), sympy.cos(X)),
    "sqrt": (lambda t, x: t.sqrt(x), sympy.sqrt(X)),
    "twice": (lambda t, x: t.add(x, x), 2 * X),
    "square": (lambda t, x: t.mul(x, x), X**2),
    "one": (lambda t, x: t.div(x, x), sympy.Integer(1)),
    "inverse": (lambda t, x: t.div(t.const(1), x), 1 / X),
    "scaled": (lambda t, x: t.mul(t.const(Fraction(2, 7)), x), X * sympy.Rational(2, 7)),
    "fourth": (lambda t, x: t.mul(t.mul(x, x), t.mul(x, x)), X**4),
    "add": (lambda t, x, y: t.add(x, y), X + Y),
    "sub": (lambda t, x, y: t.sub(x, y), X - Y),
    "mul": (lambda t, x, y: t.mul(x, y), X * Y),
    "div": (lambda t, x, y: t.div(x, y), X / Y),
    "itself": (lambda t, x: x, X),
    "max": (lambda t, x, y: t.max(x, y), sympy.Piecewise((X, X > Y), (Y, True))),
    "first": (lambda t, x, y: t.select(x, t.mul(x, y), y), X * Y),
    # y is negative where the rules are tried
    "second": (lambda t, x, y: t.select(y, y, t.mul(x, y)), X * Y),
    "constant": (lambda t, x: t.const(3), sympy.Integer(3)),
}


def step_of(build, inputs, outputs=(("u", 1),)):
    """A step recorded by ``build(tape, *nodes)``."""
    tape = Tape()
    results = build(tape, *(tape.input(k) for k in range(sum(size for _, size in inputs))))
    results = results if isinstance(results, tuple) else (results,)
    return Step("rule", "A rule.", inputs, outputs, tuple(tape.nodes), results)


def test_each_rule_is_sympys():
    at, one = {X: mpmath.mpf(13) / 9, Y: mpmath.mpf(-7) / 5}, [mpmath.mpf(1)]
    vectors = {"x": [at[X]], "y": [at[Y]], "d_x": one, "d_y": one, "b_u": one}
    for rule, (build, expression) in RULES.items():
        names = ("x", "y") if expression.has(Y) else ("x",)
        step = step_of(build, tuple((n, 1) for n in names))
        for name in names:
            derivative = sympy.diff(expression, {"x": X, "y": Y}[name])
            expected = sympy.lambdify((X, Y), derivative, modules="mpmath")(at[X], at[Y])
            forward = evaluated(tangent(step, frozenset(name)), vectors)
            back = evaluated(adjoint(step, frozenset(name), frozenset("u")), vectors)
            with row(rule, name):
                assert_close([*forward["d_u"], *back[f"b_{name}"]], [expected, expected])


# Which vectors there are


def test_vectors_keep_their_order_and_derivatives_follow():
    two = step_of(
        lambda t, a, b, c: (t.mul(a, b), t.mul(b, c)), (("x", 2), ("y", 1)), (("u", 1), ("w", 1))
    )
    both = tangent(two, frozenset("xy"))
    assert both.inputs == (("x", 2), ("y", 1), ("d_x", 2), ("d_y", 1))
    assert both.outputs == (("u", 1), ("w", 1), ("d_u", 1), ("d_w", 1))
    back = adjoint(two, frozenset("xy"), BOTH)
    assert back.outputs == (("b_x", 2), ("b_y", 1))
    assert [name for name, _ in back.inputs] == ["x", "y", "b_u", "b_w"]


def test_inputs_that_no_output_needs_vanish_and_have_zero_adjoints():
    inputs = (("x", 2), ("y", 1), ("z", 1))
    step = step_of(lambda t, a, _b, c, _d: t.mul(a, t.sin(c)), inputs)
    names = dict(tangent(step, frozenset("xz")).inputs)
    assert not {"z", "d_z"} & set(names)
    numbers = {"x": [2.0, 3.0], "y": [0.5], "b_u": [7.0]}
    back = evaluated(adjoint(step, ALL, frozenset("u")), numbers, Numbers(np, float))
    assert back == {"b_x": [7 * np.sin(0.5), 0], "b_y": [7 * 2 * np.cos(0.5)], "b_z": [0]}


def test_an_output_that_counts_twice_has_the_sum_of_its_weights():
    step = Step(
        "same", "", (("x", 1),), (("u", 1), ("w", 1)), (("input", 0), ("mul", 0, 0)), (1, 1)
    )
    vectors = {"x": [Fraction(3)], "b_u": [Fraction(5)], "b_w": [Fraction(7)]}
    for given, gradient in (("uw", 72), ("w", 42)):
        found = evaluated(adjoint(step, frozenset("x"), frozenset(given)), vectors, FRACTIONS)
        assert found == {"b_x": [gradient]}


def test_a_linear_step_has_no_products_and_no_values_in_its_derivatives():
    step = step_of(
        lambda t, a, b, c: t.sub(t.add(a, t.mul(t.const(3), b)), c), (("x", 2), ("y", 1))
    )
    forward, back = tangent(step, frozenset("xy")), adjoint(step, frozenset("xy"), frozenset("u"))
    alone = operation_count(step.nodes, step.results)
    assert operation_count(forward.nodes, forward.results[1:]) == alone
    assert back.inputs == (("b_u", 1),)
    assert operation_count(back.nodes, back.results) == 1
