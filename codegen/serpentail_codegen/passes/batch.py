"""Programs for batches: several states in one call, one in each lane of the vectors.

Every array that depends on an argument becomes wide, with a lane for each state.  What depends on
parameters alone stays narrow, and is computed once for all states.  What a wide condition asks for
is stored in the lanes where it holds.
"""

from dataclasses import replace

from ..ir.dataflow import forward_slice, inlined, on_arrays
from ..ir.interpret import unroll
from ..ir.program import Apply, Array, Guard, Program
from ..ir.step import Step, compacted


def batched(program: Program, states: int) -> Program:
    """Return a program over so many states, the lanes of its inputs and outputs."""
    program = inlined(program)
    arguments = {a.name for a in program.arrays if a.role in ("input", "output")}
    wide = forward_slice(program.body, arguments, decided=True)
    array = {a.name: replace(a, lanes=states) if a.name in wide else a for a in program.arrays}
    body = on_arrays(program.body, array)
    return replace(program, name=f"{program.name}_rows", arrays=tuple(array.values()), body=body)


def with_own_parameters(program: Program, name: str) -> Program:
    """Return a program of another name whose parameters are inputs: each state may have its own."""
    program = inlined(program)
    array = {a.name: a for a in program.arrays}
    for parameter in program.of_role("parameters"):
        array[parameter.name] = replace(parameter, role="input")
    body = on_arrays(program.body, array)
    return replace(program, name=name, arrays=tuple(array.values()), body=body)


def unrolled_step(program: Program, fixed: dict[str, list] | None = None) -> Program:
    """Return a program that is one step and guards, without loops; ``fixed`` are constants."""
    tape, nodes, guards = unroll(program, fixed)
    inputs = (*program.of_role("parameters"), *program.of_role("input"))
    outputs = program.of_role("output")

    # beside its outputs, the step gives what must be positive, one array for each status
    positive: dict[str, list[int]] = {}
    for status, node in guards:
        positive.setdefault(status, []).append(node)
    tested = {
        status: Array(f"positive_{k}", "local", len(status_nodes))
        for k, (status, status_nodes) in enumerate(positive.items())
    }
    targets = (*outputs, *tested.values())
    results = [node for array in outputs for node in nodes[array.name]]
    results += [node for status_nodes in positive.values() for node in status_nodes]
    step = compacted(
        Step(
            f"{program.name}_written_out",
            program.doc,
            tuple((a.name, a.length) for a in inputs),
            tuple((a.name, a.length) for a in targets),
            tuple(tape.nodes),
            tuple(results),
        )
    )

    call = Apply.named(
        step, {a.name: a.whole() for a in inputs}, [array.whole() for array in targets]
    )
    protects = tuple(array.whole() for array in outputs)
    tests = tuple(Guard(array.whole(), status, protects) for status, array in tested.items())
    return Program(program.name, program.doc, (*inputs, *targets), (call, *tests))
