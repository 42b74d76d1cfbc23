"""Directions of differentiation in turn: a program whose wide arrays become narrow ones.

The lanes of vectors are then free for something else, such as states.  A step of values and
tangents falls into two: one of all that is the same for every direction, and one that a loop over
directions applies.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

from ..ir.dataflow import inlined, names, reads, writes
from ..ir.program import (
    Apply,
    Array,
    Copy,
    Fill,
    Index,
    Loop,
    Program,
    Ref,
    Solve,
    Statement,
    Unit,
    as_index,
    statements,
)
from ..ir.step import Step
from .dead_fills import without_unread_fills
from .fuse_steps import fused
from .split_steps import SLOPES, is_zero, parted, without
from .structural_zeros import Patterns, lanes_read

DIRECTION = "d"  # the loop variable
HERE = Index(((DIRECTION, 1),))


def directions_in_turn(program: Program) -> Program:
    """Return a program without wide arrays: direction after direction lies in narrow ones.

    What is zero whatever the state is neither computed nor stored, where nothing else reads it.
    """
    if not has_directions(program):
        return program
    program = fused(inlined(program))
    turns = _Turns(lanes_read(program), boundaries(program))
    body = turns.body(program.body, ())
    arrays = tuple(turns.narrow(a) for a in program.arrays)
    narrow = replace(program, arrays=(*arrays, *turns.slopes.values()), body=body)
    return without_unread_fills(narrow)


def has_directions(program: Program) -> bool:
    """Tell if a program has wide arrays."""
    return any(a.lanes for a in inlined(program).arrays)


def places_lanes(program: Program) -> bool:
    """Tell if a program writes single lanes, which no line of wide operations can express."""
    body = inlined(program).body
    return any(ref.lane and ref.array.lanes for s, _ in statements(body) for ref in writes(s))


class _Turns:
    """Rewrites statements on wide arrays as loops over directions.

    patterns: which lanes of what steps read may differ from zero.
    boundaries: where directions of another kind begin.
    slopes: arrays of what is the same for every direction, by their names.
    """

    def __init__(self, patterns: Patterns, boundaries: dict[int, list[Index]]) -> None:
        self.patterns, self.boundaries = patterns, boundaries
        self.slopes: dict[str, Array] = {}
        self.rules: dict[type, Callable[[Any], Iterator[Statement]]] = {
            Apply: self.apply,
            Copy: self.copy,
            Fill: self.fill,
            Solve: self.solve,
            Unit: self.unit,
        }

    def body(
        self, body: tuple[Statement, ...], variables: tuple[str, ...]
    ) -> tuple[Statement, ...]:
        """Return the rewritten loop nest."""
        out: list[Statement] = []
        for statement in body:
            if isinstance(statement, Loop):
                inner = self.body(statement.body, (*variables, statement.var))
                out.append(replace(statement, body=inner))
            elif any(ref.array.lanes for ref in (*reads(statement), *writes(statement))):
                rule = self.rules.get(type(statement))
                if rule is None:
                    raise TypeError(f"no rule takes {type(statement).__name__} in turn")
                self.variables = variables
                out += rule(statement)
            elif isinstance(statement, Apply):
                out.append(replace(statement, columns=None))  # it has no tangents left
            else:
                out.append(statement)
        return tuple(out)

    @staticmethod
    def narrow(array: Array) -> Array:
        """Return what holds an array's directions one after the other."""
        return replace(array, count=array.count * max(array.lanes, 1), lanes=0)

    def at(self, ref: Ref, direction: Index | int = HERE) -> Ref:
        """Return what a reference means in one direction; lanes become scalars that lie apart."""
        array, length = ref.array, ref.array.length
        if not array.lanes:
            return ref
        if ref.lane is None:
            offset, stride = ref.offset + length * as_index(direction), ref.stride
        else:
            down = ref.stride == array.row  # one lane of several scalars
            offset, stride = ref.offset + length * ref.lane, 1 if down else length
        return Ref(self.narrow(array), offset, ref.size, stride)

    def each(self, lanes: Index | int, *body: Statement) -> Loop:
        """Return a loop over directions."""
        return Loop(DIRECTION, as_index(0), as_index(lanes), False, body)

    def fill(self, fill: Fill) -> Iterator[Statement]:
        """Yield the fill for each direction; a whole array is filled at once."""
        target = self.at(fill.target)
        if fill.target == fill.target.array.whole() and len(set(fill.values)) == 1:
            whole = target.array.whole()
            yield Fill(whole, fill.values[:1] * whole.size)
            return
        if not fill.target.lanes:  # single lanes
            yield replace(fill, target=target)
            return
        yield self.each(fill.target.lanes, replace(fill, target=target))

    def unit(self, unit: Unit) -> Iterator[Statement]:
        """Yield zeros, then the directions that have a one among them."""
        target = unit.target
        yield from self.fill(Fill(target, (0,) * target.size))
        for k in range(target.size):
            one = tuple(int(j == k) for j in range(target.size))
            yield Fill(self.at(target, unit.first + k), one)

    def copy(self, copy: Copy) -> Iterator[Statement]:
        """Yield the copy for each direction that has anything, or that of single lanes."""
        moved = replace(copy, target=self.at(copy.target), source=self.at(copy.source))
        if not copy.source.lanes:
            yield self.each(copy.target.lanes, moved) if copy.target.lanes else moved
            return
        for first, last, moving in self.kinds(copy, as_index(copy.target.lanes)):
            zeros = [] if copy.adds else self.cleared(copy.target)
            body = [moved] if moving else zeros
            if body:
                yield replace(self.each(last, *body), start=first)

    def solve(self, solve: Solve) -> Iterator[Statement]:
        """Yield a solution for each direction."""
        yield self.each(solve.x.lanes, replace(solve, x=self.at(solve.x)))

    def apply(self, call: Apply) -> Iterator[Statement]:
        """Yield the step of what all directions share, then that of each direction."""
        inputs, outputs = call.inputs(), call.outputs()
        adds = dict(zip(outputs, call.adds, strict=True))
        wide = frozenset(n for n, ref in (inputs | outputs).items() if ref.lanes)
        if not wide:  # single lanes of what is wide
            read, written = tuple(map(self.at, call.reads)), tuple(map(self.at, call.writes))
            yield replace(call, reads=read, writes=written)
            return
        overwritten = names(ref for name, ref in outputs.items() if name not in wide)
        kept = frozenset(n for n, ref in inputs.items() if ref.array.name in overwritten)
        parts = parted(call.step, wide, kept)

        slopes = {}
        if parts.slopes:
            array = Array(f"slopes_of_{call.step.name}", "local", parts.slopes)
            slopes[SLOPES] = self.slopes.setdefault(array.name, array)[0]
        targets = {name: self.at(ref) for name, ref in outputs.items()} | slopes
        sources = {name: self.at(ref) for name, ref in inputs.items()} | slopes

        def applied(step: Step) -> Apply:
            given = [targets[name] for name, _ in step.outputs]
            return Apply.named(step, sources, given, [adds.get(n, False) for n, _ in step.outputs])

        if parts.shared.outputs:
            yield applied(parts.shared)
        lanes = next(ref.lanes for ref in (inputs | outputs).values() if ref.lanes)
        stop = as_index(lanes if call.columns is None else call.columns)
        for first, last, moving in self.kinds(call, stop):
            step = without(parts.each, wide - moving)
            body = self.cleared(*call.stored()) if is_zero(step) else [applied(step)]
            if body:
                yield replace(self.each(last, *body), start=first)

    def cleared(self, *targets: Ref) -> list[Statement]:
        """Return what stores the zeros that come of nothing but zeros."""
        return [Fill(self.at(ref), (0,) * ref.size) for ref in targets if ref.lanes]

    def kinds(
        self, call: Apply | Copy, stop: Index
    ) -> Iterator[tuple[Index, Index, frozenset[str]]]:
        """Yield ranges of directions, and what is not zero in them of what a statement reads."""
        runs = self.patterns.get(id(call), [])
        lanes = next(ref.lanes for ref in (*reads(call), *writes(call)) if ref.lanes)
        marks = [as_index(0)]
        for mark in self.boundaries.get(lanes, []):
            known = all(variable in self.variables for variable, _ in mark.terms)
            if known and all(marks[-1].at(at) <= mark.at(at) <= stop.at(at) for at, _ in runs):
                marks.append(mark)
        begun: list[
            tuple[Index, frozenset[str]]
        ] = []  # where each kind begins, and what moves in it
        for first, last in pairwise([*marks, stop]):
            moving = frozenset(
                name
                for at, read in runs
                for name, bits in read.items()
                if bits & bits_between(first.at(at), last.at(at))
            )
            if not begun or begun[-1][1] != moving:
                begun.append((first, moving))
        ends = [first for first, _ in begun[1:]] + [stop]
        for (first, moving), last in zip(begun, ends, strict=True):
            yield first, last, moving


def bits_between(first: int, last: int) -> int:
    """Return the bits of the lanes from the first on, before the last."""
    return (1 << max(last, 0)) - (1 << max(first, 0)) if last > first else 0


def boundaries(program: Program) -> dict[int, list[Index]]:
    """Return where unit directions begin and end, in order, by the number of all directions."""
    found: dict[int, set[Index]] = {}
    for unit, _ in statements(program.body):
        if isinstance(unit, Unit):
            ends = unit.first, unit.first + unit.target.size
            found.setdefault(unit.target.lanes, set()).update(ends)
    return {lanes: sorted(marks, key=_place) for lanes, marks in found.items()}


def _place(mark: Index) -> tuple:
    return mark.offset, mark.terms
