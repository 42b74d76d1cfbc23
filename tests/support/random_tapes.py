"""Tapes of random operations, beside the values computed directly."""

from fractions import Fraction

from serpentail_codegen.ir.tape import BINARY, TERNARY, UNARY
from tests.support.algebras import FLOATS

INPUTS = 4
SEEDS = range(40)
CONSTANTS = (
    0,
    1,
    -1,
    2,
    -2,
    0.5,
    -1.0,
    Fraction(1, 4),
)  # their sums and products are exact in float64


def grow(rng, algebra, tape, leaves, length=80):
    """Record random operations; return pairs (node, the value computed directly)."""
    pool = [(tape.input(k), leaf) for k, leaf in enumerate(leaves)]
    while len(pool) < length:
        op = rng.choice(BINARY * 2 + UNARY + TERNARY)
        count = next(k for k, ops in enumerate((UNARY, BINARY, TERNARY), 1) if op in ops)
        nodes, values = zip(
            *(_operand(rng, algebra, tape, pool) for _ in range(count)), strict=True
        )
        if op == "div" and (
            values[1] == 0 or (algebra is FLOATS and None not in map(tape.value, nodes))
        ):
            continue
        if op == "sqrt" and values[0] < 0:
            continue
        value = getattr(algebra, op)(*values)
        if abs(value) < 1e60 and (algebra is FLOATS or value.denominator < 10**60):
            pool.append((getattr(tape, op)(*nodes), value))
    return pool


def _operand(rng, algebra, tape, pool):
    constant = rng.choice(CONSTANTS)
    return (
        (tape.const(constant), algebra.const(constant)) if rng.random() < 0.2 else rng.choice(pool)
    )
