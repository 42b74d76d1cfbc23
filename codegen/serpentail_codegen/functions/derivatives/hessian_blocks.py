"""Copies tangents of gradients to the blocks of a Hessian."""

from dataclasses import dataclass

from serpentail_scene.layout import OMEGA, PER_SEGMENT, TORSO_NQ, TORSO_NV

from ...ir.program import Array, Index, Ref
from ..draft import Draft
from ..layout import coordinate
from .directions import Directions

BLOCKS = ("qq", "qv", "vv", "aq")


@dataclass(frozen=True)
class HessianBlocks:
    """Copies wide rows to the blocks ``qq, qv, vv, aq`` of ``arrays``: their lanes are tail
    coordinates, or omega and the rates of the tail.
    """

    draft: Draft
    of_q: Directions
    of_v: Directions
    arrays: dict[str, Array]

    def clear(self) -> None:
        """Store zeros in the blocks that do not depend on position or velocity of B."""
        for name in BLOCKS:
            self.draft.fill(self.arrays[name].whole(), 0)

    def of_motion(self, by_q: Array, v_by_q: Array, by_v: Array) -> None:
        """Copy tangents of the gradients by q and v along q, and of the gradient by v along v."""
        draft, tail, nv = self.draft, self.draft.tail, self.draft.tail.nv
        with draft.loop("k", nv - OMEGA.start) as k:
            row = k + OMEGA.start
            to = self.arrays["qv"].part(nv * TORSO_NV + row, tail.nt, nv)
            draft.copy(to, v_by_q.lane(row, self.of_q.base, tail.nt))
            for directions, source in ((self.of_q, v_by_q), (self.of_v, by_v)):
                if directions.base:
                    column = OMEGA.start + directions.axes.start
                    self._mirrored("vv", row, column, source.lane(row, 0, directions.base))
        with draft.loop("i", tail.segments) as i, draft.loop("k", PER_SEGMENT) as k:
            number = coordinate(i) + k
            row = number + TORSO_NV
            with draft.loop("l", i + 1) as other:
                beside = coordinate(other) + TORSO_NV
                for block, source, first in (
                    ("qq", by_q, self.of_q.of_q(other)),
                    ("vv", by_v, self.of_v.of_v(other)),
                ):
                    scalar = number + (TORSO_NQ if block == "qq" else TORSO_NV)
                    lanes = source.lane(scalar, first, PER_SEGMENT)
                    self._mirrored(block, row, beside, lanes)

    def _mirrored(self, block: str, row: Index, column: Index | int, lanes: Ref) -> None:
        """Copy lanes to a row of a symmetric block from a column on, and to its column."""
        nv, array = self.draft.tail.nv, self.arrays[block]
        self.draft.copy(array.part(nv * row + column, lanes.size), lanes)
        self.draft.copy(array.part(nv * column + row, lanes.size, nv), lanes)

    def of_inertia(self, rows: Array) -> None:
        """Copy tangents of H lambda by the tail coordinates."""
        tail = self.draft.tail
        with self.draft.loop("row", tail.nv) as r:
            to = self.arrays["aq"].part(tail.nv * r + TORSO_NV, tail.nt)
            self.draft.copy(to, rows.lane(r, self.of_q.base, tail.nt))

    def of_turn(self, by_q: Array, by_v: Array) -> None:
        """Copy tangents of the gradient by a rotation of the torso, except those along a
        rotation.
        """
        nv = self.draft.tail.nv
        with self.draft.loop("k", 3) as k:
            row = k + OMEGA.start
            base, first = self.of_q.base, self.of_v.axes.start
            self._mirrored("qq", row, TORSO_NV, by_q.lane(k, base, by_q.lanes - base))
            if base:
                to = self.arrays["qv"].part(nv * row + OMEGA.start, base)
                self.draft.copy(to, by_q.lane(k, 0, base))
            to = self.arrays["qv"].part(nv * row + OMEGA.start + first, by_v.lanes)
            self.draft.copy(to, by_v.lane(k, 0, by_v.lanes))

    def of_turned_inertia(self, by_turn: Array) -> None:
        """Copy how the tail's rows of H lambda change with a rotation of the torso."""
        tail = self.draft.tail
        with self.draft.loop("k", 3) as k:
            to = self.arrays["aq"].part(k + (tail.nv * TORSO_NV + OMEGA.start), tail.nt, tail.nv)
            self.draft.copy(to, by_turn.lane(k, self.of_q.base, tail.nt))

    def columns_of_turns(self, block: str, first: int, count: int) -> dict[str, Ref]:
        """Return the columns of rotations in some rows of a block, by the names of a step's
        outputs.
        """
        nv, array = self.draft.tail.nv, self.arrays[block]
        places = [nv * (first + r) + OMEGA.start for r in range(count)]
        return {f"row_{r}": array.part(place, 3) for r, place in enumerate(places)}
