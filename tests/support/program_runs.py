"""Numbers to run programs on, and runs of programs, interpreted and unrolled.

Fractions have stand-ins for sine, cosine and root, which obey the only laws that folding may use:
sin is odd, cos even, and their values at 0 and 1.
"""

import math
from fractions import Fraction
from types import SimpleNamespace

from serpentail_codegen.ir.interpret import Numbers, Run, unroll
from serpentail_codegen.ir.tape import replay

SIN, COS, SQRT = lambda x: x / (1 + x * x), lambda x: 1 / (1 + x * x), lambda x: x * x
FLOATS = Numbers(math, float)
RATIONAL = Numbers(SimpleNamespace(sin=SIN, cos=COS, sqrt=SQRT), Fraction)


def interpreted(program, arguments, algebra=RATIONAL):
    """Run the loops; return the scalars of every output array."""
    values = Run(program, algebra, arguments).values
    return {array.name: values[array.name] for array in program.of_role("output")}


def unrolled(program, arguments, algebra=RATIONAL, fixed=()):
    """Unroll, then evaluate the straight line; return the scalars of every output array."""
    tape, nodes, _ = unroll(program, {name: arguments[name] for name in fixed})
    order = (*program.of_role("parameters"), *program.of_role("input"))
    scalars = [scalar for array in order for scalar in arguments[array.name]]
    values = replay(tape.nodes, scalars, algebra)
    return {name: [values[node] for node in found] for name, found in nodes.items()}


def outputs(builder, **arguments):
    """Run what a builder recorded on exact numbers, interpreted and unrolled: both agree."""
    program = builder.finish()
    found = interpreted(program, arguments)
    assert unrolled(program, arguments) == found
    return found if len(found) > 1 else next(iter(found.values()))
