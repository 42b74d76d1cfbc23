"""What sweeps over segments as articulated bodies hand on, and where a segment's part of it is."""

from dataclasses import dataclass

from ...ir.program import Array, Index, Ref
from ..scope import Vectors


def lane(vector: Ref, i: Index) -> Ref:
    """Return what is segment i's: of a wide vector a lane, else an entry of its array."""
    if not vector.lanes:
        return vector.array[i]
    return vector.array.down(vector.offset, i, vector.size)


@dataclass(frozen=True)
class Passes:
    """What the passes over the segments hand on: how each tip moves (lanes), what velocities alone
    accelerate it by, what its coordinates' second derivatives follow from.
    """

    tip: Array
    coasting: Array
    elimination: Array
    over: Array | None = None  # one over the pivots, for those who ask

    def tip_of(self, i: Index) -> dict[str, Ref]:
        """What the motion of one tip is made of."""
        return {"tip_map": self.tip.down(0, i, self.tip.size)}


@dataclass(frozen=True)
class Freed:
    """What solves for accelerations of any load: the passes, the segments' own inertia, the
    torso's with free coordinates, factored, and the attitude.
    """

    passes: Passes
    inertia: Vectors
    H: Array
    R: Ref

    def elimination(self, i: Index) -> dict[str, Ref]:
        """What the second derivatives of a segment's coordinates follow from."""
        if self.passes.over is None:
            raise ValueError("forward dynamics kept no pivots: ask for them by again=True")
        return {"shares": self.passes.elimination[i], "over": self.passes.over[i]}

    def own(self, i: Index) -> dict[str, Ref]:
        """A segment's own inertia, and how its tip moves."""
        lanes = {name: lane(self.inertia[name], i) for name in ("h", "I", "pitch", "yaw")}
        return lanes | {"mass": self.inertia["mass"]} | self.passes.tip_of(i)


@dataclass(frozen=True)
class Body:
    """All that hangs on the base of a segment: its wrench is A a + b for the base's motion a."""

    A: Array
    b: Array

    def rows(self, count: int) -> dict[str, Ref]:
        """The first rows of A, number by number."""
        return {f"A_{r}": self.A.lane(r, 0, 6) for r in range(count)}
