"""The tape: each distinct operation once, folded by identities that hold and round alike."""

import random
from fractions import Fraction

import mpmath
import pytest

from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.tape import BINARY, UNARY, Tape, exact_quotient, lanes_of, replay
from tests.support.algebras import FLOATS, RATIONAL
from tests.support.random_tapes import INPUTS, SEEDS, grow


@pytest.fixture
def tape():
    """A tape with its inputs recorded."""
    tape = Tape()
    for index in range(INPUTS):
        tape.input(index)
    return tape


@pytest.mark.parametrize("seed", SEEDS)
def test_recording_is_exact_in_rational_arithmetic(seed):
    rng, tape = random.Random(seed), Tape()
    leaves = [Fraction(rng.randint(-9, 9), rng.randint(1, 9)) for _ in range(INPUTS)]
    pool = grow(rng, RATIONAL, tape, leaves)
    values = replay(tape.nodes, leaves, RATIONAL)
    assert [values[node] for node, _ in pool] == [value for _, value in pool]


@pytest.mark.parametrize("seed", SEEDS)
def test_recording_rounds_as_direct_evaluation_does(seed):
    """Bit for bit but for the sign of a zero: folding adds no rounding and drops none."""
    rng, tape = random.Random(seed), Tape()
    leaves = [rng.uniform(-3, 3) for _ in range(INPUTS)]
    pool = grow(rng, FLOATS, tape, leaves)
    values = replay(tape.nodes, leaves, FLOATS)
    assert [values[node].hex() for node, value in pool if value] == [
        value.hex() for _, value in pool if value
    ]
    assert all(values[node] == 0 for node, value in pool if not value)


@pytest.mark.parametrize("seed", SEEDS)
def test_recording_twice_gives_the_same_nodes(seed):
    rng, tape, again = random.Random(seed), Tape(), Tape()
    grow(rng, FLOATS, tape, [rng.uniform(-3, 3) for _ in range(INPUTS)])
    replay(tape.nodes, [again.input(k) for k in range(INPUTS)], again)
    assert again.nodes == tape.nodes


@pytest.mark.parametrize("seed", SEEDS)
def test_nodes_are_distinct_ordered_and_in_normal_form(seed):
    rng, tape = random.Random(seed), Tape()
    grow(rng, FLOATS, tape, [rng.uniform(-3, 3) for _ in range(INPUTS)])
    assert len(set(tape.nodes)) == len(tape.nodes)
    for position, (op, *args) in enumerate(tape.nodes):
        if op in ("input", "const"):
            continue
        assert all(arg < position for arg in args)
        below = [tape.nodes[arg][0] for arg in args]
        assert "neg" not in below or op in ("sqrt", "select")
        assert op != "select" or below[1:] != ["neg", "neg"]
        assert op not in ("add", "mul") or args == sorted(args)
        assert below != ["const", "const"]
        assert op != "neg" or below[0] not in ("sub",)


@pytest.mark.parametrize("op", UNARY + BINARY)
def test_same_operation_is_the_same_node(tape, op):
    arguments = (2, 1) if op in BINARY else (2,)
    node = getattr(tape, op)(*arguments)
    size = len(tape.nodes)
    assert getattr(tape, op)(*arguments) == node
    assert len(tape.nodes) == size
    assert node == size - 1


def test_equal_constants_are_one_node():
    tape = Tape()
    assert len({tape.const(value) for value in (1, 1.0, Fraction(1), True)}) == 1
    assert len({tape.const(value) for value in (0, 0.0, -0.0)}) == 1
    assert tape.const(0.5) == tape.const(Fraction(1, 2))
    assert isinstance(tape.value(tape.const(3.0)), int)
    assert tape.const(Fraction(1, 3)) != tape.const(1 / 3)
    assert tape.value(tape.const(-2.5)) == -2.5


def test_input_is_not_a_constant(tape):
    assert [tape.value(node) for node in (0, tape.neg(0), tape.add(0, 1))] == [None] * 3


def test_zero_and_one_vanish(tape):
    a, zero, one = 0, tape.const(0), tape.const(1)
    assert tape.add(a, zero) == tape.add(zero, a) == tape.sub(a, zero) == a
    assert tape.mul(a, one) == tape.mul(one, a) == tape.div(a, one) == a
    assert tape.mul(a, zero) == tape.mul(zero, a) == tape.div(zero, a) == tape.sub(a, a) == zero
    assert (
        tape.sub(zero, a)
        == tape.mul(a, tape.const(-1))
        == tape.div(a, tape.const(-1))
        == tape.neg(a)
    )
    assert tape.sin(zero) == tape.sqrt(zero) == zero
    assert tape.cos(zero) == tape.sqrt(one) == one


def test_functions_of_other_constants_are_left_to_the_target(tape):
    for op in ("sin", "cos", "sqrt"):
        four = tape.const(4)
        assert tape.nodes[getattr(tape, op)(four)] == (op, four)


def test_negation_moves_outward(tape):
    a, b, minus_a, minus_b = 0, 1, tape.neg(0), tape.neg(1)
    assert tape.neg(minus_a) == a
    assert tape.neg(tape.sub(a, b)) == tape.sub(b, a)
    assert tape.add(a, minus_b) == tape.add(minus_b, a) == tape.sub(a, b)
    assert tape.add(minus_a, minus_b) == tape.sub(minus_a, b) == tape.neg(tape.add(a, b))
    assert tape.sub(a, minus_b) == tape.add(a, b)
    assert tape.sub(minus_a, minus_b) == tape.sub(b, a)
    for op in (tape.mul, tape.div):
        assert op(minus_a, b) == op(a, minus_b) == tape.neg(op(a, b))
        assert op(minus_a, minus_b) == op(a, b)
    assert tape.sin(minus_a) == tape.neg(tape.sin(a))
    assert tape.cos(minus_a) == tape.cos(a)


def test_selection_folds_where_the_choice_is_known_or_makes_no_difference(tape):
    a, b, c = 0, 1, 2
    assert [tape.select(tape.const(x), a, b) for x in (1, 0, -2, Fraction(1, 3))] == [a, b, b, a]
    assert tape.select(c, a, a) == a
    assert tape.select(c, tape.neg(a), tape.neg(b)) == tape.neg(tape.select(c, a, b))
    assert tape.select(tape.neg(c), a, b) != tape.select(c, b, a)  # they differ at c = 0
    assert tape.max(a, a) == a and tape.value(tape.max(tape.const(2), tape.const(3))) == 3


def test_selection_is_as_wide_as_its_operands(tape):
    wide = tape.unit(0, 3)
    lanes = [0] * len(tape.nodes)
    lanes[wide] = 3
    assert lanes_of(("select", 0, 1, wide), lanes) == lanes_of(("select", wide, 0, 1), lanes) == 3
    assert lanes_of(("select", 0, 1, 2), lanes) == 0


def test_operands_of_sums_and_products_are_ordered_by_node(tape):
    for op in (tape.add, tape.mul):
        assert op(3, 1) == op(1, 3)
        assert tape.nodes[op(3, 1)][1:] == (1, 3)
    assert tape.sub(3, 1) != tape.sub(1, 3)
    assert tape.div(3, 1) != tape.div(1, 3)


def test_nothing_is_reassociated_or_distributed(tape):
    a, b, c = 0, 1, 2
    for op in (tape.add, tape.mul):
        assert op(op(a, b), c) != op(a, op(b, c))
    assert tape.mul(a, tape.add(b, c)) != tape.add(tape.mul(a, b), tape.mul(a, c))
    assert tape.mul(tape.div(a, b), b) != a
    assert tape.sub(tape.add(a, b), b) != a
    two = tape.const(2)
    assert tape.mul(two, tape.mul(two, a)) != tape.mul(tape.const(4), a)


def test_constants_fold_exactly():
    tape = Tape()
    third, half = tape.div(tape.const(1), tape.const(3)), tape.const(Fraction(1, 2))
    assert tape.value(third) == Fraction(1, 3)
    assert tape.value(tape.add(third, half)) == Fraction(5, 6)
    assert tape.value(tape.sub(third, half)) == Fraction(-1, 6)
    assert tape.value(tape.mul(third, tape.const(3))) == 1
    assert tape.value(tape.div(half, third)) == Fraction(3, 2)
    assert tape.value(tape.div(tape.const(1.0), tape.const(3.0))) == Fraction(1, 3)
    assert exact_quotient(1, 3) == Fraction(1, 3)
    assert exact_quotient(1.0, 3) == 1 / 3


@mpmath.workdps(50)
def test_constants_are_divided_in_the_arithmetic_of_the_run():
    algebra = Numbers(mpmath.mp, mpmath.mpf)
    assert abs(3 * algebra.const(Fraction(1, 3)) - 1) < mpmath.mpf(10) ** -49
    assert algebra.const(0.1) == mpmath.mpf(Fraction(0.1).numerator) / Fraction(0.1).denominator
    assert FLOATS.const(Fraction(1, 3)) == 1 / 3


def test_division_by_the_constant_zero_is_an_error(tape):
    for numerator in (0, tape.const(0), tape.const(1)):
        with pytest.raises(ZeroDivisionError, match="divides by the constant zero"):
            tape.div(numerator, tape.const(0))
