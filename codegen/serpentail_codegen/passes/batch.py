"""Batches: the program of one state goes in, the same program over several states side by side
comes out.

Every array that depends on an argument becomes wide, one lane for each state; what depends on
parameters alone stays narrow, and is computed once for all.
"""

from dataclasses import replace

from ..ir.dataflow import forward_slice, inlined, rewritten, with_arrays
from ..ir.interpret import unroll
from ..ir.program import Apply, Array, Guard, Program
from ..ir.step import Step, compacted


def batched(program: Program, states: int) -> Program:
    """Return a program over so many states, its inputs and outputs rows of them."""
    program = inlined(program)
    arguments = {a.name for a in program.arrays if a.role in ("input", "output")}
    wide = forward_slice(program.body, arguments)
    array = {a.name: replace(a, lanes=states) if a.name in wide else a for a in program.arrays}
    body = rewritten(program.body, lambda statement: (with_arrays(statement, array),))
    return replace(program, name=f"{program.name}_rows", arrays=tuple(array.values()), body=body)


def with_own_parameters(program: Program, name: str) -> Program:
    """Return a program by another name that takes its parameters as inputs, so that each state may
    have its own.
    """
    program = inlined(program)
    array = {
        a.name: replace(a, role="input") if a.role == "parameters" else a for a in program.arrays
    }
    body = rewritten(program.body, lambda statement: (with_arrays(statement, array),))
    return replace(program, name=name, arrays=tuple(array.values()), body=body)


def unrolled_step(program: Program, fixed: dict[str, list] | None = None) -> Program:
    """Return a program that is one step, its loops written out, and guards; ``fixed`` arrays are
    constants.
    """
    tape, outputs, guards = unroll(program, fixed)
    inputs = (*program.of_role("parameters"), *program.of_role("input"))
    positive = {status: [node for name, node in guards if name == status] for status, _ in guards}
    checks = {
        status: Array(f"positive_{k}", "local", len(nodes))
        for k, (status, nodes) in enumerate(positive.items())
    }
    targets = (*program.of_role("output"), *checks.values())
    results = [node for array in program.of_role("output") for node in outputs[array.name]]
    results += [node for nodes in positive.values() for node in nodes]
    step = Step(
        f"{program.name}_written_out",
        program.doc,
        tuple((a.name, a.length) for a in inputs),
        tuple((a.name, a.length) for a in targets),
        tuple(tape.nodes),
        tuple(results),
    )
    step = compacted(step)
    given = {a.name: a.part(0, a.length) for a in inputs}
    call = Apply(
        step,
        tuple(given[name] for name, _ in step.inputs),
        tuple(a.part(0, a.length) for a in targets),
        (False,) * len(targets),
    )
    protected = tuple(a.part(0, a.length) for a in program.of_role("output"))
    tests = tuple(Guard(a.part(0, a.length), status, protected) for status, a in checks.items())
    return Program(program.name, program.doc, (*inputs, *targets), (call, *tests))
