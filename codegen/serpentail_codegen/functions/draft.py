"""Drafts: a tail's sizes go in; a builder comes out that finds the vectors its steps read by their
names.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from ..ir.builder import Builder
from ..ir.program import Array, Index, Ref
from ..mechanics.lower import derive
from .tail import Tail


@dataclass
class Draft(Builder):
    """A function being assembled: the builder, the tail's sizes, and the vectors that steps find by
    name.

    ``pieces`` are arrays with one entry a segment that describe its rigid links or its arc,
    ``samples`` those that describe what lies between two tail points.  ``at_rest``: nothing moves,
    there are accelerations only. ``dynamics`` of an articulated tail: "composite", H column by
    column; "lanes", its columns are lanes; "segments", v_dot comes about without H where nothing
    else is asked for.
    """

    tail: Tail | None = None
    at_rest: bool = False
    dynamics: str = "composite"
    known: dict[str, Ref] = field(default_factory=dict)
    pieces: dict[str, Array] = field(default_factory=dict)
    samples: dict[str, Array] = field(default_factory=dict)

    def step(self, function: Callable, reads: dict[str, Ref] | None = None, **writes: Ref) -> None:
        """Apply the step derived from a kinematics or dynamics function."""
        self.apply(derive(function), self.known | (reads or {}), **writes)

    def vector(self, name: str, size: int) -> Ref:
        """Declare a local vector that steps find by its name."""
        self.known[name] = self.array(name, size)[0]
        return self.known[name]

    def zero(self, size: int) -> Ref:
        """Return zeros."""
        name = f"zero_{size}"
        if name not in self.known:
            self.known[name] = self.constant(name, [0] * size)[0]
        return self.known[name]

    def store(self, function: Callable, **sizes: int) -> None:
        """Apply a step, keeping its outputs in new local vectors of the same names."""
        self.step(function, **{name: self.vector(name, size) for name, size in sizes.items()})

    def angles(self, i: Index) -> Ref:
        """Coordinates of segment i."""
        return self.known["q"].array.part(7 + 2 * i, 2)

    def rates(self, i: Index) -> Ref:
        """Rates of the coordinates of segment i."""
        return self.zero(2) if self.at_rest else self.known["v"].array.part(6 + 2 * i, 2)

    def piece(self, i: Index) -> dict[str, Ref]:
        """What describes the links or the arc of segment i."""
        return {name: array[i] for name, array in self.pieces.items()} | {"angles": self.angles(i)}

    def sample(self, i: Index) -> dict[str, Ref]:
        """What describes segment i between two tail points."""
        return {name: array[i] for name, array in self.samples.items()}
