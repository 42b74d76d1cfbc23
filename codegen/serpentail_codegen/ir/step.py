"""A step: a straight-line function of a few named vectors, such as the motion of one link.

Steps are what SymPy derives, what is differentiated, and what the loops of a program apply.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from .algebra import Number
from .tape import LEAVES, Node, Tape, live_nodes, operands, replay

Vectors = Sequence[tuple[str, int]]  # names and sizes


def spans(vectors: Vectors) -> dict[str, range]:
    """Return the positions of named vectors that follow each other."""
    out, first = {}, 0
    for name, size in vectors:
        out[name] = range(first, first + size)
        first += size
    return out


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
    nodes: tuple[Node, ...]
    results: tuple[int, ...]


def compacted(step: Step) -> Step:
    """Drop nodes and input vectors that no output needs."""
    live = live_nodes(step.nodes, step.results)

    # inputs: vectors of which at least one scalar is used, and the new number of each scalar
    used = {step.nodes[n][1] for n in live if step.nodes[n][0] == "input"}
    inputs: list[tuple[str, int]] = []
    new_scalar: dict[int, int] = {}
    for name, span in spans(step.inputs).items():
        if used.intersection(span):
            new_scalar |= {k: len(new_scalar) + k - span.start for k in span}
            inputs.append((name, len(span)))
    if len(live) == len(step.nodes) and len(inputs) == len(step.inputs):
        return step

    # nodes: those alive, at their new positions
    new_node = {node: k for k, node in enumerate(live)}
    nodes = tuple(_renumbered(step.nodes[n], new_scalar, new_node) for n in live)
    results = tuple(new_node[r] for r in step.results)
    return Step(step.name, step.doc, tuple(inputs), step.outputs, nodes, results)


def _renumbered(node: Node, new_scalar: dict[int, int], new_node: dict[int, int]) -> Node:
    """Return a node that works on renumbered inputs and nodes."""
    op = node[0]
    if op == "input":
        return (op, new_scalar[node[1]])
    if op in LEAVES:
        return node
    moved = tuple(new_node[a] for a in operands(node))
    return (op, *moved, *node[1 + len(moved) :])


def specialised(step: Step, name: str, **constants: tuple[Number, ...]) -> Step:
    """Return the step with some input vectors held constant, folded and compacted."""
    tape = Tape()
    scalars: list[int] = []
    for vector, size in step.inputs:
        values = constants.get(vector)
        if values is None:
            scalars += [tape.input(len(scalars) + k) for k in range(size)]
        else:
            scalars += [tape.const(value) for value in values]
    nodes = replay(step.nodes, scalars, tape)
    results = tuple(nodes[r] for r in step.results)
    return compacted(Step(name, step.doc, step.inputs, step.outputs, tuple(tape.nodes), results))
