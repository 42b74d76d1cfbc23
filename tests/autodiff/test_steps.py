"""Tangents and adjoints of random steps are SymPy's; which vectors they take and give."""

import random
from fractions import Fraction
from functools import cache, partial
from itertools import chain, combinations, product

import mpmath
import numpy as np
import pytest
import sympy

from serpentail_codegen.autodiff.angles import SinesAndCosines
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
from tests.autodiff.test_forward import dot
from tests.support.programs import EXACT, step_of

INPUTS = (("x", 2), ("y", 1), ("z", 2))
OUTPUTS = (("u", 1), ("w", 2))
SYMBOLS = {name: sympy.symbols(f"{name}:{size}", real=True) for name, size in INPUTS}
LEAVES = list(chain(*SYMBOLS.values()))
CONSTANTS = (0, 1, -1, 2, Fraction(1, 3), Fraction(-5, 2))
SEEDS = range(15)
MANY = Numbers(mpmath.mp, mpmath.mpf)
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
    """A constant, or an earlier node; later ones are more likely."""
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
    """A value for every symbol, a direction for every input, a weight for every output."""
    rng = random.Random(1000 + seed)
    sizes = [*INPUTS, *((f"d_{name}", size) for name, size in INPUTS)]
    sizes += [(f"b_{name}", size) for name, size in OUTPUTS]
    return {
        name: [mpmath.mpf(rng.randint(-90, 90)) / rng.randint(7, 30) for _ in range(size)]
        for name, size in sizes
    }


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


def test_vectors_keep_their_order_and_those_that_nothing_needs_vanish():
    inputs, outputs = (("x", 2), ("y", 1)), (("u", 1), ("w", 1))
    two = step_of("two", inputs, outputs, lambda t, a, b, c: [t.mul(a, b), t.mul(b, c)])
    both, back = tangent(two, frozenset("xy")), adjoint(two, frozenset("xy"), BOTH)
    assert both.inputs == (*inputs, ("d_x", 2), ("d_y", 1))
    assert both.outputs == (*outputs, ("d_u", 1), ("d_w", 1))
    assert back.inputs == (*inputs, ("b_u", 1), ("b_w", 1))
    assert back.outputs == (("b_x", 2), ("b_y", 1))

    inputs = (*inputs, ("z", 1))
    step = step_of("sine", inputs, (("u", 1),), lambda t, a, _b, c, _d: [t.mul(a, t.sin(c))])
    assert not {"z", "d_z"} & dict(tangent(step, frozenset("xz")).inputs).keys()
    numbers = {"x": [2.0, 3.0], "y": [0.5], "b_u": [7.0]}
    back = evaluated(adjoint(step, ALL, frozenset("u")), numbers, Numbers(np, float))
    assert back == {"b_x": [7 * np.sin(0.5), 0], "b_y": [7 * 2 * np.cos(0.5)], "b_z": [0]}


def test_an_output_that_counts_twice_has_the_sum_of_its_weights():
    nodes, outputs = (("input", 0), ("mul", 0, 0)), (("u", 1), ("w", 1))
    step = Step("same", "", (("x", 1),), outputs, nodes, (1, 1))
    vectors = {"x": [Fraction(3)], "b_u": [Fraction(5)], "b_w": [Fraction(7)]}
    for given, gradient in (("uw", 72), ("w", 42)):
        found = evaluated(adjoint(step, frozenset("x"), frozenset(given)), vectors, EXACT)
        assert found == {"b_x": [gradient]}


def test_a_linear_step_has_no_products_and_no_values_in_its_derivatives():
    line = lambda t, a, b, c: [t.sub(t.add(a, t.mul(t.const(3), b)), c)]  # noqa: E731
    step = step_of("line", (("x", 2), ("y", 1)), (("u", 1),), line)
    forward, back = tangent(step, frozenset("xy")), adjoint(step, frozenset("xy"), frozenset("u"))
    alone = operation_count(step.nodes, step.results)
    assert operation_count(forward.nodes, forward.results[1:]) == alone
    assert back.inputs == (("b_u", 1),)
    assert operation_count(back.nodes, back.results) == 1


def test_the_adjoint_of_an_angle_takes_two_products():
    """Of y = R v it is y_1 b_0 - y_0 b_1, where b are the adjoints of y."""

    def turned(t, c, s, v, w):
        return [t.add(t.mul(c, v), t.mul(s, w)), t.sub(t.mul(c, w), t.mul(s, v))]

    step = step_of("turn", (("joint", 2), ("v", 2)), (("y", 2),), turned)
    kind = frozenset({("joint", SinesAndCosines(1, ((0, -1, 1), (0, 1, 0))))})
    back = adjoint(step, frozenset({"joint"}), frozenset({"y"}), kind)
    c, s, v, w, *b = sympy.symbols("c s v w b0 b1")
    nodes = replay(back.nodes, [c, s, v, w, *b], Numbers(sympy, sympy.sympify))
    (found,) = (nodes[r] for r in back.results)
    assert sympy.expand(found - (c * w - s * v) * b[0] + (c * v + s * w) * b[1]) == 0
    assert operation_count(back.nodes, back.results) == 2 * 3 + 3  # y, then two products
