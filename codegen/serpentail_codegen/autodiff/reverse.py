"""Adjoints of programs: a loop nest goes in, the loop nest that runs it, then runs it backward,
comes out.

Each array ``x`` that matters gets a companion ``b_x``, what the weighted outputs change by with x.
A value that is overwritten before the way back needs it is kept, one copy for each iteration of its
loops.
"""

from collections.abc import Collection
from dataclasses import dataclass, field, replace

from ..ir.dataflow import backward_slice, forward_slice, inner_arrays, pruned, writes
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
    as_index,
    statements,
)
from .angles import SinesAndCosinesArray, sines_and_cosines_arrays
from .step import adjoint


def adjoint_program(program: Program, wanted: Collection[str], given: Collection[str]) -> Program:
    """Return the program that takes ``b_<output>`` of the given outputs to ``b_<input>`` of the
    wanted inputs.
    """
    matters = forward_slice(program.body, wanted) & backward_slice(program.body, given)
    by_angles = {
        name: found for name, found in sines_and_cosines_arrays(program).items() if name in matters
    }
    matters -= by_angles.keys()
    ends = [a for a in program.arrays if a.name in (*wanted, *given)]
    companions = {
        a.name: Array(f"b_{a.name}", "local", a.size, a.count)
        for a in program.arrays
        if a.name in matters
    }
    companions |= {a.name: Array(f"b_{a.name}_sum", "local", a.size, a.count) for a in ends}
    weights = [Array(f"b_{a.name}", "input", a.size, a.count) for a in ends if a.name in given]
    results = [Array(f"b_{a.name}", "output", a.size, a.count) for a in ends if a.name in wanted]
    reversal = _Reversal(program, companions, by_angles)
    start = [Fill(b.part(0, b.length), (0,) * b.length) for b in companions.values()]
    start += [Copy(_all(companions[w.name.removeprefix("b_")]), _all(w)) for w in weights]
    forward, backward = reversal.both(program.body, ())
    end = tuple(Copy(_all(b), _all(companions[b.name.removeprefix("b_")])) for b in results)
    arrays = (*inner_arrays(program), *companions.values(), *weights, *results, *reversal.kept)
    body = (*forward, *start, *backward, *end)
    name = "_".join(["b", *wanted, *given, program.name])
    return pruned(replace(program, name=name, arrays=arrays, body=body))


def _all(array: Array) -> Ref:
    return array.part(0, array.length)


def iterations(loops: tuple[Loop, ...]) -> tuple[Index, int]:
    """Return the number of the current iteration of nested loops, and how many there are."""
    number, count = as_index(0), 1
    for loop in reversed(loops):
        if loop.start.terms or loop.stop.terms or loop.start.offset:
            raise ValueError(
                f"loop {loop.var} is no rectangle from 0 on: its iterations cannot be numbered"
            )
        number, count = number + count * Index(((loop.var, 1),)), count * loop.stop.offset
    return number, count


def _apart(ref: Ref, loops: tuple[Loop, ...]) -> bool:
    """Tell if a reference means another place in every iteration of the loops."""
    strides, reach = {var: abs(factor) for var, factor in ref.offset.terms}, ref.size * ref.stride
    for loop in sorted(loops, key=lambda loop: strides.get(loop.var, 0)):
        if strides.get(loop.var, 0) < reach or loop.start.terms or loop.stop.terms:
            return False
        reach += strides[loop.var] * (loop.stop.offset - loop.start.offset - 1)
    return True


def _overlap(ref: Ref, other: Ref) -> bool:
    """Tell if two references may share a scalar."""
    if ref.array.name != other.array.name or ref.offset.terms != other.offset.terms:
        return ref.array.name == other.array.name
    ends = [(r.offset.offset, r.offset.offset + (r.size - 1) * r.stride) for r in (ref, other)]
    return ends[0][0] <= ends[1][1] and ends[1][0] <= ends[0][1]


@dataclass
class _Reversal:
    """Reverses statements; ``companions`` are the adjoint arrays by the names of their arrays.

    Arrays of sines and cosines, ``by_angles``, have none: the adjoints of their angles serve.
    """

    program: Program
    companions: dict[str, Array]
    by_angles: dict[str, SinesAndCosinesArray]
    kept: list[Array] = field(default_factory=list)

    def __post_init__(self):
        writers: dict[str, int] = {}
        self.overwritten: set[str] = set()
        for statement, loops in statements(self.program.body):
            for ref in writes(statement):
                name = ref.array.name
                writers[name] = writers.get(name, 0) + 1
                if writers[name] > 1 or not _apart(ref, loops):
                    self.overwritten.add(name)

    def of(self, ref: Ref) -> Ref:
        """Return the adjoints of a reference."""
        return replace(ref, array=self.companions[ref.array.name])

    def matters(self, ref: Ref) -> bool:
        """Tell if the scalars of a reference have adjoints."""
        return ref.array.name in self.companions

    def both(self, body: tuple, loops: tuple[Loop, ...]) -> tuple[tuple, tuple]:
        """Return a loop nest with what it keeps, and the way back."""
        forward, backward = [], []
        for statement in body:
            if isinstance(statement, Loop):
                there, back = self.both(statement.body, (*loops, statement))
                forward.append(replace(statement, body=there))
                if back:
                    backward.insert(
                        0, replace(statement, body=back, downward=not statement.downward)
                    )
                continue
            there, back = self.statement(statement, loops)
            forward += there
            backward = [*back, *backward]
        return tuple(forward), tuple(backward)

    def statement(self, statement, loops) -> tuple[list, list]:
        """Return a statement with what it keeps, and its reverse."""
        if isinstance(statement, Apply):
            return self.apply(statement, loops)
        if isinstance(statement, Copy):
            return [statement], self.copy(statement)
        if isinstance(statement, Fill):
            return [statement], self.cleared(statement.target)
        if isinstance(statement, Guard):
            return [statement], []
        raise TypeError(f"no rule reverses {type(statement).__name__}")

    def cleared(self, *targets: Ref) -> list:
        """Return the statements that forget the adjoints of what was overwritten."""
        found = [ref for ref in targets if self.matters(ref) and ref.array.name in self.overwritten]
        return [Fill(self.of(ref), (0,) * ref.size) for ref in found]

    def copy(self, copy: Copy) -> list:
        """Return the reverse of a copy."""
        back = []
        if self.matters(copy.target) and self.matters(copy.source):
            back.append(Copy(self.of(copy.source), self.of(copy.target), adds=True))
        return back if copy.adds else back + self.cleared(copy.target)

    def apply(self, call: Apply, loops) -> tuple[list, list]:
        """Return a step, keeping what its reverse reads, and its reverse."""
        read, written = call.inputs(), call.outputs()
        stored = [ref for ref, adds in zip(call.writes, call.adds, strict=True) if not adds]
        given = frozenset(n for n, ref in written.items() if self.matters(ref))
        angle_inputs = {
            n: self.by_angles[ref.array.name]
            for n, ref in read.items()
            if ref.array.name in self.by_angles
        }
        wanted = frozenset(n for n, ref in read.items() if self.matters(ref)) | angle_inputs.keys()
        if not given or not wanted:
            return [call], self.cleared(*stored)
        kinds = frozenset((n, found.kind) for n, found in angle_inputs.items())
        step = adjoint(call.step, frozenset(wanted), given, kinds)
        values = read | {f"b_{n}": self.of(ref) for n, ref in written.items() if n in given}
        keeps = []
        for name, _ in step.inputs:
            if name in read and read[name].array.name in self.overwritten:
                keeps.append(self.keep(read[name], loops))
                values[name] = keeps[-1].target
        places = {f"b_{n}": ref for n, ref in read.items()}
        places |= {f"b_{n}_angles": found.angles(read[n]) for n, found in angle_inputs.items()}
        targets = [places[name] for name, _ in step.outputs]
        in_place = [ref in stored for ref in targets]
        for ref in stored:
            if sum(_overlap(ref, other) for other in targets) > (ref in targets):
                raise ValueError(
                    f"{call.step.name} overwrites part of what it reads in {ref.array.name}"
                )
        back = Apply(
            step,
            tuple(values[name] for name, _ in step.inputs),
            tuple(map(self.of, targets)),
            tuple(not here for here in in_place),
        )
        return [*keeps, call], [back, *self.cleared(*(ref for ref in stored if ref not in targets))]

    def keep(self, ref: Ref, loops) -> Copy:
        """Return the copy of a value that will be overwritten."""
        number, count = iterations(loops)
        array = Array(f"kept_{len(self.kept)}_{ref.array.name}", "local", ref.size, count)
        self.kept.append(array)
        return Copy(array[number], ref)
