"""Parts of arrays in the layout of q, v and tau, as steps read them; `Tail` has those that a fixed
base moves.
"""

from typing import TypeVar

from serpentail_scene.layout import PER_SEGMENT

from ..ir.program import Array, Index, Ref

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
