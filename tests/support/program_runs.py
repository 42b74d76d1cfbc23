"""Runs programs interpreted and unrolled, and returns the outputs of both."""

from serpentail_codegen.ir.interpret import Run, unroll
from serpentail_codegen.ir.tape import replay
from tests.support.algebras import RATIONAL
from tests.support.programs import step_of

SWAP = step_of("swap", (("x", 2),), (("x", 2),), lambda t, a, b: [b, a])


def outputs(builder, **arguments):
    """Run what a builder recorded on exact numbers, interpreted and unrolled; both give the
    same.
    """
    program = builder.finish()
    names = [array.name for array in program.of_role("output")]
    values = Run(program, RATIONAL, arguments).values
    tape, nodes, _ = unroll(program)
    order = (*program.of_role("parameters"), *program.of_role("input"))
    replayed = replay(
        tape.nodes, [scalar for array in order for scalar in arguments[array.name]], RATIONAL
    )
    assert {name: [replayed[node] for node in nodes[name]] for name in names} == {
        name: values[name] for name in names
    }
    return values[names[0]] if len(names) == 1 else {name: values[name] for name in names}


def unrolled_values(program, arguments, algebra, fixed=()):
    """Unroll, then evaluate the straight line; return the scalars of every output array."""
    tape, nodes, _ = unroll(program, {name: arguments[name] for name in fixed})
    scalars = [scalar for values in arguments.values() for scalar in values]
    values = replay(tape.nodes, scalars, algebra)
    return {name: [values[node] for node in found] for name, found in nodes.items()}
