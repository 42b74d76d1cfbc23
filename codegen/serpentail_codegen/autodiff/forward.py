"""Forward mode: a program that carries the derivatives of its values along.

Each array ``x`` that depends on the inputs of interest gets a companion ``d_x``.  With lanes, every
scalar of ``d_x`` has one number for each direction; without, it is the derivative in one direction.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace

from ..ir import program as ir
from ..ir.dataflow import forward_slice, inner_arrays, pruned, rule_of, writes
from .angles import SinesAndCosinesArray, angle_inputs, kinds, sines_and_cosines_arrays
from .step import tangent

Bound = Callable[[tuple[ir.Loop, ...]], ir.Index | None]


def all_lanes(loops: tuple[ir.Loop, ...]) -> None:
    """Set no bound: every lane is needed in all loops."""


def tangent_program(
    program: ir.Program,
    active: Collection[str],
    lanes: int = 0,
    bound: Bound = all_lanes,
    kept: Collection[str] = (),
) -> ir.Program:
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
        a.name: ir.Array(f"d_{a.name}", _role(a), a.size, a.count, lanes=lanes)
        for a in program.arrays
        if a.name in moving - by_angles.keys()
    }

    # lanes that a statement leaves out are zero from the start
    body = _Tangents(companions, by_angles, bound).body(program.body, ())
    fills = tuple(ir.Fill(ref, (0,) * ref.size) for ref in _partly_written(body))

    own = inner_arrays(program)
    own = tuple(replace(a, role="output") if a.name in kept else a for a in own)
    arrays = (*own, *companions.values())
    name = "_".join(["d", *active, program.name])
    if lanes:
        name = f"{name}_rows_of_{lanes}"
    return pruned(replace(program, name=name, arrays=arrays, body=fills + body))


def _role(array: ir.Array) -> str:
    """Return the role of an array's tangents; the tangents of parameters are inputs."""
    return "input" if array.role == "parameters" else array.role


def _partly_written(body: ir.Body) -> list[ir.Ref]:
    """Return the wide arrays of which some statement writes only a part of the lanes."""
    arrays: dict[str, ir.Array] = {}
    for statement, _ in ir.statements(body):
        if isinstance(statement, ir.Apply) and statement.columns:
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
        self,
        companions: dict[str, ir.Array],
        by_angles: dict[str, SinesAndCosinesArray],
        bound: Bound,
    ):
        self.companions, self.by_angles, self.bound = companions, by_angles, bound

    def moves(self, ref: ir.Ref) -> bool:
        """Tell if the scalars of a reference have tangents."""
        return ref.array.name in self.companions

    def of(self, ref: ir.Ref) -> ir.Ref:
        """Return the tangents of a reference."""
        return replace(ref, array=self.companions[ref.array.name])

    def body(self, body: ir.Body, loops: tuple[ir.Loop, ...]) -> ir.Body:
        """Return the transformed loop nest."""
        out: list[ir.Statement] = []
        for statement in body:
            rule = rule_of(self, statement, "differentiates")
            out += rule(statement, loops)
        return tuple(out)

    def loop(self, loop: ir.Loop, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
        """Yield a loop over the transformed body."""
        yield replace(loop, body=self.body(loop.body, (*loops, loop)))

    def guard(self, guard: ir.Guard, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
        """Yield a guard as it is."""
        yield guard

    def fill(self, fill: ir.Fill, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
        """Yield a fill, and forget the tangents of what it overwrites."""
        yield fill
        yield from self.cleared(fill.target)

    def cleared(self, *targets: ir.Ref) -> Iterator[ir.Statement]:
        """Yield what sets the tangents of overwritten scalars to zero."""
        for target in targets:
            if self.moves(target):
                yield ir.Fill(self.of(target), (0,) * target.size)

    def copy(self, copy: ir.Copy, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
        """Yield a copy, and that of the tangents."""
        yield copy
        if self.moves(copy.target) and self.moves(copy.source):
            yield replace(copy, target=self.of(copy.target), source=self.of(copy.source))
        elif not copy.adds:
            yield from self.cleared(copy.target)

    def apply(self, call: ir.Apply, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
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
        both = ir.Apply.named(step, values, targets, call.adds * 2)
        yield replace(both, columns=self.bound(loops))
