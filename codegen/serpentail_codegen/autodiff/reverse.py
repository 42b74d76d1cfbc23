"""Reverse mode: a program that runs another one, then runs it backward for its gradients.

Each array ``x`` that matters gets a companion ``b_x``: how much a weighted sum of the outputs
changes with x.  A value that is overwritten before the backward run needs it is kept, one copy for
each iteration of its loops.
"""

from collections.abc import Collection
from dataclasses import dataclass, field, replace

from ..ir import program as ir
from ..ir.dataflow import (
    backward_slice,
    forward_slice,
    inner_arrays,
    overlap,
    pruned,
    rule_of,
    writes,
)
from .angles import SinesAndCosinesArray, angle_inputs, kinds, sines_and_cosines_arrays
from .step import adjoint

Loops = tuple[ir.Loop, ...]
# the statements that run forward, and those that run backward
BothWays = tuple[list[ir.Statement], list[ir.Statement]]


def adjoint_program(
    program: ir.Program, wanted: Collection[str], given: Collection[str]
) -> ir.Program:
    """Return the program from ``b_<output>`` of given outputs to ``b_<input>`` of wanted inputs."""
    # what lies between the wanted inputs and the given outputs has adjoints, or its angles have
    matters = forward_slice(program.body, wanted) & backward_slice(program.body, given)
    by_angles = {
        name: array for name, array in sines_and_cosines_arrays(program).items() if name in matters
    }
    matters -= by_angles.keys()
    ends = [a for a in program.arrays if a.name in (*wanted, *given)]
    companions = {a.name: _adjoints(a, "local") for a in program.arrays if a.name in matters}
    companions |= {a.name: _adjoints(a, "local", "_sum") for a in ends}

    # adjoints start from the weights of the outputs, and end as those of the inputs
    weights = {a.name: _adjoints(a, "input") for a in ends if a.name in given}
    results = {a.name: _adjoints(a, "output") for a in ends if a.name in wanted}
    zeros = [ir.Fill(b.whole(), (0,) * b.length) for b in companions.values()]
    start = [ir.Copy(companions[name].whole(), weight.whole()) for name, weight in weights.items()]
    end = [ir.Copy(result.whole(), companions[name].whole()) for name, result in results.items()]

    reversal = _Reversal(program, companions, by_angles)
    forward, backward = reversal.body(program.body, ())
    return pruned(
        replace(
            program,
            name="_".join(["b", *wanted, *given, program.name]),
            arrays=(
                *inner_arrays(program),
                *companions.values(),
                *weights.values(),
                *results.values(),
                *reversal.kept,
            ),
            body=(*forward, *zeros, *start, *backward, *end),
        )
    )


def _adjoints(array: ir.Array, role: str, suffix: str = "") -> ir.Array:
    return ir.Array(f"b_{array.name}{suffix}", role, array.size, array.count)


def iterations(loops: Loops) -> tuple[ir.Index, int]:
    """Return the number of the current iteration of nested loops, and how many there are."""
    number, count = ir.as_index(0), 1
    for loop in reversed(loops):
        if loop.start.terms or loop.stop.terms:
            raise ValueError(f"loop {loop.var} is no rectangle: its iterations cannot be numbered")
        first = loop.start.offset
        number = number + count * (ir.Index(((loop.var, 1),)) + -first)
        count *= loop.stop.offset - first
    return number, count


def _apart(ref: ir.Ref, loops: tuple[ir.Loop | ir.When, ...]) -> bool:
    """Tell if a reference means a different place in every iteration of the loops."""
    strides = {var: abs(factor) for var, factor in ref.offset.terms}
    span = ref.size * ref.stride  # of the places meant in all iterations of the inner loops
    rectangles = [loop for loop in loops if isinstance(loop, ir.Loop)]
    for loop in sorted(rectangles, key=lambda loop: strides.get(loop.var, 0)):
        stride = strides.get(loop.var, 0)
        if stride < span or loop.start.terms or loop.stop.terms:
            return False
        span += stride * (loop.stop.offset - loop.start.offset - 1)
    return True


@dataclass
class _Reversal:
    """Reverses statements.

    companions: the adjoints of arrays, by the names of the arrays.
    by_angles: arrays of sines and cosines; they have no adjoints, those of their angles serve.
    kept: copies of values that are overwritten before the backward run needs them.
    """

    program: ir.Program
    companions: dict[str, ir.Array]
    by_angles: dict[str, SinesAndCosinesArray]
    kept: list[ir.Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        # arrays that hold different values at different times
        writers: dict[str, int] = {}
        self.overwritten: set[str] = set()
        for statement, loops in ir.statements(self.program.body):
            for ref in writes(statement):
                name = ref.array.name
                writers[name] = writers.get(name, 0) + 1
                if writers[name] > 1 or not _apart(ref, loops):
                    self.overwritten.add(name)

    def of(self, ref: ir.Ref) -> ir.Ref:
        """Return the adjoints of a reference."""
        return replace(ref, array=self.companions[ref.array.name])

    def matters(self, ref: ir.Ref) -> bool:
        """Tell if the scalars of a reference have adjoints."""
        return ref.array.name in self.companions

    def body(self, body: ir.Body, loops: Loops) -> BothWays:
        """Return statements with what they keep, and their reverse, the last one first."""
        forward: list[ir.Statement] = []
        backward: list[ir.Statement] = []
        for statement in body:
            rule = rule_of(self, statement, "reverses")
            there, back = rule(statement, loops)
            forward += there
            backward = [*back, *backward]
        return forward, backward

    def loop(self, loop: ir.Loop, loops: Loops) -> BothWays:
        """Return a loop, and one that runs the other way."""
        there, back = self.body(loop.body, (*loops, loop))
        forward = replace(loop, body=tuple(there))
        if not back:
            return [forward], []
        return [forward], [replace(loop, body=tuple(back), downward=not loop.downward)]

    def when(self, when: ir.When, loops: Loops) -> BothWays:
        """Return what a condition holds, and the reverse of that under the same condition."""
        if when.scalar.array.name in self.overwritten:
            raise ValueError(f"the condition {when.scalar.array.name} is overwritten: keep a copy")
        there, back = self.body(when.body, loops)
        backward: list[ir.Statement] = [replace(when, body=tuple(back))] if back else []
        return [replace(when, body=tuple(there))], backward

    def solve(self, solve: ir.Solve, loops: Loops) -> BothWays:
        """Return a solve, and that with the transpose of a matrix that has no adjoints: the two
        triangles of a pair change places.
        """
        if self.matters(solve.matrix[0]):
            raise ValueError(f"{solve.matrix.name}: a factored matrix has no adjoints")
        if not self.matters(solve.x):
            return [solve], []
        back = replace(solve, x=self.of(solve.x))
        if not solve.pair:
            return [solve], [back]
        half = solve.x.size * ir.padded(solve.x.size)
        turned = ir.Array(f"turned_{solve.matrix.name}", "local", 2 * half)
        self.kept.append(turned)
        swapped = [
            ir.Copy(turned.part(half - first, half), solve.matrix.part(first, half))
            for first in (0, half)
        ]
        return [solve], [*swapped, replace(back, matrix=turned)]

    def factor(self, factor: ir.Factor, loops: Loops) -> BothWays:
        """Return the factorisation of a matrix that has no adjoints."""
        if self.matters(factor.matrix[0]):
            raise ValueError(f"Factor: {factor.matrix.name} has no adjoints")
        return [factor], []

    def guard(self, guard: ir.Guard, loops: Loops) -> BothWays:
        """Return a guard, which has no reverse."""
        return [guard], []

    def fill(self, fill: ir.Fill, loops: Loops) -> BothWays:
        """Return a fill and its reverse."""
        return [fill], self.cleared(fill.target)

    def cleared(self, *targets: ir.Ref) -> list[ir.Statement]:
        """Return the statements that forget the adjoints of what was overwritten."""
        return [
            ir.Fill(self.of(ref), (0,) * ref.size)
            for ref in targets
            if self.matters(ref) and ref.array.name in self.overwritten
        ]

    def copy(self, copy: ir.Copy, loops: Loops) -> BothWays:
        """Return a copy and its reverse."""
        back: list[ir.Statement] = []
        if self.matters(copy.target) and self.matters(copy.source):
            back.append(ir.Copy(self.of(copy.source), self.of(copy.target), adds=True))
        if not copy.adds:
            back += self.cleared(copy.target)
        return [copy], back

    def apply(self, call: ir.Apply, loops: Loops) -> BothWays:
        """Return a step, keeping what its reverse reads, and its reverse."""
        inputs, stored = call.inputs(), call.stored()
        angles = angle_inputs(self.by_angles, inputs)
        outputs = {name: ref for name, ref in call.outputs().items() if self.matters(ref)}
        wanted = {name for name, ref in inputs.items() if self.matters(ref)} | angles.keys()
        if not outputs or not wanted:
            return [call], self.cleared(*stored)
        step = adjoint(call.step, frozenset(wanted), frozenset(outputs), kinds(angles))

        # it reads the adjoints of outputs, and values as they were before the step
        values = inputs | {f"b_{name}": self.of(ref) for name, ref in outputs.items()}
        keeps: list[ir.Statement] = []
        for name, _ in step.inputs:
            if name in inputs and inputs[name].array.name in self.overwritten:
                copy = self.keep(inputs[name], loops)
                keeps.append(copy)
                values[name] = copy.target

        # its results are added to the adjoints of inputs, but replace those of what it overwrites
        sources = {f"b_{name}": ref for name, ref in inputs.items()}
        for name, array in angles.items():
            sources[f"b_{name}_angles"] = array.angles(inputs[name])
        targets = [sources[name] for name, _ in step.outputs]
        _check_overlaps(call, stored, targets)
        adds = [ref not in stored for ref in targets]
        back = ir.Apply.named(step, values, map(self.of, targets), adds)
        return [*keeps, call], [back, *self.cleared(*(ref for ref in stored if ref not in targets))]

    def keep(self, ref: ir.Ref, loops: Loops) -> ir.Copy:
        """Return the copy of a value that will be overwritten."""
        number, count = iterations(loops)
        array = ir.Array(f"kept_{len(self.kept)}_{ref.array.name}", "local", ref.size, count)
        self.kept.append(array)
        return ir.Copy(array[number], ref)


def _check_overlaps(call: ir.Apply, stored: list[ir.Ref], targets: list[ir.Ref]) -> None:
    """Refuse a step that overwrites a part of what it reads, or what it reads under two names."""
    for ref in stored:
        overlaps = sum(overlap(ref, target) for target in targets)
        if overlaps > (ref in targets):
            raise ValueError(
                f"{call.step.name} overwrites part of what it reads in {ref.array.name}"
            )
