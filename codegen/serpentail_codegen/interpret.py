"""The meaning of a program: arrays and an algebra go in, the program runs statement by statement.

With numbers as the algebra this is the reference for every emitted text; with a tape it unrolls the loops.
"""

import math

from .program import Apply, Copy, Fill, Guard, Loop, Program, Ref, Solve
from .tape import Tape, replay


class Numbers:
    """The algebra of numbers that ``functions`` knows sin, cos and sqrt of; ``convert`` rounds an exact constant."""

    def __init__(self, functions=math, convert=float):
        self.sin, self.cos, self.sqrt, self.convert = functions.sin, functions.cos, functions.sqrt, convert

    def const(self, value):
        """Return an exact constant as a number; what cannot take a fraction divides it."""
        try:
            return self.convert(value)
        except TypeError:
            return self.convert(value.numerator) / self.convert(value.denominator)

    add = staticmethod(lambda a, b: a + b)
    sub = staticmethod(lambda a, b: a - b)
    mul = staticmethod(lambda a, b: a * b)
    div = staticmethod(lambda a, b: a / b)
    neg = staticmethod(lambda a: -a)


class Counter:
    """The algebra that counts operations; its only value is None."""

    def __init__(self):
        self.count = 0

    def _one(self, *_):
        self.count += 1

    def _none(self, *_):
        pass

    add = sub = mul = div = _one
    const = neg = sin = cos = sqrt = _none


def executed(program: Program) -> int:
    """Return the additions, multiplications and divisions of one run."""
    counter = Counter()
    arguments = (*program.of_role("parameters"), *program.of_role("input"))
    Run(program, counter, {a.name: [None] * a.length for a in arguments})
    return counter.count


def ldl_solve(algebra, A: list[list], b: list) -> tuple[list, list]:
    """Solve A x = b by LDL^T without pivoting; ``A`` holds the lower triangle.  Returns x and the pivots."""
    size, A, b = len(b), [list(row) for row in A], list(b)
    sub, mul = algebra.sub, algebra.mul
    pivots, inverses = [], []
    for k in range(size):
        pivots.append(A[k][k])
        inverses.append(algebra.div(algebra.const(1), A[k][k]))
        for i in range(k + 1, size):
            column = A[i][k]
            factor = mul(column, inverses[k])
            b[i] = sub(b[i], mul(factor, b[k]))
            for j in range(k + 1, i):
                A[i][j] = sub(A[i][j], mul(A[j][k], column))
            A[i][i] = sub(A[i][i], mul(factor, column))
            A[i][k] = factor
    b = [mul(value, inverse) for value, inverse in zip(b, inverses, strict=True)]
    for k in range(size - 1, -1, -1):
        for i in range(k):
            b[i] = sub(b[i], mul(A[k][i], b[k]))
    return b, pivots


class Run:
    """One run of a program over an algebra: ``values`` are arrays by name, ``guards`` what must be positive."""

    def __init__(self, program: Program, algebra, arguments: dict[str, list]):
        self.algebra, self.guards = algebra, []
        self.values = {a.name: [None] * a.length for a in program.arrays}
        self.values |= {a.name: [algebra.const(v) for v in a.values] for a in program.of_role("constant")}
        self.values |= {name: list(scalars) for name, scalars in arguments.items()}
        self.body(program.body, {})

    def slots(self, ref: Ref, at: dict[str, int]) -> range:
        """Return the positions that a reference means."""
        first = ref.offset.at(at)
        return range(first, first + ref.size * ref.stride, ref.stride)

    def read(self, ref: Ref, at: dict[str, int]) -> list:
        """Return the scalars of a reference."""
        array = self.values[ref.array.name]
        return [array[k] for k in self.slots(ref, at)]

    def write(self, ref: Ref, at: dict[str, int], scalars) -> None:
        """Store scalars."""
        array = self.values[ref.array.name]
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

    def apply(self, call: Apply, at: dict[str, int]) -> None:
        """Run a step: read everything, then write everything."""
        scalars = [scalar for ref in call.reads for scalar in self.read(ref, at)]
        nodes = replay(call.step.nodes, scalars, self.algebra)
        results = iter([nodes[r] for r in call.step.results])
        for ref, adds in zip(call.writes, call.adds, strict=True):
            values = [next(results) for _ in range(ref.size)]
            if adds:
                values = [self.algebra.add(a, b) for a, b in zip(self.read(ref, at), values, strict=True)]
            self.write(ref, at, values)

    def fill(self, fill: Fill, at: dict[str, int]) -> None:
        """Store constants."""
        self.write(fill.target, at, [self.algebra.const(v) for v in fill.values])

    def copy(self, copy: Copy, at: dict[str, int]) -> None:
        """Copy scalars."""
        self.write(copy.target, at, self.read(copy.source, at))

    def guard(self, guard: Guard, at: dict[str, int]) -> None:
        """Note what must be positive."""
        self.guards.append((guard.status, self.read(guard.scalar, at)[0]))

    def solve(self, solve: Solve, at: dict[str, int]) -> None:
        """Solve a symmetric system."""
        size = solve.x.size
        flat = self.values[solve.matrix.name]
        rows = [flat[k * size : k * size + k + 1] for k in range(size)]
        x, pivots = ldl_solve(self.algebra, rows, self.read(solve.x, at))
        self.guards += [("NOT_POSITIVE_DEFINITE", pivot) for pivot in pivots]
        self.write(solve.x, at, x)


def unroll(program: Program, fixed: dict[str, list] | None = None) -> tuple[Tape, dict, list[tuple[str, int]]]:
    """Record a program as one straight line.

    Inputs are numbered array by array in the order of declaration; ``fixed`` arrays are constants.  Returns the tape,
    the nodes of every output array, and what must be positive: pairs of status and node.
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
