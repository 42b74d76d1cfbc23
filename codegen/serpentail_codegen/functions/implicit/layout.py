"""The layout of the array that factoring hands to solving: its parts by name."""

from collections.abc import Callable
from dataclasses import dataclass

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

    def row(self, at: "Place", axis: int, segment: Index | int) -> Ref:
        """Return how a chain's point moves along an axis with the coordinates of a segment."""
        first, width = self.column(at, 0).offset + axis, at.chain.width
        return self.array.part(first + 3 * width * segment, width, 3)

    def column(self, at: "Place", k: Index | int) -> Ref:
        """Return how a chain's point moves with coordinate k of the chain."""
        first = self.first(f"J_{at.chain.group}")
        return self.array.part(first + 3 * at.chain.nt * at.point + 3 * k, 3)


@dataclass(frozen=True)
class Place:
    """Where a point is that can touch the ground: its chain, the segment, its number there."""

    chain: Tail
    segment: Index
    point: Index

    @property
    def coordinates(self) -> Index:
        """Number of the chain's coordinates that move the point."""
        return self.chain.width * (self.segment + 1)


def each_contact(draft: Draft, respond: Callable[[Index, Place | None], None]) -> None:
    """Call ``respond(number, place)`` for all points; those of feet, torso and prescribed chains
    have no place.
    """
    first, chains = 0, {chain.group: chain for chain in draft.tail.chains}
    for group, count in draft.tail.groups.items():
        if group in chains:
            with draft.on(chains[group]):
                for i, g in each_point(draft):
                    place = None if draft.tail.prescribed else Place(chains[group], i, g)
                    respond(g + first, place)
        else:
            with draft.loop("j", count) as j:
                respond(j + first, None)
        first += count
