"""Removes tangents that are zero in all directions for every state."""

from collections.abc import Iterator
from dataclasses import replace

from ..ir.builder import narrowed
from ..ir.dataflow import inlined, pruned, rewritten
from ..ir.program import Apply, Fill, Program, Statement
from ..ir.step import Step
from .split_steps import without
from .structural_zeros import lanes_read


def without_still(program: Program) -> Program:
    """Return a program, without calls, whose steps read only tangents that move in some direction.

    Its wide arrays stay wide.
    """
    program = inlined(program)
    patterns = lanes_read(program)

    def rewrite(statement: Statement) -> Iterator[Statement]:
        if not isinstance(statement, Apply):
            yield statement
            return
        runs = patterns.get(id(statement), [])
        moving = {name for _, lanes in runs for name, bits in lanes.items() if bits}
        wide = {name for name, ref in statement.inputs().items() if ref.lanes}
        yield from _at_rest(statement, frozenset(wide - moving))

    return pruned(replace(program, body=rewritten(program.body, rewrite)))


def _at_rest(call: Apply, still: frozenset[str]) -> Iterator[Statement]:
    """Yield a step some of whose inputs are zero, and zeros in place of outputs that then are."""
    step, targets = without(call.step, still), call.outputs()
    adds = dict(zip(targets, call.adds, strict=True))
    zero = {name for name in _zero_outputs(step) if targets[name].lanes} if still else set()
    kept = [name for name in targets if name not in zero]
    if kept:
        step = narrowed(step, set(kept))
        sums = [adds[name] for name in kept]
        one = Apply.named(step, call.inputs(), [targets[name] for name in kept], sums)
        yield replace(one, columns=call.columns)
    for name in targets:
        if name in zero and not adds[name]:
            yield Fill(targets[name], (0,) * targets[name].size)


def _zero_outputs(step: Step) -> Iterator[str]:
    """Yield the names of the outputs that are zero."""
    first = 0
    for name, size in step.outputs:
        if all(step.nodes[r] == ("const", 0) for r in step.results[first : first + size]):
            yield name
        first += size
