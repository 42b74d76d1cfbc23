"""Writing programs: a builder with a method for each statement, and checks of names and sizes."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache

from . import program as ir
from .algebra import Number
from .step import Step, compacted, spans


@dataclass
class Builder:
    """Records a program: declare arrays, open loops, apply steps.

    ``_bodies`` are the statements of the loops that are open, the innermost last.
    """

    name: str
    doc: str
    arrays: list[ir.Array] = field(default_factory=list)
    _bodies: list[list[ir.Statement]] = field(default_factory=lambda: [[]])
    _columns: ir.Index | None = None

    def declare(self, array: ir.Array) -> ir.Array:
        """Declare an array; local names are unique within a program."""
        if any(a.name == array.name for a in self.arrays):
            raise ValueError(f"array {array.name} is declared twice in {self.name}")
        self.arrays.append(array)
        return array

    def array(self, name: str, size: int, count: int = 1, role: str = "local") -> ir.Array:
        """Declare an array of scalars."""
        return self.declare(ir.Array(name, role, size, count))

    def wide(self, name: str, size: int, lanes: int) -> ir.Array:
        """Declare a local array whose scalars have so many lanes; narrow ones where they are 0."""
        return self.declare(ir.Array(name, "local", size, lanes=lanes))

    def constant(self, name: str, values: Iterable[Number]) -> ir.Array:
        """Declare an array whose values are known at generation."""
        numbers = tuple(values)
        return self.declare(ir.Array(name, "constant", len(numbers), values=numbers))

    def emit(self, statement: ir.Statement) -> None:
        """Append a statement to the innermost open loop."""
        self._bodies[-1].append(statement)

    def apply(self, step: Step, reads: dict[str, ir.Ref], **writes: ir.Ref) -> None:
        """Apply a step to named vectors; outputs that are not named are dropped.

        A trailing underscore of an output's name adds to the target instead of storing.
        """
        targets = {name.removesuffix("_"): (ref, name[-1] == "_") for name, ref in writes.items()}
        step = narrowed(step, set(targets))
        outputs = [targets[name] for name, _ in step.outputs]
        call = ir.Apply.named(
            step, reads, [ref for ref, _ in outputs], [adds for _, adds in outputs]
        )
        if any(ref.lanes for ref in call.writes):
            call = replace(call, columns=self._columns)

        vectors = (*step.inputs, *step.outputs)
        for (name, size), ref in zip(vectors, call.reads + call.writes, strict=True):
            if ref.size != size:
                raise ValueError(
                    f"{step.name} in {self.name}: {name} has {size} scalars, not {ref.size}"
                )
        self.emit(call)

    def fill(self, target: ir.Ref, *values: Number) -> None:
        """Store constants; one value is repeated."""
        self.emit(ir.Fill(target, values * target.size if len(values) == 1 else values))

    def copy(self, target: ir.Ref, source: ir.Ref, adds: bool = False) -> None:
        """Copy scalars, or add them."""
        if target.size != source.size:
            raise ValueError(
                f"{self.name}: {source.size} scalars of {source.array.name} do not fit "
                f"{target.array.name}"
            )
        self.emit(ir.Copy(target, source, adds))

    def unit(self, target: ir.Ref, first: ir.Index | int) -> None:
        """Store unit vectors, the first of them 1 in lane ``first``."""
        self.emit(ir.Unit(target, ir.as_index(first)))

    def factor(self, matrix: ir.Array, size: int, pair: bool = False) -> None:
        """Factor a matrix, or a pair of triangles, in place."""
        self.emit(ir.Factor(matrix, size, pair))

    def solve(self, matrix: ir.Array, x: ir.Ref, pair: bool = False) -> None:
        """Solve in place with a factored matrix, or with a factored pair of triangles."""
        self.emit(ir.Solve(matrix, x, pair))

    def guard(self, scalar: ir.Ref, status: str, *protects: ir.Ref) -> None:
        """Give up with a status unless all scalars of a vector are positive."""
        self.emit(ir.Guard(scalar, status, protects))

    def call(self, program: ir.Program, **arguments: ir.Array) -> None:
        """Run another program on arrays of this one."""
        for array in program.of_role("input") + program.of_role("output"):
            if array.name not in arguments:
                raise ValueError(
                    f"{program.name} in {self.name}: {array.role} {array.name} is not bound"
                )
        self.emit(ir.Call(program, tuple(arguments.items())))

    @contextmanager
    def loop(
        self, var: str, count: ir.Index | int, downward: bool = False, start: ir.Index | int = 0
    ) -> Iterator[ir.Index]:
        """Open a loop from ``start`` to ``count``; yields its variable as an index."""
        self._bodies.append([])
        yield ir.Index(((var, 1),))
        body = tuple(self._bodies.pop())
        if ir.as_index(start) != ir.as_index(count) and body:
            self.emit(ir.Loop(var, ir.as_index(start), ir.as_index(count), downward, body))

    @contextmanager
    def first_lanes(self, count: ir.Index) -> Iterator[None]:
        """Apply steps to so many lanes of what is wide; the others are zero, or nobody reads
        them.
        """
        self._columns, before = count, self._columns
        yield
        self._columns = before

    @contextmanager
    def when(self, scalar: ir.Ref) -> Iterator[None]:
        """Open what is run only where a scalar is positive; the body must not change it."""
        self._bodies.append([])
        yield
        self.emit(ir.When(scalar, tuple(self._bodies.pop())))

    def finish(self) -> ir.Program:
        """Return the recorded program."""
        return ir.Program(self.name, self.doc, tuple(self.arrays), tuple(self._bodies[0]))


@cache
def _narrowed(step: Step, wanted: frozenset[str]) -> Step:
    # the outputs that are wanted, and their part of the results
    kept = {name: span for name, span in spans(step.outputs).items() if name in wanted}
    outputs = tuple((name, len(span)) for name, span in kept.items())
    results = tuple(step.results[k] for span in kept.values() for k in span)

    # a step that lost outputs is named by those that it still has
    name = step.name
    if len(outputs) < len(step.outputs):
        name = "_".join([name, *kept])
    return compacted(replace(step, name=name, outputs=outputs, results=results))


def narrowed(step: Step, wanted: set[str]) -> Step:
    """Return the step with only the wanted outputs and what they need."""
    unknown = wanted - {name for name, _ in step.outputs}
    if unknown:
        raise ValueError(f"{step.name} has no output {sorted(unknown)}")
    return _narrowed(step, frozenset(wanted))
