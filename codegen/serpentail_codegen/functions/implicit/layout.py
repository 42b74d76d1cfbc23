"""Implicit integrators' linear systems: a draft goes in, factoring and solving with 1 - w J are
added to it.

J is the Jacobian of the rates of (q in its tangent space, v, bristles), of contact, joint damping
and tracking gains alone.  With k_q = r_q + w k_v and the bristles eliminated, S (k_v - r_v) =
forces is left, S = H + stiffness, symmetric and positive definite but for points that slide: there
friction follows the load, and S takes two triangles. Eliminating translation is what the first
three pivots of S do.
"""

from dataclasses import dataclass

from ...ir.program import Array, Index, Ref
from ..draft import Draft
from ..tail import Tail


@dataclass(frozen=True)
class Factors:
    """The argument ``factors``: its parts by their names."""

    array: Array
    tail: Tail

    def first(self, name: str) -> int:
        """Where a part begins."""
        names = list(self.tail.factor_blocks)
        return sum(
            size * count
            for size, count in list(self.tail.factor_blocks.values())[: names.index(name)]
        )

    def __call__(self, name: str, k: Index | int = 0) -> Ref:
        """Entry k of a part."""
        size = self.tail.factor_blocks[name][0]
        return self.array.part(self.first(name) + size * k, size)

    def entry(self, name: str, row: Index | int, column: Index | int, size: int = 1) -> Ref:
        """Numbers of a matrix."""
        return self.array.part(
            self.first(name) + self.tail.factor_blocks[name][0] * row + column, size
        )

    def row(self, point: Index | int, axis: int, segment: Index | int) -> Ref:
        """How a tail point moves along an axis with the two coordinates of a segment."""
        return self.array.part(
            self.first("J") + 3 * self.tail.nt * point + axis + 6 * segment, 2, 3
        )

    def column(self, point: Index | int, k: Index | int) -> Ref:
        """How a tail point moves with tail coordinate k."""
        return self.array.part(self.first("J") + 3 * self.tail.nt * point + 3 * k, 3)


def first_tail_point(tail: Tail) -> int:
    """Number of the tail's first point."""
    return tail.groups.get("feet", 0)


def each_contact(d: Draft, f: Factors, respond) -> None:
    """Call ``respond(number, segment)`` for all points, tail points with their segment."""
    first = 0
    for group, count in d.tail.groups.items():
        if group == "tail":
            with d.loop("i", d.tail.segments) as i, d.loop("j", d.tail.links) as j:
                respond(d.tail.links * i + j + first, i)
        else:
            with d.loop("j", count) as j:
                respond(j + first, None)
        first += count
