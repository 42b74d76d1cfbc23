"""The meaning of a program: a run executes it statement by statement.

Over numbers, a run is the reference for every emitted text. Over a tape, it unrolls the loops into
one straight line.
"""

import math
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

from . import program as ir
from .algebra import Algebra, Number, positive_in_lanes
from .dataflow import inlined, rule_of
from .ldl import ldl_factor, pair_factor, pair_solve
from .step import Step
from .tape import Tape, replay


class Numbers:
    """The algebra of numbers of one kind, such as floats, fractions or NumPy arrays.

    functions: what has ``sin``, ``cos`` and ``sqrt`` of them.
    convert: turns an exact constant into such a number.
    """

    def __init__(self, functions: Any = math, convert: Callable = float):
        self.sin = functions.sin
        self.cos = functions.cos
        self.sqrt = functions.sqrt
        self.convert = convert

    def const(self, value: Number) -> Any:
        """Return an exact constant as a number; what cannot take a fraction divides it."""
        try:
            return self.convert(value)
        except TypeError:
            exact = Fraction(value)
            return self.convert(exact.numerator) / self.convert(exact.denominator)

    def unit(self, lane: int, lanes: int) -> Any:
        """Return an array that is 1 in one lane and 0 elsewhere."""
        import numpy as np  # the generator's own algebras have no use for it

        return np.array([self.const(int(k == lane)) for k in range(lanes)])

    @staticmethod
    def lane(a: Any, lane: int) -> Any:
        """Return one lane of an array; a number is the same in all."""
        return a[lane] if getattr(a, "ndim", 0) else a

    def placed(self, a: Any, lane: int, lanes: int, value: Any) -> Any:
        """Return an array with one lane replaced; a number is the same in all."""
        import numpy as np  # as in ``unit``

        a = np.array(a) if getattr(a, "ndim", 0) else np.array([a] * lanes)
        a[lane] = value
        return a

    @staticmethod
    def select(c: Any, a: Any, b: Any) -> Any:
        """Return a where c > 0, else b; of an array lane by lane."""
        return (c > 0).choose((b, a)) if getattr(c, "ndim", 0) else a if c > 0 else b

    add = staticmethod(lambda a, b: a + b)
    sub = staticmethod(lambda a, b: a - b)
    mul = staticmethod(lambda a, b: a * b)
    div = staticmethod(lambda a, b: a / b)
    neg = staticmethod(lambda a: -a)
    decide = staticmethod(positive_in_lanes)


class Run:
    """One run of a program over an algebra.

    values: the scalars of each array, by its name.
    guards: what must be positive, each with the status that is reported if it is not.
    """

    def __init__(self, program: ir.Program, algebra: Algebra, arguments: dict[str, list]):
        program = inlined(program)
        self.algebra = algebra
        self.guards: list[tuple[str, Any]] = []
        self.values: dict[str, list] = {a.name: [None] * a.length for a in program.arrays}
        for array in program.of_role("constant"):
            self.values[array.name] = [algebra.const(value) for value in array.values]
        for name, scalars in arguments.items():
            self.values[name] = list(scalars)
        self.body(program.body, {})

    def body(self, body: ir.Body, at: dict[str, int]) -> None:
        """Run statements in order."""
        for statement in body:
            rule = rule_of(self, statement, "runs")
            rule(statement, at)

    # What references mean

    def slots(self, ref: ir.Ref, at: dict[str, int]) -> range:
        """Return the positions of the scalars of a reference."""
        first = ref.offset.at(at)
        return range(first, first + ref.size * ref.stride, ref.stride)

    def places(self, ref: ir.Ref, at: dict[str, int]) -> list[tuple[int, int]]:
        """Return the scalars and lanes of a reference to lanes."""
        if ref.lane is None:
            raise ValueError(f"a reference to scalars of {ref.array.name} means no lanes")
        first, lane = ref.offset.at(at), ref.lane.at(at)
        if ref.stride > 1:
            return [(first + k, lane) for k in range(ref.size)]
        return [(first, lane + k) for k in range(ref.size)]

    def read(self, ref: ir.Ref, at: dict[str, int]) -> list:
        """Return the scalars of a reference."""
        array = self.values[ref.array.name]
        if ref.lane:
            return [self.algebra.lane(array[k], lane) for k, lane in self.places(ref, at)]
        return [array[k] for k in self.slots(ref, at)]

    def write(self, ref: ir.Ref, at: dict[str, int], scalars: Iterable) -> None:
        """Store scalars."""
        array = self.values[ref.array.name]
        if ref.lane:
            for (k, lane), value in zip(self.places(ref, at), scalars, strict=True):
                array[k] = self.algebra.placed(array[k], lane, ref.array.lanes, value)
            return
        for k, value in zip(self.slots(ref, at), scalars, strict=True):
            array[k] = value

    def store(self, ref: ir.Ref, at: dict[str, int], scalars: list, adds: bool) -> None:
        """Store scalars, or add them to what is there."""
        if adds:
            pairs = zip(self.read(ref, at), scalars, strict=True)
            scalars = [self.algebra.add(a, b) for a, b in pairs]
        self.write(ref, at, scalars)

    # Loops and conditions

    def loop(self, loop: ir.Loop, at: dict[str, int]) -> None:
        """Run a loop."""
        span = range(loop.start.at(at), loop.stop.at(at))
        for value in reversed(span) if loop.downward else span:
            self.body(loop.body, at | {loop.var: value})

    def when(self, when: ir.When, at: dict[str, int]) -> None:
        """Run what a condition asks for."""
        condition = self.read(when.scalar, at)[0]
        positive = self.algebra.decide(condition)
        if positive is None:
            self.choose(when, at, condition)
        elif positive:
            self.body(when.body, at)

    def choose(self, when: ir.When, at: dict[str, int], condition: Any) -> None:
        """Run a conditional body, and select new or old values; the algebra cannot decide."""
        before = {name: list(scalars) for name, scalars in self.values.items()}
        guards = len(self.guards)
        self.body(when.body, at)
        if len(self.guards) > guards:
            raise ValueError("a guard under a condition cannot be unrolled")

        # a scalar without an earlier value is not read if the condition fails
        for name, old_scalars in before.items():
            scalars = self.values[name]
            for k, old in enumerate(old_scalars):
                if old is not None and old is not scalars[k]:
                    scalars[k] = self.algebra.select(condition, scalars[k], old)

    # Statements that store

    def apply(self, call: ir.Apply, at: dict[str, int]) -> None:
        """Run a step: read everything, then write everything."""
        scalars = [scalar for ref in call.reads for scalar in self.read(ref, at)]
        results = self.results(call.step, scalars)
        first = 0
        for ref, adds in zip(call.writes, call.adds, strict=True):
            self.store(ref, at, results[first : first + ref.size], adds)
            first += ref.size

    def results(self, step: Step, scalars: list) -> list:
        """Return what a step makes of its inputs."""
        nodes = replay(step.nodes, scalars, self.algebra)
        return [nodes[r] for r in step.results]

    def fill(self, fill: ir.Fill, at: dict[str, int]) -> None:
        """Store constants."""
        self.write(fill.target, at, [self.algebra.const(value) for value in fill.values])

    def unit(self, unit: ir.Unit, at: dict[str, int]) -> None:
        """Store unit vectors."""
        first, lanes = unit.first.at(at), unit.target.lanes
        vectors = [self.algebra.unit(first + k, lanes) for k in range(unit.target.size)]
        self.write(unit.target, at, vectors)

    def copy(self, copy: ir.Copy, at: dict[str, int]) -> None:
        """Copy or add scalars."""
        self.store(copy.target, at, self.read(copy.source, at), copy.adds)

    def guard(self, guard: ir.Guard, at: dict[str, int]) -> None:
        """Record what must be positive."""
        self.guards += [(guard.status, value) for value in self.read(guard.scalar, at)]

    # Linear equations

    def triangle(self, matrix: ir.Array, size: int, first: int = 0) -> list[list]:
        """Return the lower triangle that begins at row ``first`` of a matrix, row by row."""
        scalars, stored = self.values[matrix.name], ir.padded(size)
        starts = [(first + k) * stored for k in range(size)]
        return [scalars[start : start + k + 1] for k, start in enumerate(starts)]

    def store_triangle(self, matrix: ir.Array, rows: list[list], first: int = 0) -> None:
        """Store a lower triangle."""
        stored = ir.padded(len(rows))
        for k, row in enumerate(rows):
            start = (first + k) * stored
            self.values[matrix.name][start : start + k + 1] = row

    def factor(self, factor: ir.Factor, at: dict[str, int]) -> None:
        """Factor a symmetric matrix, or a pair of triangles."""
        starts = (0, factor.size) if factor.pair else (0,)
        given = [self.triangle(factor.matrix, factor.size, first) for first in starts]
        *found, pivots = (pair_factor if factor.pair else ldl_factor)(self.algebra, *given)
        self.guards += [("NOT_POSITIVE_DEFINITE", pivot) for pivot in pivots]
        for rows, first in zip(found, starts, strict=True):
            self.store_triangle(factor.matrix, rows, first)

    def solve(self, solve: ir.Solve, at: dict[str, int]) -> None:
        """Solve with a factored matrix, or with a factored pair."""
        size = solve.x.size
        starts = (0, size if solve.pair else 0)
        lower, upper = (self.triangle(solve.matrix, size, first) for first in starts)
        self.write(solve.x, at, pair_solve(self.algebra, lower, upper, self.read(solve.x, at)))


def unroll(
    program: ir.Program, fixed: dict[str, list] | None = None
) -> tuple[Tape, dict[str, list[int]], list[tuple[str, int]]]:
    """Record a program as one straight line.

    Inputs are numbered array by array in the order of declaration; ``fixed`` arrays are constants.
    Returns the tape, the nodes of every output array, and what must be positive: pairs of status
    and node.
    """
    tape, fixed = Tape(), fixed or {}
    arguments: dict[str, list[int]] = {}
    first = 0
    for array in (*program.of_role("parameters"), *program.of_role("input")):
        if array.name in fixed:
            arguments[array.name] = [tape.const(value) for value in fixed[array.name]]
        else:
            arguments[array.name] = [tape.input(first + k) for k in range(array.length)]
        first += array.length
    run = Run(program, tape, arguments)
    outputs = {array.name: run.values[array.name] for array in program.of_role("output")}
    return tape, outputs, run.guards
