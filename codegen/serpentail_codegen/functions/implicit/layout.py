"""The layout of the array that factoring hands to solving: its parts by name."""

from collections.abc import Callable
from dataclasses import dataclass

from serpentail_scene.layout import PER_SEGMENT

from ...ir.program import Array, Index, Ref
from ..draft import Draft
from ..sweeps.pieces import each_point
from ..tail import Tail


@dataclass(frozen=True)
class Factors:
    """The argument ``factors``: its parts by their names."""

    array: Array
    tail: Tail

    def first(self, name: str) -> int:
        """Return the position of a part."""
        parts = self.tail.factor_blocks
        before = list(parts)[: list(parts).index(name)]
        return sum(size * count for size, count in map(parts.__getitem__, before))

    def __call__(self, name: str, k: Index | int = 0) -> Ref:
        """Entry k of a part."""
        size = self.tail.factor_blocks[name][0]
        return self.array.part(self.first(name) + size * k, size)

    def entry(self, name: str, row: Index | int, column: Index | int, size: int = 1) -> Ref:
        """Return the position of a matrix entry."""
        return self.array.part(
            self.first(name) + self.tail.factor_blocks[name][0] * row + column, size
        )

    def tail_entry(self, k: Index, other: Index) -> Ref:
        """Return the entry of S for two tail coordinates."""
        first = self.tail.torso_nv
        return self.entry("S", first + k, first + other)

    def row(self, point: Index | int, axis: int, segment: Index | int) -> Ref:
        """Return how a tail point moves along an axis with the two coordinates of a segment."""
        first = self.first("J") + 3 * self.tail.nt * point + axis
        return self.array.part(first + 3 * PER_SEGMENT * segment, PER_SEGMENT, 3)

    def column(self, point: Index | int, k: Index | int) -> Ref:
        """Return how a tail point moves with tail coordinate k."""
        return self.array.part(self.first("J") + 3 * self.tail.nt * point + 3 * k, 3)


def first_tail_point(tail: Tail) -> int:
    """Number of the tail's first point."""
    return tail.groups.get("feet", 0)


def each_contact(draft: Draft, respond: Callable[[Index, Index | None], None]) -> None:
    """Call ``respond(number, segment)`` for all points; tail points are given with their
    segment.
    """
    first, tail = 0, draft.tail
    for group, count in tail.groups.items():
        if group == "tail":
            for i, g in each_point(draft):
                respond(g + first, i)
        else:
            with draft.loop("j", count) as j:
                respond(j + first, None)
        first += count
