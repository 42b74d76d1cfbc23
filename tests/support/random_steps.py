"""Random steps with the SymPy expressions of their results, and points to evaluate them at."""

import random
from fractions import Fraction
from itertools import chain
from types import SimpleNamespace

import mpmath
import sympy

from serpentail_codegen.ir.interpret import Numbers
from serpentail_codegen.ir.step import Step
from serpentail_codegen.ir.tape import BINARY, TERNARY, UNARY, Tape, replay

INPUTS = (("x", 2), ("y", 1), ("z", 2))
OUTPUTS = (("u", 1), ("w", 2))
SYMBOLS = {name: sympy.symbols(f"{name}:{size}", real=True) for name, size in INPUTS}
LEAVES = list(chain(*SYMBOLS.values()))
CONSTANTS = (0, 1, -1, 2, Fraction(1, 3), Fraction(-5, 2))
SEEDS = range(15)
MANY = Numbers(mpmath.mp, mpmath.mpf)
FRACTIONS = Numbers(SimpleNamespace(sin=None, cos=None, sqrt=None), Fraction)
RESIDUE = 1e-35  # of values that lose at most 15 digits


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
    nodes = replay(
        step.nodes, [scalar for name, _ in step.inputs for scalar in vectors[name]], algebra
    )
    results = iter(step.results)
    return {name: [nodes[next(results)] for _ in range(size)] for name, size in step.outputs}


def flat(vectors, names, prefix=""):
    """The scalars of named vectors in order."""
    return [scalar for name in names for scalar in vectors[prefix + name]]


def assert_close(found, expected):
    for one, other in zip(found, expected, strict=True):
        assert abs(one - other) <= RESIDUE * (1 + abs(other)), (one, other)
