"""The tape: each distinct operation once, folded by identities that hold and round alike; steps,
which are tapes with names, compacted and specialised.
"""

import random
from fractions import Fraction

import mpmath
import pytest

from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.step import Step, compacted, specialised
from serpentail_codegen.ir.tape import (
    BINARY,
    TERNARY,
    UNARY,
    Tape,
    exact_quotient,
    lanes_of,
    live_nodes,
    operation_count,
    replay,
)
from tests.support.program_runs import FLOATS, RATIONAL
from tests.support.rows import row

INPUTS = 4
SEEDS = range(40)
CONSTANTS = (0, 1, -1, 2, -2, 0.5, -1.0, Fraction(1, 4))  # exact in float64, as are their sums


def grow(rng, algebra, tape, leaves, length=80):
    """Record random operations; return pairs (node, the value computed directly)."""
    pool = [(tape.input(k), leaf) for k, leaf in enumerate(leaves)]
    while len(pool) < length:
        op = rng.choice(BINARY * 2 + UNARY + TERNARY)
        count = next(k for k, ops in enumerate((UNARY, BINARY, TERNARY), 1) if op in ops)
        operands = [_operand(rng, algebra, tape, pool) for _ in range(count)]
        nodes, values = zip(*operands, strict=True)
        rounds = algebra is FLOATS and None not in map(tape.value, nodes)
        if (op == "div" and (values[1] == 0 or rounds)) or (op == "sqrt" and values[0] < 0):
            continue
        value = getattr(algebra, op)(*values)
        if abs(value) < 1e60 and (algebra is FLOATS or value.denominator < 10**60):
            pool.append((getattr(tape, op)(*nodes), value))
    return pool


def _operand(rng, algebra, tape, pool):
    constant = rng.choice(CONSTANTS)
    pair = tape.const(constant), algebra.const(constant)
    return pair if rng.random() < 0.2 else rng.choice(pool)


@pytest.fixture
def tape():
    tape = Tape()
    for index in range(INPUTS):
        tape.input(index)
    return tape


def floats(seed):
    """Random scalars, and the generator of random numbers that made them."""
    rng = random.Random(seed)
    return rng, [rng.uniform(-3, 3) for _ in range(INPUTS)]


def test_recording_is_exact_in_rational_arithmetic():
    for seed in SEEDS:
        rng, tape = random.Random(seed), Tape()
        leaves = [Fraction(rng.randint(-9, 9), rng.randint(1, 9)) for _ in range(INPUTS)]
        pool = grow(rng, RATIONAL, tape, leaves)
        values = replay(tape.nodes, leaves, RATIONAL)
        with row(seed):
            assert [values[node] for node, _ in pool] == [value for _, value in pool]


def test_recording_rounds_as_direct_evaluation_does_and_twice_gives_the_same_nodes():
    """Bit for bit but for the sign of a zero: folding adds no rounding and drops none."""
    for seed in SEEDS:
        (rng, leaves), tape, again = floats(seed), Tape(), Tape()
        pool = grow(rng, FLOATS, tape, leaves)
        values = replay(tape.nodes, leaves, FLOATS)
        replay(tape.nodes, [again.input(k) for k in range(INPUTS)], again)
        with row(seed):
            assert all(values[node] == value for node, value in pool)
            assert again.nodes == tape.nodes
            assert_normal(tape.nodes)


def assert_normal(nodes):
    """Check that nodes are distinct, ordered and in normal form."""
    assert len(set(nodes)) == len(nodes)
    for position, (op, *args) in enumerate(nodes):
        if op in ("input", "const"):
            continue
        assert all(arg < position for arg in args)
        below = [nodes[arg][0] for arg in args]
        assert "neg" not in below or op in ("sqrt", "select")
        assert op != "select" or below[1:] != ["neg", "neg"]
        assert op not in ("add", "mul") or args == sorted(args)
        assert below != ["const", "const"] and (op != "neg" or below != ["sub"])


def test_equal_constants_are_one_node(tape):
    assert len({tape.const(value) for value in (1, 1.0, Fraction(1), True)}) == 1
    assert len({tape.const(value) for value in (0, 0.0, -0.0)}) == 1
    assert tape.const(0.5) == tape.const(Fraction(1, 2))
    assert isinstance(tape.value(tape.const(3.0)), int)
    assert tape.const(Fraction(1, 3)) != tape.const(1 / 3)
    assert [tape.value(node) for node in (0, tape.neg(0), tape.add(0, 1))] == [None] * 3


def test_zero_and_one_vanish(tape):
    a, zero, one, less = 0, tape.const(0), tape.const(1), tape.const(-1)
    assert tape.add(a, zero) == tape.add(zero, a) == tape.sub(a, zero) == a
    assert tape.mul(a, one) == tape.mul(one, a) == tape.div(a, one) == a
    assert tape.mul(a, zero) == tape.mul(zero, a) == tape.div(zero, a) == tape.sub(a, a) == zero
    assert tape.sub(zero, a) == tape.mul(a, less) == tape.div(a, less) == tape.neg(a)
    assert tape.sin(zero) == tape.sqrt(zero) == zero and tape.cos(zero) == tape.sqrt(one) == one
    for numerator in (a, zero, one):
        with pytest.raises(ZeroDivisionError, match="zero"):
            tape.div(numerator, zero)


def test_selection_folds_where_the_choice_is_known_or_makes_no_difference(tape):
    a, b, c = 0, 1, 2
    assert [tape.select(tape.const(x), a, b) for x in (1, 0, -2, Fraction(1, 3))] == [a, b, b, a]
    assert tape.select(c, a, a) == a
    assert tape.select(c, tape.neg(a), tape.neg(b)) == tape.neg(tape.select(c, a, b))
    assert tape.select(tape.neg(c), a, b) != tape.select(c, b, a)  # they differ at c = 0
    assert tape.max(a, a) == a and tape.value(tape.max(tape.const(2), tape.const(3))) == 3


def test_operations_are_as_wide_as_their_operands(tape):
    wide = tape.unit(0, 3)
    lanes = [0] * len(tape.nodes)
    lanes[wide] = 3
    assert lanes_of(("select", 0, 1, wide), lanes) == lanes_of(("select", wide, 0, 1), lanes) == 3
    assert lanes_of(("select", 0, 1, 2), lanes) == 0
    assert lanes_of(("input", 1), [], [0, 5]) == 5 and lanes_of(("input", 1), []) == 0
    with pytest.raises(ValueError, match=r"add .*\[3, 5\]"):
        lanes_of(("add", 0, 1), [3, 5])
    assert tape.lane(0, 2) == 0
    assert [tape.value(tape.lane(wide, k)) for k in range(3)] == [1, 0, 0]
    product = tape.mul(wide, 0)
    assert tape.nodes[tape.lane(product, 2)] == ("lane", product, 2)
    with pytest.raises(TypeError, match="lane"):
        tape.placed(wide, 0, 3, 1)


def test_constants_fold_exactly():
    assert exact_quotient(1, 3) == Fraction(1, 3) and exact_quotient(1.0, 3) == 1 / 3
    assert exact_quotient(1, 3.0) == 1 / 3 and FLOATS.const(Fraction(1, 3)) == 1 / 3
    with mpmath.workdps(50):  # divided in the arithmetic of the run
        many = Numbers(mpmath.mp, mpmath.mpf)
        assert abs(3 * many.const(Fraction(1, 3)) - 1) < mpmath.mpf(10) ** -49
        assert many.const(0.1) == mpmath.mpf(Fraction(0.1).numerator) / Fraction(0.1).denominator


# Steps


def reachable(nodes, node, found):
    """Collect a node and all below it."""
    if node not in found:
        found.add(node)
        if nodes[node][0] not in ("input", "const"):
            for arg in nodes[node][1:]:
                reachable(nodes, arg, found)
    return found


def evaluated(step, **vectors):
    """Return the scalars of a step's outputs."""
    scalars = [scalar for name, _ in step.inputs for scalar in vectors[name]]
    nodes = replay(step.nodes, scalars, FLOATS)
    return [nodes[result] for result in step.results]


def test_compacted_steps_keep_their_meaning_and_drop_what_no_result_reaches():
    """Random steps, most of whose nodes are dead."""
    for seed in SEEDS:
        (rng, scalars), tape = floats(seed), Tape()
        pool = grow(rng, FLOATS, tape, scalars, 25)
        results = tuple(node for node, _ in rng.sample(pool, 3))
        inputs, outputs = (("x", 2), ("y", 2)), (("u", 1), ("w", 2))
        step = Step("step", "Random.", inputs, outputs, tuple(tape.nodes), results)
        small, vectors = compacted(step), {"x": scalars[:2], "y": scalars[2:]}
        with row(seed):
            live = set().union(*(reachable(step.nodes, node, set()) for node in results))
            assert live_nodes(step.nodes, results) == sorted(live)
            count = sum(step.nodes[node][0] in BINARY for node in live)
            assert operation_count(step.nodes, results) == count
            assert evaluated(small, **vectors) == evaluated(step, **vectors)
            assert live_nodes(small.nodes, small.results) == list(range(len(small.nodes)))
            assert small.outputs == outputs and compacted(small) == small
            read = {inputs[step.nodes[n][1] // 2] for n in live if step.nodes[n][0] == "input"}
            assert small.inputs == tuple(entry for entry in inputs if entry in read)


def test_a_specialised_step_is_the_step_at_these_values(tape):
    x, y, z, w = range(4)
    results = (tape.add(tape.mul(x, y), z), tape.div(w, y))
    inputs = (("a", 2), ("b", 2))
    step = Step("step", "Two vectors.", inputs, (("u", 2),), tuple(tape.nodes), results)
    still = specialised(step, "still", a=(0, 2))
    assert (still.name, still.doc, still.outputs) == ("still", step.doc, step.outputs)
    assert still.inputs == (("b", 2),)
    assert evaluated(still, b=(3.0, 5.0)) == evaluated(step, a=(0, 2), b=(3.0, 5.0)) == [3.0, 2.5]
    assert operation_count(still.nodes, still.results) == 1
    assert specialised(step, "step") == step
