"""Removes fills that nothing reads."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from ..ir.dataflow import rewritten
from ..ir.interpret import Run
from ..ir.program import Fill, Program, Statement
from ..ir.step import Step

PLAIN = 0  # a value that no fill stored


@dataclass(frozen=True)
class Stored:
    """A value that a fill stored, and that nothing has read so far."""

    by: int


class _Reading:
    """The algebra of values that are stored by fills or computed; computing reads."""

    def __init__(self) -> None:
        self.read: set[int] = set()

    def _computed(self, *operands: Any) -> int:
        for operand in operands:
            if isinstance(operand, Stored):
                self.read.add(operand.by)
        return PLAIN

    add = sub = mul = div = neg = sin = cos = sqrt = select = _computed
    const = staticmethod(lambda value: PLAIN)

    def decide(self, c: Any) -> bool:
        """Take the branch that may read."""
        self._computed(c)
        return True

    def _refused(self, *_: Any) -> int:
        raise TypeError("fills are looked for in programs without wide arrays")

    unit = lane = placed = _refused


class _FillRun(Run):
    """A run that finds which fills are read; equal steps of equal values are computed once."""

    def __init__(self, program: Program):
        self.known: dict[tuple, list] = {}
        self.reading = _Reading()
        given = (*program.of_role("parameters"), *program.of_role("input"))
        super().__init__(program, self.reading, {a.name: [PLAIN] * a.length for a in given})

    def fill(self, fill: Fill, at: dict[str, int]) -> None:
        """Store values that know who stored them."""
        self.write(fill.target, at, [Stored(id(fill))] * fill.target.size)

    def results(self, step: Step, scalars: list) -> list:
        """Return what a step makes of its inputs."""
        key = (id(step), *scalars)
        if key not in self.known:
            self.known[key] = super().results(step, scalars)
        return self.known[key]


def without_unread_fills(program: Program) -> Program:
    """Return a program without the fills whose values are always overwritten or never read.

    The program has no calls and no wide arrays.
    """
    run = _FillRun(program)
    read = set(run.reading.read)
    for array in program.of_role("output"):
        read |= {value.by for value in run.values[array.name] if isinstance(value, Stored)}
    read |= {value.by for _, value in run.guards if isinstance(value, Stored)}

    def rewrite(statement: Statement) -> Iterator[Statement]:
        if not isinstance(statement, Fill) or id(statement) in read:
            yield statement

    return replace(program, body=rewritten(program.body, rewrite))
