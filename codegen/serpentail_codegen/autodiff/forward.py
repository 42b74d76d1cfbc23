"""Forward mode: a program that carries the derivatives of its values along.

Each array ``x`` that depends on the inputs of interest gets a companion ``d_x``.  With lanes, every
scalar of ``d_x`` has one number for each direction; without, it is the derivative in one direction.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from typing import Any

from ..ir.dataflow import forward_slice, inner_arrays, pruned, writes
from ..ir.program import (
    Apply,
    Array,
    Copy,
    Fill,
    Guard,
    Index,
    Loop,
    Program,
    Ref,
    Statement,
    statements,
)
from .angles import SinesAndCosinesArray, angle_inputs, kinds, sines_and_cosines_arrays
from .step import tangent

Bound = Callable[[tuple[Loop, ...]], Index | None]


def all_lanes(loops: tuple[Loop, ...]) -> None:
    """Set no bound: every lane is needed in all loops."""


def tangent_program(
    program: Program,
    active: Collection[str],
    lanes: int = 0,
    bound: Bound = all_lanes,
    kept: Collection[str] = (),
) -> Program:
    """Return the program that takes ``d_<input>`` of the active inputs to ``d_<output>``.

    ``lanes`` is the number of directions, 0 for one direction in narrow scalars; ``bound`` tells
    how many of the lanes are needed inside given loops.  ``kept`` outputs are given, too.
    """
    # every array that depends on the active ones has tangents, or its angles do
    moving = forward_slice(program.body, active)
    by_angles = {
        name: array for name, array in sines_and_cosines_arrays(program).items() if name in moving
    }
    companions = {
        a.name: Array(f"d_{a.name}", _role(a), a.size, a.count, lanes=lanes)
        for a in program.arrays
        if a.name in moving - by_angles.keys()
    }

    # lanes that a statement leaves out are zero from the start
    body = _Tangents(companions, by_angles, bound).body(program.body, ())
    fills = tuple(Fill(ref, (0,) * ref.size) for ref in _partly_written(body))

    own = inner_arrays(program)
    own = tuple(replace(a, role="output") if a.name in kept else a for a in own)
    arrays = (*own, *companions.values())
    name = "_".join(["d", *active, program.name])
    if lanes:
        name = f"{name}_rows_of_{lanes}"
    return pruned(replace(program, name=name, arrays=arrays, body=fills + body))


def _role(array: Array) -> str:
    """Return the role of an array's tangents; the tangents of parameters are inputs."""
    return "input" if array.role == "parameters" else array.role


def _partly_written(body: tuple[Statement, ...]) -> list[Ref]:
    """Return the wide arrays of which some statement writes only a part of the lanes."""
    arrays: dict[str, Array] = {}
    for statement, _ in statements(body):
        if isinstance(statement, Apply) and statement.columns:
            for ref in writes(statement):
                if ref.array.lanes:
                    arrays[ref.array.name] = ref.array
    return [a.whole() for a in arrays.values()]


class _Tangents:
    """Rewrites statements so that they compute tangents as well.

    companions: the tangents of arrays, by the names of the arrays.
    by_angles: arrays of sines and cosines; they have no tangents, those of their angles serve.
    """

    def __init__(
        self, companions: dict[str, Array], by_angles: dict[str, SinesAndCosinesArray], bound: Bound
    ):
        self.companions, self.by_angles, self.bound = companions, by_angles, bound
        self.rules: dict[type, Callable[[Any, tuple[Loop, ...]], Iterator[Statement]]] = {
            Apply: self.apply,
            Copy: self.copy,
            Fill: self.fill,
            Guard: self.guard,
            Loop: self.loop,
        }

    def moves(self, ref: Ref) -> bool:
        """Tell if the scalars of a reference have tangents."""
        return ref.array.name in self.companions

    def of(self, ref: Ref) -> Ref:
        """Return the tangents of a reference."""
        return replace(ref, array=self.companions[ref.array.name])

    def body(self, body: tuple[Statement, ...], loops: tuple[Loop, ...]) -> tuple[Statement, ...]:
        """Return the transformed loop nest."""
        out: list[Statement] = []
        for statement in body:
            rule = self.rules.get(type(statement))
            if rule is None:
                raise TypeError(f"no rule differentiates {type(statement).__name__}")
            out += rule(statement, loops)
        return tuple(out)

    def loop(self, loop: Loop, loops: tuple[Loop, ...]) -> Iterator[Statement]:
        """Yield a loop over the transformed body."""
        yield replace(loop, body=self.body(loop.body, (*loops, loop)))

    def guard(self, guard: Guard, loops: tuple[Loop, ...]) -> Iterator[Statement]:
        """Yield a guard as it is."""
        yield guard

    def fill(self, fill: Fill, loops: tuple[Loop, ...]) -> Iterator[Statement]:
        """Yield a fill, and forget the tangents of what it overwrites."""
        yield fill
        yield from self.cleared(fill.target)

    def cleared(self, *targets: Ref) -> Iterator[Statement]:
        """Yield what sets the tangents of overwritten scalars to zero."""
        for target in targets:
            if self.moves(target):
                yield Fill(self.of(target), (0,) * target.size)

    def copy(self, copy: Copy, loops: tuple[Loop, ...]) -> Iterator[Statement]:
        """Yield a copy, and that of the tangents."""
        yield copy
        if self.moves(copy.target) and self.moves(copy.source):
            yield replace(copy, target=self.of(copy.target), source=self.of(copy.source))
        elif not copy.adds:
            yield from self.cleared(copy.target)

    def apply(self, call: Apply, loops: tuple[Loop, ...]) -> Iterator[Statement]:
        """Yield a step with its tangents."""
        values = call.inputs()
        active = {name for name, ref in values.items() if self.moves(ref)}
        angles = angle_inputs(self.by_angles, values)

        # sines and cosines need no tangents, and of constants they are zero
        makes_sines = any(ref.array.name in self.by_angles for ref in call.writes)
        if makes_sines or not (active or angles):
            yield call
            yield from self.cleared(*call.stored())
            return

        # the step of values and tangents, and what it reads by the names of its inputs
        step = tangent(call.step, frozenset(active | angles.keys()), kinds(angles))
        for name, array in angles.items():
            values[f"d_{name}_angles"] = self.of(array.angles(values[name]))
        for name in active:
            values[f"d_{name}"] = self.of(values[name])
        targets = (*call.writes, *map(self.of, call.writes))
        both = Apply.named(step, values, targets, call.adds * 2)
        yield replace(both, columns=self.bound(loops))
