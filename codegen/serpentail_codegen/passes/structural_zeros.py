"""Structural zeros: which lanes of the values that statements read are zero for all inputs, and
programs without the tangents that are zero in all of them.

A value is the set of its lanes that may differ from zero, as the bits of an integer; a narrow
scalar counts for every lane.
"""

from collections.abc import Iterator
from dataclasses import replace

from ..ir.dataflow import inlined, pruned, rewritten, with_outputs
from ..ir.interpret import Run
from ..ir.program import Apply, Copy, Fill, Program, Ref, Statement
from ..ir.step import Step, spans
from .split_steps import without

NONE, ALL = 0, -1
SOURCE = "source"  # what a copy reads
Patterns = dict[int, list[tuple[dict[str, int], dict[str, int]]]]


class Bits:
    """The algebra of lanes that may differ from zero."""

    add = sub = staticmethod(lambda a, b: a | b)
    mul = staticmethod(lambda a, b: a & b)
    div = staticmethod(lambda a, b: a)
    neg = sin = sqrt = staticmethod(lambda a: a)
    cos = staticmethod(lambda a: ALL)
    select = staticmethod(lambda c, a, b: a | b)
    const = staticmethod(lambda value: ALL if value else NONE)
    unit = staticmethod(lambda lane, lanes: 1 << lane)
    lane = staticmethod(lambda a, lane: ALL if a >> lane & 1 else NONE)
    decide = staticmethod(lambda c: True)  # both ways give no more than this one

    @staticmethod
    def placed(a: int, lane: int, lanes: int, value: int) -> int:
        """Return the lanes of a value of which one is replaced."""
        a = a or NONE  # lanes that nothing has stored are zero
        return a | 1 << lane if value else a & ~(1 << lane)


class _Watch(Run):
    """A run that notes what steps and copies read: the lanes of each input, in every iteration."""

    def __init__(self, program: Program):
        self.seen: Patterns = {}
        arguments = (*program.of_role("parameters"), *program.of_role("input"))
        super().__init__(program, Bits(), {a.name: [ALL] * a.length for a in arguments})

    def apply(self, call: Apply, at: dict[str, int]) -> None:
        """Note what a step reads, and run it."""
        self.note(call, call.inputs(), at)
        super().apply(call, at)

    def copy(self, copy: Copy, at: dict[str, int]) -> None:
        """Note what a copy reads, and run it."""
        self.note(copy, {SOURCE: copy.source}, at)
        super().copy(copy, at)

    def note(self, statement: Apply | Copy, inputs: dict[str, Ref], at: dict[str, int]) -> None:
        """Note the lanes of what a statement reads."""
        lanes: dict[str, int] = {}
        for name, ref in inputs.items():
            if ref.lanes:
                for value in self.read(ref, at):
                    lanes[name] = lanes.get(name, NONE) | value
        if lanes:
            self.seen.setdefault(id(statement), []).append((dict(at), lanes))


def lanes_read(program: Program) -> Patterns:
    """Return the loop variables and the lanes of each wide input for all runs, by statement's id.

    The program has no calls.
    """
    return _Watch(program).seen


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
    zero = {name for name in _zero_outputs(step) if targets[name].lanes} if still else set()
    kept = [name for name in targets if name not in zero]
    if kept:
        yield with_outputs(call, kept, step)
    for name, ref in targets.items():
        if name in zero and ref in call.stored():
            yield Fill(ref, (0,) * ref.size)


def _zero_outputs(step: Step) -> Iterator[str]:
    """Yield the names of the outputs that are zero."""
    for name, span in spans(step.outputs).items():
        if all(step.nodes[step.results[k]] == ("const", 0) for k in span):
            yield name
