"""Assigns lanes of wide vectors to directions of differentiation, and the results to columns.

Derivatives with respect to q are in the tangent space: position of B, a rotation of the torso in
body axes, tail coordinates. The columns of such a matrix are those of a velocity v.
"""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, PER_SEGMENT, POSITION, QUATERNION, VELOCITY

from ...ir.program import Array, Index, Loop, Ref
from ...mechanics import rotations
from ..draft import Draft
from ..layout import block
from ..tail import Tail

# directions of the torso: their position in the tangent of q or v, and whether it is q
TORSO = {"turn": (OMEGA, True), "p_dot": (VELOCITY, False), "omega": (OMEGA, False)}


@dataclass(frozen=True)
class Directions:
    """Which lane is which direction: some of the torso, then coordinates and rates of segment after
    segment.
    """

    tail: Tail
    torso: tuple[str, ...]
    coordinates: bool = True
    rates: bool = True
    axes: range = range(3)  # along or about which it moves; fewer for omega alone

    @property
    def base(self) -> int:
        """Lanes of the torso."""
        return len(self.axes) * len(self.torso)

    @property
    def each(self) -> int:
        """Lanes of one segment."""
        return (self.coordinates + self.rates) * self.width

    @property
    def width(self) -> int:
        """Coordinates whose lanes are neighbours: those of a segment, or one if some segments have
        one.
        """
        return 1 if self.tail.hinges else PER_SEGMENT

    @property
    def segments(self) -> int:
        """Number of groups of so many coordinates."""
        return self.tail.nt // self.width

    @property
    def count(self) -> int:
        """All lanes."""
        return self.base + self.each * self.segments

    def outward(self, loops: tuple[Loop, ...]) -> Index | None:
        """Return how many lanes a sweep outward needs: segment i depends only on the segments up to
        i. In a tree loops count the segments of one chain, and sweeps take all lanes.
        """
        everywhere = self.tail.branches or any(loop.downward for loop in loops)
        return None if everywhere else self.up_to(loops)

    def up_to(self, loops: tuple[Loop, ...]) -> Index | None:
        """Lanes of the torso and the segments up to i, within a loop over segments."""
        within = any(loop.var == "i" for loop in loops)
        return self.each * Index((("i", 1),)) + (self.base + self.each) if within else None

    def of_q(self, i: Index) -> Index:
        """First lane of the coordinates of segment i."""
        return self.each * i + self.base

    def of_v(self, i: Index) -> Index:
        """First lane of the rates of segment i."""
        return self.each * i + (self.base + self.width * self.coordinates)

    @property
    def label(self) -> str:
        """A name of these directions."""
        tail = {"q": self.coordinates, "v": self.rates}
        return "_".join([*self.torso, *(name for name, here in tail.items() if here)])

    def tangents(self, draft: Draft, q: Array | None = None) -> dict[str, Array]:
        """Declare ``d_q`` and ``d_v`` if some direction moves them, and store the directions in
        them as rows.

        q, with a unit quaternion, is given if the attitude is differentiated.
        """
        sizes = {"d_q": self.tail.nq} if self.coordinates else {}
        sizes |= {"d_v": self.tail.nv} if self.rates or self.torso else {}
        tangents = {n: draft.wide(f"{n}_{self.label}", s, self.count) for n, s in sizes.items()}
        if self.torso and (len(self.axes) < 3 or not self.rates or self.tail.widths):
            draft.fill(tangents["d_v"].whole(), 0)  # rows that no direction moves
        for lane, name in enumerate(self.torso):
            if name != "turn":
                rows = tangents["d_v"].part(TORSO[name][0].start + self.axes.start, len(self.axes))
                draft.unit(rows, len(self.axes) * lane)
            elif q:
                turn = {"quaternion": block(q, QUATERNION), "turn": self.turn(draft)}
                draft.step(
                    rotations.turned_quaternion, turn, rate=block(tangents["d_q"], QUATERNION)
                )
        with draft.loop("i", self.segments) as i:
            own, tail = self.width * i, self.tail
            if self.coordinates:
                where = tangents["d_q"].part(own + tail.torso_nq, self.width)
                draft.unit(where, self.of_q(i))
            if self.rates:
                where = tangents["d_v"].part(own + tail.torso_nv, self.width)
                draft.unit(where, self.of_v(i))
        return tangents

    def turn(self, draft: Draft) -> Ref:
        """Declare the directions that rotate the torso as rows of a vector, and store them."""
        turn = draft.wide("turn", 3, self.count)[0]
        draft.unit(turn, 3 * self.torso.index("turn"))
        return turn

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
            with draft.loop("i", self.segments) as i:
                column, n = nv * r + self.width * i + self.tail.torso_nv, self.width
                draft.copy(of_q.part(column, n), source.lane(r, self.of_q(i), n))
                if of_v:
                    draft.copy(of_v.part(column, n), source.lane(r, self.of_v(i), n))


def in_tangent_space(draft: Draft, q: Array, gradient: Array, dq: Array) -> None:
    """Turn a gradient with respect to the numbers of q into one with respect to the directions of a
    velocity.
    """
    draft.copy(block(dq, POSITION), block(gradient, POSITION))
    reads = {"quaternion": block(q, QUATERNION), "gradient": block(gradient, QUATERNION)}
    draft.step(rotations.turn_gradient, reads, turn=block(dq, OMEGA))
    draft.copy(draft.tail.all_v(dq), draft.tail.all_q(gradient))
