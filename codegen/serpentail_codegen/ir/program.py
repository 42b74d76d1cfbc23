"""The content of one emitted function before it is text: loops that apply steps to flat arrays.

A ``Program`` is a list of arrays and a tree of statements; everything here is frozen data.
``interpret.Run`` defines the meaning of the statements.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import get_args

from .algebra import Number
from .step import Step

VECTOR = 8  # lanes of the widest vector


def padded(lanes: int) -> int:
    """Return how many numbers store a given number of lanes: those of whole vectors."""
    return -(-lanes // VECTOR) * VECTOR


@dataclass(frozen=True)
class Index:
    """An affine index: offset + sum of coefficient * loop variable."""

    terms: tuple[tuple[str, int], ...] = ()
    offset: int = 0

    def __add__(self, other: "Index | int") -> "Index":
        other = as_index(other)
        total = dict(self.terms)
        for name, factor in other.terms:
            total[name] = total.get(name, 0) + factor
        return Index(tuple((k, c) for k, c in total.items() if c), self.offset + other.offset)

    __radd__ = __add__

    def __mul__(self, factor: int) -> "Index":
        return Index(tuple((k, c * factor) for k, c in self.terms), self.offset * factor)

    __rmul__ = __mul__

    def at(self, values: dict[str, int]) -> int:
        """Return the value under given loop variables."""
        return self.offset + sum(factor * values[name] for name, factor in self.terms)


def as_index(value: Index | int) -> Index:
    """Return an index from an index or an integer."""
    return value if isinstance(value, Index) else Index((), value)


@dataclass(frozen=True)
class Array:
    """A flat array of ``count`` vectors of ``size`` scalars.

    role: ``input`` and ``output`` are the function's arguments, ``parameters`` the parameter
    struct, ``constant`` has values known at generation, ``local`` lives during one call.
    lanes: each scalar of a wide array holds so many numbers, and ``row`` numbers are stored for
    it; 0 for ordinary scalars.
    """

    name: str
    role: str
    size: int
    count: int = 1
    values: tuple[Number, ...] = ()
    lanes: int = 0

    def __getitem__(self, index: Index | int) -> "Ref":
        return Ref(self, as_index(index) * self.size, self.size)

    def whole(self) -> "Ref":
        """Return all scalars."""
        return Ref(self, as_index(0), self.length)

    def part(self, offset: Index | int, size: int, stride: int = 1) -> "Ref":
        """Return ``size`` scalars from a scalar offset on."""
        return Ref(self, as_index(offset), size, stride)

    def lane(self, scalar: Index | int, first: Index | int, size: int = 1) -> "Ref":
        """Return ``size`` lanes of one wide scalar, from lane ``first`` on."""
        return Ref(self, as_index(scalar), size, 1, as_index(first))

    def down(self, scalar: Index | int, lane: Index | int, size: int) -> "Ref":
        """Return one lane of ``size`` wide scalars."""
        return Ref(self, as_index(scalar), size, self.row, as_index(lane))

    @property
    def length(self) -> int:
        """Number of scalars."""
        return self.size * self.count

    @property
    def row(self) -> int:
        """Numbers stored for one scalar."""
        return padded(self.lanes) or 1


@dataclass(frozen=True)
class Ref:
    """A part of an array: what a statement reads or writes.

    Without ``lane``: ``size`` scalars from an offset on, ``stride`` apart.  With ``lane``: as many
    lanes of the scalar at the offset, from that lane on; or, with the stride of the array's
    ``row``, that lane of ``size`` scalars.
    """

    array: Array
    offset: Index
    size: int
    stride: int = 1
    lane: Index | None = None

    @property
    def lanes(self) -> int:
        """Lanes of each scalar, 0 if they are numbers."""
        return 0 if self.lane else self.array.lanes


@dataclass(frozen=True)
class Apply:
    """Apply a step: read vectors, then write its outputs.

    adds: which outputs are added to what is there, not stored.
    columns: how many lanes of wide vectors are needed, the others being zero or not looked at;
    None for all.
    """

    step: Step
    reads: tuple[Ref, ...]
    writes: tuple[Ref, ...]
    adds: tuple[bool, ...]
    columns: Index | None = None

    @classmethod
    def named(
        cls, step: Step, inputs: Mapping[str, Ref], writes: Iterable[Ref], adds: Iterable[bool] = ()
    ) -> "Apply":
        """Return a step applied to inputs by name; it stores, where ``adds`` is not given."""
        reads, targets = tuple(inputs[name] for name, _ in step.inputs), tuple(writes)
        return cls(step, reads, targets, tuple(adds) or (False,) * len(targets))

    def inputs(self) -> dict[str, Ref]:
        """Return what is read, by the names of the step's inputs."""
        return {name: ref for (name, _), ref in zip(self.step.inputs, self.reads, strict=True)}

    def outputs(self) -> dict[str, Ref]:
        """Return what is written, by the names of the step's outputs."""
        return {name: ref for (name, _), ref in zip(self.step.outputs, self.writes, strict=True)}

    def stored(self) -> list[Ref]:
        """Return what is overwritten, not added to."""
        return [ref for ref, adds in zip(self.writes, self.adds, strict=True) if not adds]


@dataclass(frozen=True)
class Fill:
    """Store constants."""

    target: Ref
    values: tuple[Number, ...]


@dataclass(frozen=True)
class Unit:
    """Store unit vectors: scalar k of a wide target is 1 in lane ``first`` + k and 0 elsewhere."""

    target: Ref
    first: Index


@dataclass(frozen=True)
class Copy:
    """Copy scalars, or add them."""

    target: Ref
    source: Ref
    adds: bool = False


@dataclass(frozen=True)
class Loop:
    """Run the body for ``var`` in [start, stop), upward or downward."""

    var: str
    start: Index
    stop: Index
    downward: bool
    body: "Body"


@dataclass(frozen=True)
class When:
    """Run the body where a scalar is positive."""

    scalar: Ref
    body: "Body"


@dataclass(frozen=True)
class Factor:
    """Factor A = L^T D L in place; A symmetric positive definite, its lower triangle row-major.

    The rows are ``padded(size)`` apart, so that whole vectors of a row can be computed.  As a pair:
    A = U D L, not symmetric but with positive pivots, by its lower triangle and, after it, that of
    its transpose.
    """

    matrix: Array
    size: int
    pair: bool = False


@dataclass(frozen=True)
class Solve:
    """Solve L^T D L x = x, or U D L x = x of a pair of triangles, in place with a factored matrix;
    a wide x is solved for all lanes.
    """

    matrix: Array
    x: Ref
    pair: bool = False


@dataclass(frozen=True)
class Guard:
    """Give up with a status unless all scalars of a vector are positive.

    protects: what is not to be used in that case.
    """

    scalar: Ref
    status: str
    protects: tuple[Ref, ...]


@dataclass(frozen=True)
class Call:
    """Run another program on arrays of this one.

    arguments: the array for each input and output, by its name; parameters are shared.
    """

    program: "Program"
    arguments: tuple[tuple[str, Array], ...]


Body = tuple["Statement", ...]
Statement = Apply | Fill | Unit | Copy | Loop | When | Factor | Solve | Guard | Call
STATEMENTS: tuple[type, ...] = get_args(Statement)


@dataclass(frozen=True)
class Program:
    """One function: its arrays and its loop nest."""

    name: str
    doc: str
    arrays: tuple[Array, ...]
    body: "Body"

    def of_role(self, role: str) -> tuple[Array, ...]:
        """Return the arrays of a role, in the order in which they were declared."""
        return tuple(a for a in self.arrays if a.role == role)


def statements(
    body: Body,
) -> Iterator[tuple[Statement, tuple[Loop | When, ...]]]:
    """Yield every innermost statement with the loops and conditions around it, outermost first."""
    for statement in body:
        if isinstance(statement, Loop | When):
            for inner, around in statements(statement.body):
                yield inner, (statement, *around)
        else:
            yield statement, ()
