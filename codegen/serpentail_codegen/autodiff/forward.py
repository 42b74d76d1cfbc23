"""Tangents of programs: a loop nest goes in, the loop nest that carries its derivatives along comes
out.

Each active array ``x`` gets a companion ``d_x``.  With lanes, every scalar of it is a row with one
number for each direction; without, it holds the derivative in one direction.
"""

from collections.abc import Callable, Collection
from dataclasses import replace

from ..ir.dataflow import forward_slice, inner_arrays, pruned, writes
from ..ir.program import Apply, Array, Copy, Fill, Guard, Index, Loop, Program, Ref, statements
from .angles import SinesAndCosinesArray, sines_and_cosines_arrays
from .step import tangent

Bound = Callable[[tuple[Loop, ...]], Index | None]


def all_lanes(loops: tuple[Loop, ...]) -> None:
    """Need all lanes in every loop."""


def tangent_program(
    program: Program, active: Collection[str], lanes: int = 0, bound: Bound = all_lanes
) -> Program:
    """Return the program that takes ``d_<input>`` of the active inputs along and gives
    ``d_<output>``.

    ``bound`` tells how many lanes are needed inside given loops.
    """
    moving, by_angles = forward_slice(program.body, active), sines_and_cosines_arrays(program)
    by_angles = {name: found for name, found in by_angles.items() if name in moving}
    own = [a for a in program.arrays if a.name in moving - by_angles.keys()]
    companions = {a.name: Array(f"d_{a.name}", _role(a), a.size, a.count, lanes=lanes) for a in own}
    transform = _Tangents(companions, by_angles, bound)
    body = transform.body(program.body, ())
    fills = tuple(Fill(ref, (0,) * ref.size) for ref in _partly_written(body))
    arrays = (*inner_arrays(program), *companions.values())
    name = "_".join(["d", *active, program.name, *(["rows_of", str(lanes)] if lanes else [])])
    return pruned(replace(program, name=name, arrays=arrays, body=fills + body))


def _role(array: Array) -> str:
    return "input" if array.role == "parameters" else array.role


def _partly_written(body: tuple) -> list[Ref]:
    """Return the rows that some statement writes in part of their lanes: the others must be
    zero.
    """
    found = {}
    for statement, _ in statements(body):
        if getattr(statement, "columns", None):
            found |= {ref.array.name: ref.array for ref in writes(statement) if ref.array.lanes}
    return [a.part(0, a.length) for a in found.values()]


class _Tangents:
    """Rewrites statements; ``companions`` are the tangent arrays by the names of their arrays.

    Arrays of sines and cosines, ``by_angles``, have none: the tangents of their angles serve.
    """

    def __init__(
        self, companions: dict[str, Array], by_angles: dict[str, SinesAndCosinesArray], bound: Bound
    ):
        self.companions, self.by_angles, self.bound = companions, by_angles, bound

    def moves(self, ref: Ref) -> bool:
        """Tell if the scalars of a reference have tangents."""
        return ref.array.name in self.companions

    def of(self, ref: Ref) -> Ref:
        """Return the tangents of a reference."""
        return replace(ref, array=self.companions[ref.array.name])

    def body(self, body: tuple, loops: tuple[Loop, ...]) -> tuple:
        """Return the transformed loop nest."""
        out = []
        for statement in body:
            if isinstance(statement, Loop):
                out.append(replace(statement, body=self.body(statement.body, (*loops, statement))))
            elif isinstance(statement, Apply):
                out += self.apply(statement, self.bound(loops))
            elif isinstance(statement, Copy | Fill):
                out += self.store(statement)
            elif isinstance(statement, Guard):
                out.append(statement)
            else:
                raise TypeError(f"no rule differentiates {type(statement).__name__}")
        return tuple(out)

    def store(self, statement: Copy | Fill):
        """Yield a copy or fill and what it does to tangents."""
        yield statement
        if self.moves(statement.target):
            target = self.of(statement.target)
            if isinstance(statement, Copy) and self.moves(statement.source):
                yield replace(statement, target=target, source=self.of(statement.source))
            elif not getattr(statement, "adds", False):
                yield Fill(target, (0,) * target.size)

    def apply(self, call: Apply, columns: Index | None):
        """Yield a step with its tangents."""
        values = call.inputs()
        angle_inputs = {
            name: self.by_angles[ref.array.name]
            for name, ref in values.items()
            if ref.array.name in self.by_angles
        }
        active = {name for name, ref in values.items() if self.moves(ref)}
        if (
            any(ref.array.name in self.by_angles for ref in call.writes)
            or not active | angle_inputs.keys()
        ):
            yield call
            for ref, adds in zip(call.writes, call.adds, strict=True):
                if self.moves(ref) and not adds:
                    yield Fill(self.of(ref), (0,) * ref.size)
            return
        kinds = frozenset((name, found.kind) for name, found in angle_inputs.items())
        step = tangent(call.step, frozenset(active | angle_inputs.keys()), kinds)
        tangents = {
            f"d_{name}_angles": self.of(found.angles(values[name]))
            for name, found in angle_inputs.items()
        }
        values |= tangents | {f"d_{name}": self.of(values[name]) for name in active}
        yield Apply(
            step,
            tuple(values[name] for name, _ in step.inputs),
            call.writes + tuple(map(self.of, call.writes)),
            call.adds * 2,
            columns,
        )
