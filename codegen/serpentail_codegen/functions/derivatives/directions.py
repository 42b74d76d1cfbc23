"""Directions of differentiation: a tail's sizes go in; which lane stands for which, and where its
results belong.

Derivatives with respect to q are in the tangent space: position of B, a turn of the torso in body
axes, tail coordinates; the columns of such a matrix are those of a velocity v.
"""

from dataclasses import dataclass

from ...ir.program import Array, Index, Loop
from ...mechanics import rotations
from ..draft import Draft
from ..tail import Tail

# directions of the torso: first column in the tangent of q or v, and whether it is q
TORSO = {"turn": (3, True), "p_dot": (0, False), "omega": (3, False)}


@dataclass(frozen=True)
class Directions:
    """Which lane stands for which direction: some of the torso, then coordinates and rates of
    segment after segment.
    """

    tail: Tail
    torso: tuple[str, ...]
    rates: bool = True

    @property
    def base(self) -> int:
        """Lanes of the torso."""
        return 3 * len(self.torso)

    @property
    def each(self) -> int:
        """Lanes of one segment."""
        return 4 if self.rates else 2

    @property
    def count(self) -> int:
        """All lanes."""
        return self.base + self.each * self.tail.segments

    def outward(self, loops: tuple[Loop, ...]) -> Index | None:
        """Where a sweep goes from the torso to the tip, segment i depends on the segments up to i
        alone.
        """
        return None if any(loop.downward for loop in loops) else self.up_to(loops)

    def up_to(self, loops: tuple[Loop, ...]) -> Index | None:
        """Lanes of the torso and the segments up to i, within a loop over segments."""
        within = any(loop.var == "i" for loop in loops)
        return self.each * Index((("i", 1),)) + (self.base + self.each) if within else None

    def of_q(self, i: Index) -> Index:
        """First lane of the coordinates of segment i."""
        return self.each * i + self.base

    def of_v(self, i: Index) -> Index:
        """First lane of the rates of segment i."""
        return self.each * i + (self.base + 2)

    def tangents(self, d: Draft) -> dict[str, Array]:
        """Declare ``d_q`` and ``d_v`` and store the directions in them as rows; the quaternion
        known is a unit one.
        """
        label = "_".join(self.torso) or "tail"
        d_q = d.wide(f"d_q_{label}", d.tail.nq, self.count)
        d_v = d.wide(f"d_v_{label}", d.tail.nv, self.count) if self.rates else None
        for lane, name in enumerate(self.torso):
            if name == "turn":
                turn = d.wide(f"d_{label}", 3, self.count)
                d.unit(turn[0], 3 * lane)
                d.step(rotations.turned_quaternion, {"turn": turn[0]}, rate=d_q.part(3, 4))
            else:
                d.unit(d_v.part(TORSO[name][0], 3), 3 * lane)
        with d.loop("i", self.tail.segments) as i:
            d.unit(d_q.part(7 + 2 * i, 2), self.of_q(i))
            if self.rates:
                d.unit(d_v.part(6 + 2 * i, 2), self.of_v(i))
        return {"d_q": d_q, "d_v": d_v} if self.rates else {"d_q": d_q}

    def spread(self, d: Draft, source: Array, of_q: Array, of_v: Array | None = None) -> None:
        """Copy wide rows to the columns of matrices (rows, nv)."""
        nv = self.tail.nv
        for target in (of_q, of_v) if of_v else (of_q,):
            d.fill(target.part(0, target.length), 0)
        with d.loop("row", source.length) as r:
            for lane, name in enumerate(self.torso):
                column, is_q = TORSO[name]
                d.copy(
                    (of_q if is_q else of_v).part(nv * r + column, 3), source.lane(r, 3 * lane, 3)
                )
            with d.loop("i", self.tail.segments) as i:
                d.copy(of_q.part(nv * r + 2 * i + 6, 2), source.lane(r, self.of_q(i), 2))
                if self.rates:
                    d.copy(of_v.part(nv * r + 2 * i + 6, 2), source.lane(r, self.of_v(i), 2))
