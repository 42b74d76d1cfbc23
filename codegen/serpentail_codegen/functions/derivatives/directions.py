"""Which lane of a wide vector stands for which direction of differentiation, and where its results
belong.

Derivatives with respect to q are in the tangent space: position of B, a rotation of the torso in
body axes, tail coordinates; the columns of such a matrix are those of a velocity v.
"""

from dataclasses import dataclass

from ...ir.program import Array, Index, Loop
from ...mechanics import rotations
from ..draft import Draft
from ..layout import (
    OMEGA,
    PER_SEGMENT,
    QUATERNION,
    TORSO_NV,
    VELOCITY,
    block,
    coordinate,
    segment_q,
    segment_v,
)
from ..tail import Tail

# directions of the torso: where they are in the tangent of q or v, and whether it is q
TORSO = {"turn": (OMEGA, True), "p_dot": (VELOCITY, False), "omega": (OMEGA, False)}


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
        return (2 if self.rates else 1) * PER_SEGMENT

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
        return self.each * i + (self.base + PER_SEGMENT)

    def tangents(self, draft: Draft, q: Array) -> dict[str, Array]:
        """Declare ``d_q`` and ``d_v`` and store the directions in them as rows; q has a unit
        quaternion.
        """
        label = "_".join(self.torso) or "tail"
        d_q = draft.wide(f"d_q_{label}", self.tail.nq, self.count)
        tangents = {"d_q": d_q}
        if self.rates:
            tangents["d_v"] = draft.wide(f"d_v_{label}", self.tail.nv, self.count)
        for lane, name in enumerate(self.torso):
            if name == "turn":
                turn = draft.wide(f"d_{label}", 3, self.count)[0]
                draft.unit(turn, 3 * lane)
                reads = {"quaternion": block(q, QUATERNION), "turn": turn}
                draft.step(rotations.turned_quaternion, reads, rate=block(d_q, QUATERNION))
            else:
                draft.unit(block(tangents["d_v"], TORSO[name][0]), 3 * lane)
        with draft.loop("i", self.tail.segments) as i:
            draft.unit(segment_q(d_q, i), self.of_q(i))
            if self.rates:
                draft.unit(segment_v(tangents["d_v"], i), self.of_v(i))
        return tangents

    def spread(self, draft: Draft, source: Array, of_q: Array, of_v: Array | None = None) -> None:
        """Copy wide rows to the columns of matrices (rows, nv)."""
        nv = self.tail.nv
        for target in (of_q, of_v) if of_v else (of_q,):
            draft.fill(target.part(0, target.length), 0)
        with draft.loop("row", source.length) as r:
            for lane, name in enumerate(self.torso):
                where, is_q = TORSO[name]
                target = of_q if is_q or not of_v else of_v
                draft.copy(target.part(nv * r + where.start, 3), source.lane(r, 3 * lane, 3))
            with draft.loop("i", self.tail.segments) as i:
                column = nv * r + coordinate(i) + TORSO_NV
                draft.copy(of_q.part(column, 2), source.lane(r, self.of_q(i), PER_SEGMENT))
                if of_v:
                    draft.copy(of_v.part(column, 2), source.lane(r, self.of_v(i), PER_SEGMENT))
