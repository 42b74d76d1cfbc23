"""Structural zeros: which lanes of the values that statements read are zero for all inputs.

A value is the set of its lanes that may differ from zero, as the bits of an integer; a narrow
scalar counts for every lane.
"""

from ..ir.interpret import Run
from ..ir.program import Apply, Copy, Program, Ref

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
