"""What sweeps over segments as articulated bodies hand on, and which part belongs to a segment."""

from dataclasses import dataclass

from ...ir.program import Array, Index, Ref
from ..scope import Vectors


def lane(vector: Ref, i: Index) -> Ref:
    """Return the part of segment i: a lane of a wide vector, or what all segments share."""
    return vector if not vector.lanes else vector.array.down(vector.offset, i, vector.size)


@dataclass(frozen=True)
class Passes:
    """What the passes over the segments hand on: how each tip moves (lanes), its acceleration by
    velocities alone, and the elimination that gives second derivatives of the coordinates.
    """

    tip: Array
    coasting: Array
    elimination: Array
    over: Array | None = None  # reciprocals of the pivots, if a caller needs them

    def tip_of(self, i: Index) -> dict[str, Ref]:
        """Return the quantities that determine the motion of one tip."""
        return {"tip_map": self.tip.down(0, i, self.tip.size)}


@dataclass(frozen=True)
class Freed:
    """What is needed to solve for the accelerations of any load: the passes, the segments' own
    inertia, the factored inertia of the torso with free coordinates, and the attitude.
    """

    passes: Passes
    inertia: Vectors
    H: Array
    R: Ref

    def elimination(self, i: Index) -> dict[str, Ref]:
        """Return the quantities that determine the second derivatives of a segment's
        coordinates.
        """
        if self.passes.over is None:
            raise ValueError("forward dynamics kept no pivots: ask for them by again=True")
        return {"shares": self.passes.elimination[i], "over": self.passes.over[i]}

    def own(self, i: Index) -> dict[str, Ref]:
        """A segment's own inertia, and how its tip moves."""
        names = ("mass", "h", "I", "pitch", "yaw")
        return {name: lane(self.inertia[name], i) for name in names} | self.passes.tip_of(i)


@dataclass(frozen=True)
class ArticulatedBody:
    """Everything beyond the base of a segment as one body: its wrench is A a + b for the motion a
    of the base.
    """

    A: Array
    b: Array

    def rows(self, count: int) -> dict[str, Ref]:
        """The first rows of A, number by number."""
        return {f"A_{r}": self.A.lane(r, 0, 6) for r in range(count)}
