"""The meaning of a program: arrays and an algebra go in, the program runs statement by statement.

With numbers as the algebra this is the reference for every emitted text; with a tape it unrolls the
loops.
"""

import math

from .dataflow import inlined
from .ldl import ldl_factor, ldl_solve, pair_factor, pair_solve
from .program import (
    Apply,
    Array,
    Copy,
    Factor,
    FactorPair,
    Fill,
    Guard,
    Loop,
    Program,
    Ref,
    Solve,
    SolvePair,
    Unit,
    When,
    padded,
    statements,
)
from .step import Step
from .tape import Tape, replay


class Numbers:
    """The algebra of numbers that ``functions`` knows sin, cos and sqrt of; ``convert`` rounds an
    exact constant.
    """

    def __init__(self, functions=math, convert=float):
        self.sin, self.cos, self.sqrt, self.convert = (
            functions.sin,
            functions.cos,
            functions.sqrt,
            convert,
        )

    def const(self, value):
        """Return an exact constant as a number; what cannot take a fraction divides it."""
        try:
            return self.convert(value)
        except TypeError:
            return self.convert(value.numerator) / self.convert(value.denominator)

    def unit(self, lane: int, lanes: int):
        """Return a unit row."""
        import numpy as np  # the generator's own algebras have no use for it

        return np.array([self.const(int(k == lane)) for k in range(lanes)])

    @staticmethod
    def lane(row, lane: int):
        """Return one lane of a row; a number is the same in all."""
        return row[lane] if getattr(row, "ndim", 0) else row

    def placed(self, row, lane: int, lanes: int, value):
        """Return a row with one lane replaced; a number is the same in all."""
        import numpy as np  # as in ``unit``

        row = np.array(row) if getattr(row, "ndim", 0) else np.array([row] * lanes)
        row[lane] = value
        return row

    add = staticmethod(lambda a, b: a + b)
    sub = staticmethod(lambda a, b: a - b)
    mul = staticmethod(lambda a, b: a * b)
    div = staticmethod(lambda a, b: a / b)
    neg = staticmethod(lambda a: -a)
    select = staticmethod(lambda c, a, b: a if c > 0 else b)
    decide = staticmethod(lambda c: c > 0)


class Counter:
    """The algebra that counts operations; its values are the numbers of lanes, 0 for a narrow
    scalar.
    """

    def __init__(self):
        self.count = 0

    def _binary(self, a: int, b: int) -> int:
        self.count += max(a, b, 1)
        return max(a, b)

    def _same(self, a: int) -> int:
        return a

    add = sub = mul = div = _binary
    neg = sin = cos = sqrt = _same
    select = staticmethod(max)
    decide = staticmethod(lambda c: True)  # the dearer case
    const = staticmethod(lambda value: 0)
    lane = staticmethod(lambda row, lane: 0)
    unit = staticmethod(lambda lane, lanes: lanes)
    placed = staticmethod(lambda row, lane, lanes, value: lanes)


def executed(program: Program) -> int:
    """Return the additions, multiplications and divisions of one run."""
    arguments = (*program.of_role("parameters"), *program.of_role("input"))
    return Count(program, {a.name: [0] * a.length for a in arguments}).algebra.count


def applied(program: Program) -> int:
    """Return how many nodes of steps one run evaluates, each row once: what unrolling has to write
    out or fold.
    """
    return _applied(inlined(program).body, {})


def _applied(body: tuple, at: dict[str, int]) -> int:
    count = 0
    for statement in body:
        if isinstance(statement, Loop):
            span = range(statement.start.at(at), statement.stop.at(at))
            count += sum(_applied(statement.body, at | {statement.var: value}) for value in span)
        elif isinstance(statement, When):
            count += _applied(statement.body, at)
        elif isinstance(statement, Apply):
            count += len(statement.step.nodes)
    return count


def branches(program: Program) -> bool:
    """Tell if some statements of a program are run only under a condition."""
    return any(
        isinstance(outer, When)
        for _, around in statements(inlined(program).body)
        for outer in around
    )


class Run:
    """One run of a program over an algebra: ``values`` are arrays by name, ``guards`` what must be
    positive.
    """

    def __init__(self, program: Program, algebra, arguments: dict[str, list]):
        program, self.algebra, self.guards = inlined(program), algebra, []
        self.values = {a.name: [None] * a.length for a in program.arrays}
        self.values |= {
            a.name: [algebra.const(v) for v in a.values] for a in program.of_role("constant")
        }
        self.values |= {name: list(scalars) for name, scalars in arguments.items()}
        self.body(program.body, {})

    def slots(self, ref: Ref, at: dict[str, int]) -> range:
        """Return the positions that a reference means."""
        first = ref.offset.at(at)
        return range(first, first + ref.size * ref.stride, ref.stride)

    def read(self, ref: Ref, at: dict[str, int]) -> list:
        """Return the scalars of a reference."""
        array = self.values[ref.array.name]
        if ref.lane:
            return [self.algebra.lane(array[k], lane) for k, lane in self.places(ref, at)]
        return [array[k] for k in self.slots(ref, at)]

    def places(self, ref: Ref, at: dict[str, int]) -> list[tuple[int, int]]:
        """Return the scalars and lanes that a reference to lanes means."""
        first, lane = ref.offset.at(at), ref.lane.at(at)
        return [(first + k, lane) if ref.stride > 1 else (first, lane + k) for k in range(ref.size)]

    def write(self, ref: Ref, at: dict[str, int], scalars) -> None:
        """Store scalars."""
        array = self.values[ref.array.name]
        if ref.lane:
            for (k, lane), value in zip(self.places(ref, at), scalars, strict=True):
                array[k] = self.algebra.placed(array[k], lane, ref.array.lanes, value)
            return
        for k, value in zip(self.slots(ref, at), scalars, strict=True):
            array[k] = value

    def body(self, body, at: dict[str, int]) -> None:
        """Run statements in order."""
        for statement in body:
            getattr(self, type(statement).__name__.lower())(statement, at)

    def loop(self, loop: Loop, at: dict[str, int]) -> None:
        """Run a loop."""
        span = range(loop.start.at(at), loop.stop.at(at))
        for value in reversed(span) if loop.downward else span:
            self.body(loop.body, at | {loop.var: value})

    def when(self, when: When, at: dict[str, int]) -> None:
        """Run what a condition asks for; where the algebra cannot tell, choose between new and old
        values.
        """
        condition = self.read(when.scalar, at)[0]
        known = self.algebra.decide(condition)
        if known is not None:
            self.body(when.body if known else (), at)
            return
        before, guards = (
            {name: list(scalars) for name, scalars in self.values.items()},
            len(self.guards),
        )
        self.body(when.body, at)
        if len(self.guards) > guards:
            raise ValueError("a guard under a condition cannot be unrolled")
        for name, old in before.items():
            pairs = zip(self.values[name], old, strict=True)
            self.values[name] = [
                a if a == b or b is None else self.algebra.select(condition, a, b) for a, b in pairs
            ]

    def apply(self, call: Apply, at: dict[str, int]) -> None:
        """Run a step: read everything, then write everything."""
        scalars = [scalar for ref in call.reads for scalar in self.read(ref, at)]
        results = iter(self.results(call.step, scalars))
        for ref, adds in zip(call.writes, call.adds, strict=True):
            values = [next(results) for _ in range(ref.size)]
            if adds:
                values = [
                    self.algebra.add(a, b) for a, b in zip(self.read(ref, at), values, strict=True)
                ]
            self.write(ref, at, values)

    def results(self, step: Step, scalars: list) -> list:
        """Return what a step makes of its inputs."""
        nodes = replay(step.nodes, scalars, self.algebra)
        return [nodes[r] for r in step.results]

    def fill(self, fill: Fill, at: dict[str, int]) -> None:
        """Store constants."""
        self.write(fill.target, at, [self.algebra.const(v) for v in fill.values])

    def unit(self, unit: Unit, at: dict[str, int]) -> None:
        """Store unit rows."""
        first, lanes = unit.first.at(at), unit.target.lanes
        self.write(
            unit.target, at, [self.algebra.unit(first + k, lanes) for k in range(unit.target.size)]
        )

    def copy(self, copy: Copy, at: dict[str, int]) -> None:
        """Copy or add scalars."""
        values = self.read(copy.source, at)
        if copy.adds:
            values = [
                self.algebra.add(a, b)
                for a, b in zip(self.read(copy.target, at), values, strict=True)
            ]
        self.write(copy.target, at, values)

    def guard(self, guard: Guard, at: dict[str, int]) -> None:
        """Note what must be positive."""
        self.guards += [(guard.status, value) for value in self.read(guard.scalar, at)]

    def rows(self, matrix: Array, size: int, first: int = 0) -> list[list]:
        """Return the lower triangle of a matrix that begins at row ``first``, row by row."""
        flat, row = self.values[matrix.name], padded(size)
        return [flat[(first + k) * row : (first + k) * row + k + 1] for k in range(size)]

    def write_rows(self, matrix: Array, rows: list[list], first: int = 0) -> None:
        """Store a lower triangle."""
        for k, row in enumerate(rows):
            start = (first + k) * padded(len(rows))
            self.values[matrix.name][start : start + k + 1] = row

    def factor(self, factor: Factor, at: dict[str, int]) -> None:
        """Factor a symmetric matrix."""
        rows, pivots = ldl_factor(self.algebra, self.rows(factor.matrix, factor.size))
        self.guards += [("NOT_POSITIVE_DEFINITE", pivot) for pivot in pivots]
        self.write_rows(factor.matrix, rows)

    def factorpair(self, factor: FactorPair, at: dict[str, int]) -> None:
        """Factor a pair of triangles."""
        size = factor.size
        *pair, pivots = pair_factor(
            self.algebra, *(self.rows(factor.matrix, size, first) for first in (0, size))
        )
        self.guards += [("NOT_POSITIVE_DEFINITE", pivot) for pivot in pivots]
        for first, rows in zip((0, size), pair, strict=True):
            self.write_rows(factor.matrix, rows, first)

    def solvepair(self, solve: SolvePair, at: dict[str, int]) -> None:
        """Solve with a factored pair."""
        pair = (self.rows(solve.matrix, solve.x.size, first) for first in (0, solve.x.size))
        self.write(solve.x, at, pair_solve(self.algebra, *pair, self.read(solve.x, at)))

    def solve(self, solve: Solve, at: dict[str, int]) -> None:
        """Solve with a factored matrix."""
        rows = self.rows(solve.matrix, solve.x.size)
        self.write(solve.x, at, ldl_solve(self.algebra, rows, self.read(solve.x, at)))


class Count(Run):
    """A run that counts operations; a step costs the same for inputs of the same lanes."""

    def __init__(self, program: Program, arguments: dict[str, list]):
        self.known: dict[tuple, tuple[int, list]] = {}
        super().__init__(program, Counter(), arguments)

    def results(self, step: Step, scalars: list) -> list:
        """Return the lanes of a step's results, and count its operations."""
        before, key = self.algebra.count, (id(step), *scalars)
        if key not in self.known:
            lanes = super().results(step, scalars)
            self.known[key] = self.algebra.count - before, lanes
        cost, lanes = self.known[key]
        self.algebra.count = before + cost
        return lanes


def unroll(
    program: Program, fixed: dict[str, list] | None = None
) -> tuple[Tape, dict, list[tuple[str, int]]]:
    """Record a program as one straight line.

    Inputs are numbered array by array in the order of declaration; ``fixed`` arrays are constants.
    Returns the tape, the nodes of every output array, and what must be positive: pairs of status
    and node.
    """
    tape, arguments, first = Tape(), {}, 0
    for array in (*program.of_role("parameters"), *program.of_role("input")):
        if fixed and array.name in fixed:
            arguments[array.name] = [tape.const(v) for v in fixed[array.name]]
        else:
            arguments[array.name] = [tape.input(first + k) for k in range(array.length)]
        first += array.length
    run = Run(program, tape, arguments)
    return tape, {a.name: run.values[a.name] for a in program.of_role("output")}, run.guards
