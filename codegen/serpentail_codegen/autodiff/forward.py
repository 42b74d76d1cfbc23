"""Forward mode: a program that carries the derivatives of its values along.

Each array ``x`` that depends on the inputs of interest gets a companion ``d_x``.  With lanes, every
scalar of ``d_x`` has one number for each direction; without, it is the derivative in one direction.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from ..ir import program as ir
from ..ir.dataflow import (
    forward_slice,
    inner_arrays,
    names,
    pruned,
    reads,
    rewritten,
    rule_of,
    with_outputs,
    writes,
)
from .angles import SinesAndCosinesArray, angle_inputs, kinds, sines_and_cosines_arrays
from .step import tangent

Bound = Callable[[tuple[ir.Loop, ...]], ir.Index | None]


def all_lanes(loops: tuple[ir.Loop, ...]) -> None:
    """Set no bound: every lane is needed in all loops."""


@dataclass(frozen=True)
class Lanes:
    """Directions of differentiation side by side.

    active: the inputs that they move.
    count: how many they are, 0 for one direction in narrow scalars.
    bound: how many are needed inside given loops.
    prefix: how the names of their tangents begin, as in ``d_x``.
    wanted: the outputs whose tangents are given; None for all.
    cut: arrays to which values are copied and straight back. Tangents end there: from there on they
    have the tangents that are given, if the array is active, or none.
    """

    active: Collection[str]
    count: int = 0
    bound: Bound = all_lanes
    prefix: str = "d"
    wanted: Collection[str] | None = None
    cut: Collection[str] = ()

    def companion(self, array: ir.Array) -> ir.Array:
        """Return the tangents of an array; those of parameters and of cuts are inputs."""
        given = array.role == "parameters" or array.name in self.cut
        role = "input" if given else array.role
        if role == "output" and self.wanted is not None and array.name not in self.wanted:
            role = "local"
        name = f"{self.prefix}_{array.name}"
        return ir.Array(name, role, array.size, array.count, lanes=self.count)


def tangent_program(
    program: ir.Program,
    active: Collection[str],
    lanes: int = 0,
    bound: Bound = all_lanes,
    kept: Collection[str] = (),
    cut: Collection[str] = (),
) -> ir.Program:
    """Return the program that takes ``d_<input>`` of the active inputs to ``d_<output>``.

    lanes, bound, cut: as of ``Lanes``; kept: outputs that are given, too.
    """
    return tangents_together(program, [Lanes(active, lanes, bound, cut=cut)], kept)


def tangents_together(
    program: ir.Program, kinds_of_lanes: Sequence[Lanes], kept: Collection[str] = ()
) -> ir.Program:
    """Return the program of the tangents of several kinds at once, which share all values."""
    # every array that depends on the active ones has tangents, or its angles do
    sweeps, angles = [], sines_and_cosines_arrays(program)
    for lanes in kinds_of_lanes:
        cut = set(lanes.cut)
        moving = forward_slice(without_writes(program.body, cut), lanes.active)
        by_angles = {name: array for name, array in angles.items() if name in moving}
        moving -= by_angles.keys()
        companions = {a.name: lanes.companion(a) for a in program.arrays if a.name in moving}
        sweeps.append(_Tangents(companions, by_angles, lanes.bound, cut))

    # lanes that a statement leaves out are zero from the start
    body = _Together(sweeps).body(program.body, ())
    fills = tuple(ir.Fill(ref, (0,) * ref.size) for ref in _partly_written(body))

    own = inner_arrays(program)
    own = tuple(replace(a, role="output") if a.name in kept else a for a in own)
    arrays = (*own, *(a for sweep in sweeps for a in sweep.companions.values()))
    counts = [str(lanes.count) for lanes in kinds_of_lanes if lanes.count]
    words = [word for lanes in kinds_of_lanes for word in (lanes.prefix, *lanes.active)]
    name = "_".join([*words, program.name, *(["rows_of", *counts] if counts else [])])
    return pruned(replace(program, name=name, arrays=arrays, body=fills + body))


def without_writes(body: ir.Body, arrays: Collection[str]) -> ir.Body:
    """Return a body without the statements that write to some arrays."""
    if not arrays:
        return body
    return rewritten(body, lambda s: () if names(writes(s)).intersection(arrays) else (s,))


def _partly_written(body: ir.Body) -> list[ir.Ref]:
    """Return the wide arrays of which some statement writes only a part of the lanes, and that are
    read beyond: outputs, what is read without a bound, and where the part grows from iteration to
    iteration.
    """
    arrays: dict[str, ir.Array] = {}
    beyond: set[str] = set()
    for statement, _ in ir.statements(body):
        if isinstance(statement, ir.Apply) and statement.columns:
            for ref in writes(statement):
                if ref.array.lanes:
                    arrays[ref.array.name] = ref.array
                    beyond |= {ref.array.name} if statement.columns.terms else set()
        else:
            beyond |= names(reads(statement))
    return [a.whole() for a in arrays.values() if a.role == "output" or a.name in beyond]


class _Tangents:
    """The tangents of one kind: statements that compute them beside those of the values.

    companions: the tangents of arrays, by the names of the arrays.
    by_angles: arrays of sines and cosines; they have no tangents, those of their angles serve.
    """

    def __init__(
        self,
        companions: dict[str, ir.Array],
        by_angles: dict[str, SinesAndCosinesArray],
        bound: Bound,
        cut: Collection[str],
    ):
        self.companions, self.by_angles, self.bound = companions, by_angles, bound
        self.cut = cut

    def moves(self, ref: ir.Ref) -> bool:
        """Tell if the scalars of a reference have tangents."""
        return ref.array.name in self.companions

    def of(self, ref: ir.Ref) -> ir.Ref:
        """Return the tangents of a reference."""
        return replace(ref, array=self.companions[ref.array.name])

    def cleared(self, *targets: ir.Ref) -> Iterator[ir.Statement]:
        """Yield what sets the tangents of overwritten scalars to zero."""
        for target in targets:
            if self.moves(target):
                yield ir.Fill(self.of(target), (0,) * target.size)

    def copy(self, copy: ir.Copy) -> Iterator[ir.Statement]:
        """Yield the copy of the tangents."""
        if self.moves(copy.target) and self.moves(copy.source):
            yield replace(copy, target=self.of(copy.target), source=self.of(copy.source))
        elif not copy.adds:
            yield from self.cleared(copy.target)

    def step(self, call: ir.Apply, loops: tuple[ir.Loop, ...]) -> ir.Apply | None:
        """Return a step with its tangents, None if it has none."""
        values = call.inputs()
        active = {name for name, ref in values.items() if self.moves(ref)}
        angles = angle_inputs(self.by_angles, values)

        # sines and cosines need no tangents, and of constants they are zero
        makes_sines = any(ref.array.name in self.by_angles for ref in call.writes)
        if makes_sines or not (active or angles):
            return None

        # the step of values and tangents, and what it reads by the names of its inputs
        step = tangent(call.step, frozenset(active | angles.keys()), kinds(angles))
        for name, array in angles.items():
            values[f"d_{name}_angles"] = self.of(array.angles(values[name]))
        for name in active:
            values[f"d_{name}"] = self.of(values[name])
        targets = (*call.writes, *map(self.of, call.writes))
        both = ir.Apply.named(step, values, targets, call.adds * 2)
        return replace(both, columns=self.bound(loops))


class _Together:
    """Rewrites statements so that they compute tangents of several kinds as well."""

    def __init__(self, sweeps: Sequence[_Tangents]):
        self.sweeps = sweeps

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
        for sweep in self.sweeps:
            yield from sweep.cleared(fill.target)

    def copy(self, copy: ir.Copy, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
        """Yield a copy, and that of the tangents; what is cut keeps its value."""
        source, target = copy.source.array.name, copy.target.array.name
        cut = set().union(*(sweep.cut for sweep in self.sweeps))
        if not {source, target} & cut:
            yield copy
        for sweep in self.sweeps:
            if target not in sweep.cut:
                yield from sweep.copy(copy)

    def apply(self, call: ir.Apply, loops: tuple[ir.Loop, ...]) -> Iterator[ir.Statement]:
        """Yield a step with its tangents of the last kind; before it come those of the other kinds,
        which read the same values.
        """
        found = [sweep.step(call, loops) for sweep in self.sweeps]
        steps = [both for both in found if both]
        first = len(call.writes)
        for step in steps[:-1]:
            yield with_outputs(step, [name for name, _ in step.step.outputs[first:]])
        yield steps[-1] if steps else call
        for sweep, both in zip(self.sweeps, found, strict=True):
            if not both:
                yield from sweep.cleared(*call.stored())
