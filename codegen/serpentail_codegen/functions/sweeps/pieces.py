"""What all sweeps over the tail begin with: its loops, and where it is mounted.

Forward sweeps go from the torso to the tip, backward sweeps from the tip to the torso; ``i`` counts
segments, ``g`` pieces or tail points.  What a sweep carries from piece to piece is updated in
place.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from ...ir.program import Index, Ref
from ...mechanics import rotations, torso
from ..draft import Draft
from ..scope import Pose, State
from ..tails.mechanism import Mechanism
from ..tails.of_scene import mechanism_of

IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)


def mechanism(draft: Draft) -> Mechanism:
    """Return the steps of the draft's tail."""
    return mechanism_of(draft.tail)


def attitude(draft: Draft, state: State) -> Ref:
    """Store the rotation matrix of the torso."""
    reads = {"quaternion": state.quaternion}
    return draft.store(rotations.quaternion_rotation, reads, R=9)["R"]


@contextmanager
def each_piece(draft: Draft, downward: bool = False) -> Iterator[tuple[Index, Index]]:
    """Open the loops over segments and their pieces; yields the segment and the number of the
    piece.
    """
    pieces = mechanism(draft).pieces(draft.tail)
    with (
        draft.loop("i", draft.tail.segments, downward) as i,
        draft.loop("j", pieces, downward) as j,
    ):
        yield i, pieces * i + j


def torso_pose(
    draft: Draft, R: Ref | None = None, origin: Ref | None = None, name: str = "link"
) -> Pose:
    """Pose of the tail mount, to be carried along the tail: from B in torso axes, or with the
    attitude R in world axes from an origin.
    """
    pose = Pose(draft.vector(f"R_{name}", 9), draft.vector(f"P_{name}", 3))
    if R:
        draft.copy(pose.R, R)
        start = origin or draft.fixed("origin", [0, 0, 0])
        draft.step(torso.mount_position, {"R": R, "p": start}, P=pose.P)
    else:
        draft.fill(pose.R, *IDENTITY)
        draft.copy(pose.P, draft.parameters["tail_mount"])
    return pose
