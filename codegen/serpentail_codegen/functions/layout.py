"""The positions of numbers in q, v and tau; the runtime has the same in serpentail.model.layout.

A velocity, its derivative, a generalised force and a row of H have the same layout.
"""

from dataclasses import dataclass
from typing import TypeVar

from ..ir.program import Array, Index, Ref

POSITION = slice(0, 3)  # of B in q, world (m)
QUATERNION = slice(3, 7)  # in q, (w, x, y, z)
VELOCITY = slice(0, 3)  # of B in v, world (m/s); of forces in generalised forces (N)
OMEGA = slice(3, 6)  # in v, body axes (rad/s); of moments in generalised forces (N m)
TORSO_NQ, TORSO_NV = 7, 6  # numbers of the torso in q and in v
PER_SEGMENT = 2  # coordinates of a segment
LOAD = 6  # numbers of a load at B: force and moment; then a force at each tail point

Number = TypeVar("Number", Index, int)


def block(array: Array, where: slice) -> Ref:
    """Return a part of a configuration, velocity or force, such as ``QUATERNION``."""
    return array.part(where.start, where.stop - where.start)


def coordinate(i: Number, which: int = 0) -> Number:
    """Return the number of a tail coordinate: the first or second of segment i."""
    return PER_SEGMENT * i + which


def coordinates(array: Array, i: Index | int) -> Ref:
    """Return the part of torques, or of an array like them, that belongs to segment i."""
    return array.part(PER_SEGMENT * i, PER_SEGMENT)


def segment_q(q: Array, i: Index | int) -> Ref:
    """Return the coordinates of segment i."""
    return q.part(TORSO_NQ + PER_SEGMENT * i, PER_SEGMENT)


def segment_v(v: Array, i: Index | int) -> Ref:
    """Return the rates, accelerations or forces of segment i."""
    return v.part(TORSO_NV + PER_SEGMENT * i, PER_SEGMENT)


def tail_v(v: Array, k: Index | int) -> Ref:
    """Return the rate, acceleration or force of tail coordinate k."""
    return v.part(TORSO_NV + k, 1)


@dataclass(frozen=True)
class Layout:
    """The layout of a model of m segments: q (nq,), v (nv,), tau (nt,)."""

    segments: int

    @property
    def nt(self) -> int:
        """Number of tail coordinates and of torques, 2m for m segments."""
        return PER_SEGMENT * self.segments

    @property
    def nq(self) -> int:
        """Numbers of a configuration."""
        return TORSO_NQ + self.nt

    @property
    def nv(self) -> int:
        """Numbers of a velocity."""
        return TORSO_NV + self.nt

    def all_q(self, q: Array) -> Ref:
        """Return all tail coordinates."""
        return q.part(TORSO_NQ, self.nt)

    def all_v(self, v: Array) -> Ref:
        """Return the rates, accelerations or forces of all tail coordinates."""
        return v.part(TORSO_NV, self.nt)
