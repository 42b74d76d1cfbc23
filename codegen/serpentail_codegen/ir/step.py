"""A hash-consed tape: scalar operations go in, each distinct one is stored once, in evaluation
order.
"""

from dataclasses import dataclass

from .tape import LEAVES, Number, Tape, live_nodes, operands, replay


@dataclass(frozen=True)
class Step:
    """A straight-line function: named vectors in, named vectors out.

    ``nodes`` are operations of a tape whose inputs are the scalars of ``inputs`` in order;
    ``results`` are the nodes of the scalars of ``outputs`` in order.
    """

    name: str
    doc: str
    inputs: tuple[tuple[str, int], ...]
    outputs: tuple[tuple[str, int], ...]
    nodes: tuple[tuple, ...]
    results: tuple[int, ...]


def compacted(step: Step) -> Step:
    """Drop nodes and input vectors that no output needs."""
    live = live_nodes(step.nodes, step.results)
    used = {step.nodes[n][1] for n in live if step.nodes[n][0] == "input"}
    inputs, slot, first = [], {}, 0
    for name, size in step.inputs:
        span = range(first, first + size)
        if used.intersection(span):
            slot |= {k: len(slot) + k - first for k in span}
            inputs.append((name, size))
        first += size
    position = {node: k for k, node in enumerate(live)}
    nodes = tuple(_moved(step.nodes[n], slot, position) for n in live)
    results = tuple(position[r] for r in step.results)
    return Step(step.name, step.doc, tuple(inputs), step.outputs, nodes, results)


def _moved(node: tuple, slot: dict[int, int], position: dict[int, int]) -> tuple:
    op, *args = node
    if op in LEAVES:
        return (op, slot[args[0]]) if op == "input" else node
    return (op, *(position[a] for a in operands(node)), *args[len(operands(node)) :])


def specialised(step: Step, name: str, **constants: tuple[Number, ...]) -> Step:
    """Return the step with some input vectors held constant, folded and compacted."""
    tape, scalars, first = Tape(), [], 0
    for vector, size in step.inputs:
        values = constants.get(vector)
        scalars += [
            tape.input(first + k) if values is None else tape.const(values[k]) for k in range(size)
        ]
        first += size
    nodes = replay(step.nodes, scalars, tape)
    results = tuple(nodes[r] for r in step.results)
    return compacted(Step(name, step.doc, step.inputs, step.outputs, tuple(tape.nodes), results))
