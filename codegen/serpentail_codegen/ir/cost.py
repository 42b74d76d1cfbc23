"""Counts the work of a program; the count decides the form in which it is emitted."""

from .dataflow import inlined
from .interpret import Run
from .program import Apply, Body, Loop, Program, When, statements
from .step import Step


class Counter:
    """The algebra that counts operations; a value is its number of lanes, 0 for a narrow scalar."""

    def __init__(self) -> None:
        self.count = 0

    def _binary(self, a: int, b: int) -> int:
        self.count += max(a, b, 1)
        return max(a, b)

    def _unary(self, a: int) -> int:
        return a

    add = sub = mul = div = _binary
    neg = sin = cos = sqrt = _unary
    select = staticmethod(max)
    decide = staticmethod(lambda c: True)  # the more expensive case
    const = staticmethod(lambda value: 0)
    lane = staticmethod(lambda a, lane: 0)
    unit = staticmethod(lambda lane, lanes: lanes)
    placed = staticmethod(lambda a, lane, lanes, value: lanes)


class CountingRun(Run):
    """A run that counts operations; a step costs the same for inputs of the same lanes."""

    def __init__(self, program: Program, arguments: dict[str, list]):
        self.counter = Counter()
        self.costs: dict[tuple, tuple[int, list]] = {}
        super().__init__(program, self.counter, arguments)

    def results(self, step: Step, scalars: list) -> list:
        """Return the lanes of a step's results, and count its operations."""
        before, key = self.counter.count, (id(step), *scalars)
        if key not in self.costs:
            lanes = super().results(step, scalars)
            self.costs[key] = self.counter.count - before, lanes
        cost, lanes = self.costs[key]
        self.counter.count = before + cost
        return lanes


def executed(program: Program) -> int:
    """Return the additions, multiplications and divisions of one run."""
    arguments = (*program.of_role("parameters"), *program.of_role("input"))
    run = CountingRun(program, {a.name: [0] * a.length for a in arguments})
    return run.counter.count


def applied(program: Program) -> int:
    """Return how many nodes of steps one run evaluates, all of which unrolling must print or
    fold.
    """
    return _applied(inlined(program).body, {})


def _applied(body: Body, at: dict[str, int]) -> int:
    count = 0
    for statement in body:
        if isinstance(statement, Loop):
            for value in range(statement.start.at(at), statement.stop.at(at)):
                count += _applied(statement.body, at | {statement.var: value})
        elif isinstance(statement, When):
            count += _applied(statement.body, at)
        elif isinstance(statement, Apply):
            count += len(statement.step.nodes)
    return count


def branches(program: Program) -> bool:
    """Tell if some statements of a program are run only under a condition."""
    for _, around in statements(inlined(program).body):
        if any(isinstance(outer, When) for outer in around):
            return True
    return False
