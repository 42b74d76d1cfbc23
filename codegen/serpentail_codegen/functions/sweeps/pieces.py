"""The loops of all sweeps over the tail, and the mount where they begin.

Forward sweeps go from the torso to the tip, backward sweeps from the tip to the torso. ``i`` counts
segments, ``g`` pieces or tail points. Quantities that a sweep carries from piece to piece are
updated in place.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from serpentail_scene.keys import LIMBS

from ...ir.program import Index, Ref
from ...mechanics import mount, rotations, torso
from ...scene.variant import Stretch
from ..draft import Draft
from ..scope import Pose, State
from ..tails.articulated import ARTICULATED, WITH_RATIOS
from ..tails.continuum import CONTINUUM
from ..tails.limb import limb
from ..tails.mechanism import Mechanism
from ..tails.mixed import MIXED
from ..tails.polar import POLAR

IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)


def mechanism(draft: Draft) -> Mechanism:
    """Return the steps of the draft's tail.

    In a mixed tail, and in a limb, these are the steps of the segments that the open loop is over;
    outside of such loops, those that describe all segments.
    """
    if draft.tail.polar:
        return POLAR
    kind = draft.stretch.kind if draft.stretch else ""
    if draft.tail.kind == "mixed":
        return MIXED[kind]
    if draft.tail.kind in LIMBS:
        return limb(draft.tail.kind, draft.tail.shape.rotors > 0, kind)
    if draft.tail.shape.ratios:
        return WITH_RATIOS
    return {"articulated": ARTICULATED, "continuum": CONTINUUM}[draft.tail.kind]


def attitude(draft: Draft, state: State) -> Ref:
    """Store the rotation matrix of the torso; that of a fixed base is a constant."""
    if draft.tail.fixed:
        return draft.fixed("identity", IDENTITY)
    reads = {"quaternion": state.quaternion}
    return draft.store(rotations.quaternion_rotation, reads, R=9)["R"]


def each_segment(
    draft: Draft, downward: bool = False, stop: int | None = None
) -> Iterator[tuple[Stretch, Index]]:
    """Open a loop over the segments of each stretch, up to segment ``stop``; yields both.

    The body of a ``for`` statement over it is recorded once for each stretch.
    """
    end = draft.tail.segments if stop is None else stop
    stretches = [stretch for stretch in draft.tail.stretches if stretch.first < end]
    for stretch in reversed(stretches) if downward else stretches:
        draft.stretch = stretch
        with draft.loop("i", min(stretch.stop, end), downward, start=stretch.first) as i:
            yield stretch, i
        draft.stretch = None


@contextmanager
def pieces_of(draft: Draft, stretch: Stretch, i: Index, downward: bool = False) -> Iterator[Index]:
    """Open a loop over the pieces of segment i; yields the number of the piece."""
    with draft.loop("j", stretch.pieces, downward) as j:
        yield stretch.pieces * i + j + stretch.pieces_before(0)


@contextmanager
def points_of(draft: Draft, stretch: Stretch, i: Index, downward: bool = False) -> Iterator[Index]:
    """Open a loop over the tail points of segment i; yields the number of points before each."""
    with draft.loop("j", stretch.points, downward) as j:
        yield stretch.points * i + j + stretch.points_before(0)


def each_piece(draft: Draft, downward: bool = False) -> Iterator[tuple[Index, Index]]:
    """Open the loops over segments and their pieces; yields the segment and the number of the
    piece.
    """
    for stretch, i in each_segment(draft, downward):
        with pieces_of(draft, stretch, i, downward) as g:
            yield i, g


def each_point(draft: Draft, downward: bool = False) -> Iterator[tuple[Index, Index]]:
    """Open the loops over segments and their tail points; yields the segment, and the number of
    points before this one, without the first point of the tail.
    """
    for stretch, i in each_segment(draft, downward):
        with points_of(draft, stretch, i, downward) as g:
            yield i, g


def torso_pose(
    draft: Draft, R: Ref | None = None, origin: Ref | None = None, name: str = "link"
) -> Pose:
    """Return the pose of the tail mount, to be carried along the tail: from B in torso axes, or
    from an origin in world axes if the attitude R is given.  On a fixed base both are the same.
    """
    pose = Pose(draft.vector(f"R_{name}", 9), draft.vector(f"P_{name}", 3))
    axes = mount_axes(draft)
    if R and not draft.tail.fixed:
        draft.copy(pose.R, R)
        start = origin or draft.fixed("origin", [0, 0, 0])
        draft.step(torso.mount_position, {"R": R, "p": start}, P=pose.P)
        across(draft, mount.mounted_frame, R=pose.R)
        return pose
    if axes:
        draft.copy(pose.R, axes["mount"])
    else:
        draft.fill(pose.R, *IDENTITY)
    draft.copy(pose.P, draft.parameters["tail_mount"])
    return pose


def mount_axes(draft: Draft) -> dict[str, Ref]:
    """Return the rotation from the tail's root axes to those of the torso; nothing if they are the
    same.
    """
    if not draft.tail.shape.tilted:
        return {}
    owner = draft.tail.owner
    if owner not in draft.mounts:
        draft.mounts[owner] = draft.array("mount", 9)[0]
        draft.step(mount.mount_rotation, mount=draft.mounts[owner])
    return {"mount": draft.mounts[owner]}


def across(
    draft: Draft,
    function: Callable[..., dict],
    vectors: Mapping[str, Ref] | None = None,
    **more: Ref,
) -> None:
    """Rotate vectors across the mount, in place, if the tail begins in axes of its own."""
    axes, vectors = mount_axes(draft), {**(vectors or {}), **more}
    if axes:
        draft.step(function, axes, vectors, **vectors)
