"""Tangents and adjoints of steps: what they compute is what SymPy's derivatives of the same
formulas say.
"""

import random
from fractions import Fraction
from functools import partial
from itertools import chain, combinations
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

INPUTS = (("x", 2), ("y", 1), ("z", 2))
OUTPUTS = (("u", 1), ("w", 2))
SYMBOLS = {name: sympy.symbols(f"{name}:{size}", real=True) for name, size in INPUTS}
LEAVES = list(chain(*SYMBOLS.values()))
CONSTANTS = (0, 1, -1, 2, Fraction(1, 3), Fraction(-5, 2))
SEEDS = range(15)
DIGITS = 50
MANY = Numbers(mpmath.mp, mpmath.mpf)
FRACTIONS = Numbers(SimpleNamespace(sin=None, cos=None, sqrt=None), Fraction)
RESIDUE = 1e-35  # of values that lose at most 15 digits
ONLY_ARITHMETIC = ("neg", "add", "sub", "mul", "div", "select")


@pytest.fixture(autouse=True)
def many_digits():
    """Compute with many digits."""
    with mpmath.workdps(DIGITS):
        yield


def subsets(vectors):
    """All sets of names of some vectors but the empty one."""
    names = [name for name, _ in vectors]
    return [frozenset(c) for size in range(1, len(names) + 1) for c in combinations(names, size)]


def grow(rng, operations=(*UNARY, *BINARY, *BINARY, *TERNARY), length=30):
    """A tape of random operations, and pairs of a node and its SymPy expression; operands may
    repeat.
    """
    tape = Tape()
    pool = [(tape.input(k), leaf) for k, leaf in enumerate(LEAVES)]
    while len(pool) < length:
        op = rng.choice(operations)
        (a, x), (b, y) = operand(rng, tape, pool), operand(rng, tape, pool)
        if rng.random() < 0.15:
            b, y = a, x
        if op == "sqrt":  # of what is positive whatever its operand
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
    """A constant, or something recorded before, the later the likelier."""
    if rng.random() < 0.15:
        value = rng.choice(CONSTANTS)
        return tape.const(value), sympy.Rational(value)
    return pool[max(rng.randrange(len(pool)), rng.randrange(len(pool)))]


def random_step(seed, **options):
    """A random step and the expressions of its results, one of them an input now and then."""
    rng = random.Random(seed)
    tape, pool = grow(rng, **options)
    chosen = [rng.choice(pool[-6:]), rng.choice(pool), rng.choice(pool[-6:])]
    step = Step(
        f"random{seed}",
        "Random.",
        INPUTS,
        OUTPUTS,
        tuple(tape.nodes),
        tuple(node for node, _ in chosen),
    )
    return step, [e for _, e in chosen]


def point(seed, exact=False):
    """A value for every symbol, and a weight or direction for everything that needs one."""
    rng = random.Random(1000 + seed)

    def number():
        value = Fraction(rng.randint(-90, 90), rng.randint(7, 30))
        return value if exact else mpmath.mpf(value.numerator) / value.denominator

    vectors = {name: [number() for _ in range(size)] for name, size in INPUTS}
    vectors |= {f"d_{name}": [number() for _ in range(size)] for name, size in INPUTS}
    return vectors | {f"b_{name}": [number() for _ in range(size)] for name, size in OUTPUTS}


def evaluated(step, vectors, algebra=MANY):
    """The outputs of a step by name."""
    nodes = replay(
        step.nodes, [scalar for name, _ in step.inputs for scalar in vectors[name]], algebra
    )
    results = iter(step.results)
    return {name: [nodes[next(results)] for _ in range(size)] for name, size in step.outputs}


def flat(vectors, names, prefix=""):
    """The scalars of named vectors in order."""
    return [scalar for name in names for scalar in vectors[prefix + name]]


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


def assert_close(found, expected):
    for one, other in zip(found, expected, strict=True):
        assert abs(one - other) <= RESIDUE * (1 + abs(other)), (one, other)


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


# One rule after the other


def step_of_rule(build, names=("x",)):
    """A step of one operation: vectors of one scalar each, one result."""
    tape = Tape()
    nodes = [tape.input(k) for k in range(len(names))]
    result = build(tape, *nodes)
    return Step(
        "rule", "A rule.", tuple((n, 1) for n in names), (("u", 1),), tuple(tape.nodes), (result,)
    )


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
    "second": (
        lambda t, x, y: t.select(y, y, t.mul(x, y)),
        X * Y,
    ),  # y is negative where the rules are tried
    "constant": (lambda t, x: t.const(3), sympy.Integer(3)),
}


@pytest.mark.parametrize("rule", RULES)
def test_each_rule_is_sympys(rule):
    build, expression = RULES[rule]
    names = ("x", "y") if expression.has(Y) else ("x",)
    step, at = step_of_rule(build, names), {X: mpmath.mpf(13) / 9, Y: mpmath.mpf(-7) / 5}
    for name in names:
        symbol = {"x": X, "y": Y}[name]
        expected = sympy.lambdify((X, Y), sympy.diff(expression, symbol), modules="mpmath")(
            at[X], at[Y]
        )
        vectors = {
            "x": [at[X]],
            "y": [at[Y]],
            "d_x": [mpmath.mpf(1)],
            "d_y": [mpmath.mpf(1)],
            "b_u": [mpmath.mpf(1)],
        }
        assert_close(evaluated(tangent(step, frozenset(name)), vectors)["d_u"], [expected])
        assert_close(
            evaluated(adjoint(step, frozenset(name), frozenset("u")), vectors)[f"b_{name}"],
            [expected],
        )


# Which vectors there are


def test_vectors_keep_their_order_and_derivatives_follow():
    tape = Tape()
    a, b, c = (tape.input(k) for k in range(3))
    step = Step(
        "two",
        "Two.",
        (("x", 2), ("y", 1)),
        (("u", 1), ("w", 1)),
        (*tape.nodes, ("mul", a, b), ("mul", b, c)),
        (3, 4),
    )
    both = tangent(step, frozenset("xy"))
    assert both.inputs == (("x", 2), ("y", 1), ("d_x", 2), ("d_y", 1))
    assert both.outputs == (("u", 1), ("w", 1), ("d_u", 1), ("d_w", 1))
    back = adjoint(step, frozenset("xy"), frozenset("uw"))
    assert back.outputs == (("b_x", 2), ("b_y", 1))
    assert [name for name, _ in back.inputs] == ["x", "y", "b_u", "b_w"]


def test_inputs_that_no_output_needs_vanish_and_have_zero_adjoints():
    tape = Tape()
    a, _, c = (tape.input(k) for k in range(3))
    nodes = (*tape.nodes, ("sin", c))
    step = Step(
        "part", "Part.", (("x", 2), ("y", 1), ("z", 1)), (("u", 1),), (*nodes, ("mul", a, 3)), (4,)
    )
    forward = tangent(step, frozenset("xz"))
    assert "z" not in dict(forward.inputs) and "d_z" not in dict(forward.inputs)
    numbers = {"x": [2.0, 3.0], "y": [0.5], "b_u": [7.0]}
    floats = Numbers(SimpleNamespace(sin=np.sin, cos=np.cos, sqrt=np.sqrt), float)
    back = evaluated(adjoint(step, frozenset("xyz"), frozenset("u")), numbers, floats)
    assert back == {"b_x": [7 * np.sin(0.5), 0], "b_y": [7 * 2 * np.cos(0.5)], "b_z": [0]}


def test_an_output_that_counts_twice_has_the_sum_of_its_weights():
    step = Step(
        "same",
        "One node, two outputs.",
        (("x", 1),),
        (("u", 1), ("w", 1)),
        (("input", 0), ("mul", 0, 0)),
        (1, 1),
    )
    vectors = {"x": [Fraction(3)], "b_u": [Fraction(5)], "b_w": [Fraction(7)]}
    assert evaluated(adjoint(step, frozenset("x"), frozenset("uw")), vectors, FRACTIONS) == {
        "b_x": [72]
    }
    assert evaluated(adjoint(step, frozenset("x"), frozenset("w")), vectors, FRACTIONS) == {
        "b_x": [42]
    }


@pytest.mark.parametrize("seed", SEEDS)
def test_rows_are_their_directions_one_by_one(seed):
    step, _ = random_step(seed)
    vectors, lanes = point(seed), 3
    rng = random.Random(seed)
    rows = {
        f"d_{n}": [
            np.array([mpmath.mpf(rng.randint(-9, 9)) for _ in range(lanes)]) for _ in range(s)
        ]
        for n, s in INPUTS
    }
    forward = tangent(step, frozenset("xyz"))
    wide = evaluated(forward, vectors | rows)
    for lane in range(lanes):
        alone = evaluated(
            forward, vectors | {name: [row[lane] for row in xs] for name, xs in rows.items()}
        )
        for name in ("d_u", "d_w"):
            assert [MANY.lane(x, lane) for x in wide[name]] == alone[name]


def test_a_linear_step_has_no_products_and_no_values_in_its_derivatives():
    tape = Tape()
    a, b, c = (tape.input(k) for k in range(3))
    total = tape.sub(tape.add(a, tape.mul(tape.const(3), b)), c)
    step = Step("linear", "Linear.", (("x", 2), ("y", 1)), (("u", 1),), tuple(tape.nodes), (total,))
    forward, back = tangent(step, frozenset("xy")), adjoint(step, frozenset("xy"), frozenset("u"))
    assert operation_count(forward.nodes, forward.results[1:]) == operation_count(
        step.nodes, step.results
    )
    assert back.inputs == (("b_u", 1),)
    assert operation_count(back.nodes, back.results) == 1


@pytest.mark.parametrize(
    "derive",
    [
        partial(tangent, active=frozenset("xz")),
        partial(adjoint, wanted=frozenset("xz"), given=frozenset("u")),
    ],
)
def test_derivatives_are_compact(derive):
    """No node and no vector is left that no output needs."""
    for seed in SEEDS:
        step = derive(random_step(seed)[0])
        assert live_nodes(step.nodes, step.results) == list(range(len(step.nodes)))
        read = {args[0] for op, *args in step.nodes if op == "input"}
        first = 0
        for _, size in step.inputs:
            assert read & set(range(first, first + size))
            first += size
