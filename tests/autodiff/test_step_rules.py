"""Derivatives of steps, rule by rule, and which vectors they take and give."""

import random
from fractions import Fraction
from functools import partial
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy

from serpentail_codegen.autodiff.step import adjoint, tangent
from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import Tape, live_nodes, operation_count
from tests.support.random_steps import (
    FRACTIONS,
    INPUTS,
    MANY,
    SEEDS,
    assert_close,
    evaluated,
    point,
    random_step,
)

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
