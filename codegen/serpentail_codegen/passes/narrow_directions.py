"""Directions of differentiation in turn: a program whose wide arrays become narrow ones.

The lanes of vectors are then free for something else, such as states.  A step of values and
tangents falls into two: one of all that is the same for every direction, and one that a loop over
directions applies.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from ..ir import program as ir
from ..ir.dataflow import inlined, names, reads, rule_of, writes
from ..ir.step import Step
from .dead_fills import without_unread_fills
from .fuse_steps import fused
from .split_steps import SLOPES, is_zero, parted, without
from .structural_zeros import Patterns, lanes_read

DIRECTION = "d"  # the loop variable
HERE = ir.Index(((DIRECTION, 1),))


def directions_in_turn(program: ir.Program) -> ir.Program:
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


def has_directions(program: ir.Program) -> bool:
    """Tell if a program has wide arrays."""
    return any(a.lanes for a in inlined(program).arrays)


def places_lanes(program: ir.Program) -> bool:
    """Tell if a program writes single lanes, or reads them for what is wide: no line of wide
    operations can express that.
    """

    def places(statement: ir.Statement) -> bool:
        wide = [ref for ref in writes(statement) if ref.array.lanes]
        return any(ref.lane for ref in wide) or bool(wide and any(r.lane for r in reads(statement)))

    return any(places(s) for s, _ in ir.statements(inlined(program).body))


class _Turns:
    """Rewrites statements on wide arrays as loops over directions.

    patterns: which lanes of what steps read may differ from zero.
    boundaries: where directions of another kind begin.
    slopes: arrays of what is the same for every direction, by their names.
    """

    def __init__(self, patterns: Patterns, boundaries: dict[int, list[ir.Index]]) -> None:
        self.patterns, self.boundaries = patterns, boundaries
        self.slopes: dict[str, ir.Array] = {}

    def body(self, body: ir.Body, variables: tuple[str, ...]) -> ir.Body:
        """Return the rewritten loop nest."""
        out: list[ir.Statement] = []
        for statement in body:
            if isinstance(statement, ir.Loop):
                inner = self.body(statement.body, (*variables, statement.var))
                out.append(replace(statement, body=inner))
            elif any(ref.array.lanes for ref in (*reads(statement), *writes(statement))):
                rule = rule_of(self, statement, "narrows")
                self.variables = variables
                out += rule(statement)
            elif isinstance(statement, ir.Apply):
                out.append(replace(statement, columns=None))  # it has no tangents left
            else:
                out.append(statement)
        return tuple(out)

    @staticmethod
    def narrow(array: ir.Array) -> ir.Array:
        """Return what holds an array's directions one after the other."""
        return replace(array, count=array.count * max(array.lanes, 1), lanes=0)

    def at(self, ref: ir.Ref, direction: ir.Index | int = HERE) -> ir.Ref:
        """Return what a reference means in one direction; lanes become scalars that lie apart."""
        array, length = ref.array, ref.array.length
        if not array.lanes:
            return ref
        if ref.lane is None:
            offset, stride = ref.offset + length * ir.as_index(direction), ref.stride
        else:
            down = ref.stride == array.row  # one lane of several scalars
            offset, stride = ref.offset + length * ref.lane, 1 if down else length
        return ir.Ref(self.narrow(array), offset, ref.size, stride)

    def each(self, lanes: ir.Index | int, *body: ir.Statement) -> ir.Loop:
        """Return a loop over directions."""
        return ir.Loop(DIRECTION, ir.as_index(0), ir.as_index(lanes), False, body)

    def fill(self, fill: ir.Fill) -> Iterator[ir.Statement]:
        """Yield the fill for each direction; a whole array is filled at once."""
        target = self.at(fill.target)
        if fill.target == fill.target.array.whole() and len(set(fill.values)) == 1:
            whole = target.array.whole()
            yield ir.Fill(whole, fill.values[:1] * whole.size)
            return
        if not fill.target.lanes:  # single lanes
            yield replace(fill, target=target)
            return
        yield self.each(fill.target.lanes, replace(fill, target=target))

    def unit(self, unit: ir.Unit) -> Iterator[ir.Statement]:
        """Yield zeros, then the directions that have a one among them."""
        target = unit.target
        yield from self.fill(ir.Fill(target, (0,) * target.size))
        for k in range(target.size):
            one = tuple(int(j == k) for j in range(target.size))
            yield ir.Fill(self.at(target, unit.first + k), one)

    def copy(self, copy: ir.Copy) -> Iterator[ir.Statement]:
        """Yield the copy for each direction that has anything, or that of single lanes."""
        moved = replace(copy, target=self.at(copy.target), source=self.at(copy.source))
        if not copy.source.lanes:
            yield self.each(copy.target.lanes, moved) if copy.target.lanes else moved
            return
        for first, last, moving in self.kinds(copy, ir.as_index(copy.target.lanes)):
            zeros = [] if copy.adds else self.cleared(copy.target)
            body = [moved] if moving else zeros
            if body:
                yield replace(self.each(last, *body), start=first)

    def guard(self, guard: ir.Guard) -> Iterator[ir.Statement]:
        """Yield the guard for each direction; it protects whole arrays."""
        protects = tuple(self.narrow(ref.array).whole() for ref in guard.protects)
        one = replace(guard, scalar=self.at(guard.scalar), protects=protects)
        yield self.each(guard.scalar.lanes, one) if guard.scalar.lanes else one

    def solve(self, solve: ir.Solve) -> Iterator[ir.Statement]:
        """Yield a solution for each direction."""
        yield self.each(solve.x.lanes, replace(solve, x=self.at(solve.x)))

    def apply(self, call: ir.Apply) -> Iterator[ir.Statement]:
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
            array = ir.Array(f"slopes_of_{call.step.name}", "local", parts.slopes)
            slopes[SLOPES] = self.slopes.setdefault(array.name, array)[0]
        targets = {name: self.at(ref) for name, ref in outputs.items()} | slopes
        sources = {name: self.at(ref) for name, ref in inputs.items()} | slopes

        def applied(step: Step) -> ir.Apply:
            given = [targets[name] for name, _ in step.outputs]
            return ir.Apply.named(
                step, sources, given, [adds.get(n, False) for n, _ in step.outputs]
            )

        if parts.shared.outputs:
            yield applied(parts.shared)
        lanes = next(ref.lanes for ref in (inputs | outputs).values() if ref.lanes)
        stop = ir.as_index(lanes if call.columns is None else call.columns)
        for first, last, moving in self.kinds(call, stop):
            step = without(parts.each, wide - moving)
            body = self.cleared(*call.stored()) if is_zero(step) else [applied(step)]
            if body:
                yield replace(self.each(last, *body), start=first)

    def cleared(self, *targets: ir.Ref) -> list[ir.Statement]:
        """Return what stores the zeros that come of nothing but zeros."""
        return [ir.Fill(self.at(ref), (0,) * ref.size) for ref in targets if ref.lanes]

    def kinds(
        self, call: ir.Apply | ir.Copy, stop: ir.Index
    ) -> Iterator[tuple[ir.Index, ir.Index, frozenset[str]]]:
        """Yield ranges of directions, and what is not zero in them of what a statement reads."""
        runs = self.patterns.get(id(call), [])
        lanes = next(ref.lanes for ref in (*reads(call), *writes(call)) if ref.lanes)
        marks = [ir.as_index(0)]
        for mark in self.boundaries.get(lanes, []):
            known = all(variable in self.variables for variable, _ in mark.terms)
            if known and all(marks[-1].at(at) <= mark.at(at) <= stop.at(at) for at, _ in runs):
                marks.append(mark)
        begun: list[
            tuple[ir.Index, frozenset[str]]
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


def boundaries(program: ir.Program) -> dict[int, list[ir.Index]]:
    """Return where unit directions begin and end, in order, by the number of all directions."""
    found: dict[int, set[ir.Index]] = {}
    for unit, _ in ir.statements(program.body):
        if isinstance(unit, ir.Unit):
            ends = unit.first, unit.first + unit.target.size
            found.setdefault(unit.target.lanes, set()).update(ends)
    return {lanes: sorted(marks, key=_place) for lanes, marks in found.items()}


def _place(mark: ir.Index) -> tuple:
    return mark.offset, mark.terms
