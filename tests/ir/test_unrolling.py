"""Unrolled programs of the models: every bit of what their loops mean, baked parameters or not."""

import math
from fractions import Fraction

import numpy as np
import pytest

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import Run, unroll
from serpentail_codegen.ir.tape import live_nodes
from tests.references.parameters import TABLE_1, random_states
from tests.support.algebras import FLOATS, RATIONAL
from tests.support.program_runs import unrolled_values
from tests.support.rows import row

TAILS = {"m1_n2": Tail(1, 2), "m2_n3": Tail(2, 3), "continuum_m2": Tail(2, 3, "continuum")}


def arguments_of(program, tail, convert):
    """Table 1 and a random state for the parameters and inputs of a program."""
    q, v, v_dot, tau = (rows[0] for rows in random_states(tail.segments, 3, 1, "random"))
    f_ext = np.random.default_rng(4).uniform(-1, 1, 6 + 3 * (tail.total + 1))
    known = {"q": q, "v": v, "v_dot": v_dot, "tau": tau, "f_ext": f_ext}
    known |= {"link_inertia": (4.9e-8, 2e-9, 5e-8)} | TABLE_1
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


def unrolled_results(program, fixed=None):
    """Unroll; return the tape and the live nodes, those that must be positive included."""
    tape, nodes, guards = unroll(program, fixed)
    wanted = [node for found in nodes.values() for node in found] + [node for _, node in guards]
    return tape, live_nodes(tape.nodes, wanted)


@pytest.mark.parametrize("tail", TAILS.values(), ids=TAILS)
def test_unrolling_keeps_every_bit_and_baking_leaves_no_parameter(tail):
    """Signs of zeros aside: no two constants that round meet in these programs, so folding changes
    no rounding.
    """
    for name, function in FUNCTIONS.items():
        with row(name):
            p = assemble(function, tail)
            arguments = arguments_of(p, tail, float)
            interpreted = interpreted_values(p, arguments, FLOATS)
            assert unrolled_values(p, arguments, FLOATS) == interpreted
            assert all(math.isfinite(x) for values in interpreted.values() for x in values)

            parameters = p.of_role("parameters")
            tape, live = unrolled_results(p, {a.name: arguments[a.name] for a in parameters})
            read = {tape.nodes[node][1] for node in live if tape.nodes[node][0] == "input"}
            assert min(read) >= sum(array.length for array in parameters)
            assert len(live) <= len(unrolled_results(p)[1])


def test_unrolling_and_baking_are_exact_in_rational_arithmetic():
    tail = Tail(1, 2)
    for name, function in FUNCTIONS.items():
        with row(name):
            p = assemble(function, tail)
            arguments = arguments_of(p, tail, rounded)
            interpreted = interpreted_values(p, arguments, RATIONAL)
            names = [array.name for array in p.of_role("parameters")]
            assert unrolled_values(p, arguments, RATIONAL) == interpreted
            assert unrolled_values(p, arguments, RATIONAL, fixed=names) == interpreted
