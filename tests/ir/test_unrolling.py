"""Unrolled programs of the models: every bit of what their loops mean, baked parameters or not."""

import math
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.tape import live_nodes
from tests.references.parameters import TABLE_1, random_states
from tests.support.algebras import FLOATS, RATIONAL
from tests.support.program_runs import unrolled_values

TAILS = {"m1_n2": Tail(1, 2), "m2_n3": Tail(2, 3), "continuum_m2": Tail(2, 3, "continuum")}


@pytest.fixture(params=TAILS)
def tail(request):
    """A tail of few segments."""
    return TAILS[request.param]


@pytest.fixture(params=FUNCTIONS)
def function(request):
    """A function of the catalogue."""
    return FUNCTIONS[request.param]


def arguments_of(program, tail, convert):
    """Table 1 and a random state for the parameters and inputs of a program."""
    q, v, v_dot, tau = (rows[0] for rows in random_states(tail.segments, 3, 1, "random"))
    f_ext = np.random.default_rng(4).uniform(-1, 1, 6 + 3 * (tail.total + 1))
    known = {
        "q": q,
        "v": v,
        "v_dot": v_dot,
        "tau": tau,
        "f_ext": f_ext,
        "link_inertia": (4.9e-8, 2e-9, 5e-8),
    } | TABLE_1
    arrays = (*program.of_role("parameters"), *program.of_role("input"))
    return {a.name: [convert(x) for x in np.ravel(known[a.name]).tolist()] for a in arrays}


def interpreted_values(program, arguments, algebra):
    """Run the loops; return the scalars of every output array."""
    values = Run(program, algebra, arguments).values
    return {array.name: values[array.name] for array in program.of_role("output")}


def rounded(x):
    """A coarse rational: exact arithmetic on it stays small."""
    return (
        Fraction(round(x * 64), 64) if abs(x) > 1 / 16 else Fraction(x).limit_denominator(1 << 30)
    )


def test_unrolling_keeps_every_bit(function, tail):
    """Signs of zeros aside: no two constants that round meet in these programs, so folding changes
    no rounding.
    """
    p = assemble(function, tail)
    arguments = arguments_of(p, tail, float)
    unrolled, interpreted = (
        unrolled_values(p, arguments, FLOATS),
        interpreted_values(p, arguments, FLOATS),
    )
    assert unrolled == interpreted
    assert all(math.isfinite(x) for values in interpreted.values() for x in values)


def test_unrolling_and_baking_are_exact_in_rational_arithmetic(function):
    tail = Tail(1, 2)
    p = assemble(function, tail)
    arguments = arguments_of(p, tail, rounded)
    interpreted = interpreted_values(p, arguments, RATIONAL)
    names = [array.name for array in p.of_role("parameters")]
    assert unrolled_values(p, arguments, RATIONAL) == interpreted
    assert unrolled_values(p, arguments, RATIONAL, fixed=names) == interpreted


def unrolled_results(program, fixed=None):
    """Unroll; return the tape and all nodes that are wanted of it, what must be positive
    included.
    """
    tape, nodes, guards = unroll(program, fixed)
    return tape, [node for found in nodes.values() for node in found] + [node for _, node in guards]


def test_baking_leaves_no_parameter_and_adds_no_operation(function, tail):
    p = assemble(function, tail)
    arguments = arguments_of(p, tail, float)
    tape, results = unrolled_results(
        p, {array.name: arguments[array.name] for array in p.of_role("parameters")}
    )
    read = {
        tape.nodes[node][1]
        for node in live_nodes(tape.nodes, results)
        if tape.nodes[node][0] == "input"
    }
    assert min(read) >= sum(array.length for array in p.of_role("parameters"))
    free, free_results = unrolled_results(p)
    assert len(live_nodes(tape.nodes, results)) <= len(live_nodes(free.nodes, free_results))


def test_a_batch_is_its_states_one_by_one(function, tail):
    p = assemble(function, tail)
    one = arguments_of(p, tail, float)
    inputs = {array.name for array in p.of_role("input")}
    stretched = {
        name: [np.array([x, 0.9 * x]) if name in inputs else x for x in xs]
        for name, xs in one.items()
    }
    shrunk = {name: [0.9 * x if name in inputs else x for x in xs] for name, xs in one.items()}
    batch = interpreted_values(p, stretched, Numbers(np, float))
    for k, arguments in enumerate((one, shrunk)):
        for name, expected in interpreted_values(p, arguments, FLOATS).items():
            values = [np.broadcast_to(x, 2)[k] for x in batch[name]]
            np.testing.assert_allclose(
                values, expected, rtol=1e-9, atol=1e-12 * np.max(np.abs(expected))
            )
