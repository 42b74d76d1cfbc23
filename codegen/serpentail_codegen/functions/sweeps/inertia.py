"""Sweeps of inertia: composite bodies from the tip to the torso, and everything that H
consists of.
"""

from collections.abc import Callable

from ...ir.program import Array, Index, Ref, as_index
from ...mechanics import branch, hinge, mount, passive, torso
from ..draft import Draft
from ..scope import Instead, Pose, State, Vectors
from ..tail import Tail
from ..tails.mechanism import Segments
from .chains import add, each_chain, on_each, prepared, sided
from .pieces import across, each_segment, mechanism, pieces_of, torso_pose

Block = Callable[..., Ref]  # entries of H: from two tail coordinates and a count


def gather_inertia(
    draft: Draft,
    segments: Segments,
    roots: dict[str, Array],
    columns: Array,
    H_tail: Block | None = None,
) -> Vectors:
    """Composite inertia of a chain in ``mass, h, I`` at its mount, torso axes; each segment's
    momentum columns at B and its own block of H.
    """
    composite, tail = draft.vectors(mass=1, h=3, I=6), draft.tail
    names = () if tail.prescribed else ("column",) if tail.width == 1 else ("pitch", "yaw")
    to_torso = hinge.hinge_at_torso if tail.width == 1 else torso.column_at_torso
    momenta = draft.vectors(**dict.fromkeys(names, 6))
    for ref in composite.named.values():
        draft.fill(ref, 0)
    for stretch, i in each_segment(draft, downward=True):
        # the segment's own block of H and its columns start from zero; the sums of all beyond go on
        own = _own_block(H_tail, tail, i) if H_tail and names else {}
        for ref in (*momenta.named.values(), *own.values()):
            draft.fill(ref, 0)
        with pieces_of(draft, stretch, i, downward=True) as g:
            step = mechanism(draft).gather
            draft.step(step, segments.at(i, g), composite, momenta, **composite, **momenta, **own)
        if names:
            root = {name: array[i] for name, array in roots.items()}
            draft.step(to_torso, root, momenta, columns=columns_of(tail, columns, i))
    across(draft, mount.composite_at_mount, composite.only("h", "I").named)
    return composite


def with_torso(draft: Draft, composite: Vectors, total: Vectors) -> Vectors:
    """Return ``mass, h, I`` of the torso, the chains before and this one at B, given the sums
    before it, which the tail begins; a fixed base adds nothing.
    """
    if draft.tail.name:
        add(draft, branch.chain_composite, composite, total)
        return total
    if not draft.tail.fixed:
        draft.step(torso.torso_composite, composite, **composite)
    return composite


def _own_block(H_tail: Block, tail: Tail, i: Index) -> dict[str, Ref]:
    """Return the lower triangle of H of one segment's coordinates, to be added to."""
    pitch = tail.coordinate(i)
    if tail.width == 1:
        return {"H_own_": H_tail(pitch, pitch)}
    yaw = pitch + 1
    return {
        "H_pp_": H_tail(pitch, pitch),
        "H_py_": H_tail(yaw, pitch),
        "H_yy_": H_tail(yaw, yaw),
    }


def segment_roots(draft: Draft) -> dict[str, Array]:
    """Declare the pose of every segment's root."""
    count = draft.tail.segments
    return {"R": draft.array("R_root", 9, count), "P": draft.array("P_root", 3, count)}


def forward_roots(
    draft: Draft,
    segments: Segments,
    pose: Pose,
    roots: dict[str, Array],
    S: Array | None = None,
) -> None:
    """Compute the pose of every segment's root, and spatial columns of all segments but the last,
    starting from a pose.
    """
    last = draft.tail.segments - 1

    def copy_pose(i: Index) -> None:
        for name, array in roots.items():
            draft.copy(array[i], pose[name])

    for stretch, i in each_segment(draft, stop=last):
        copy_pose(i)
        if S:
            draft.fill(S[i], 0)
        with pieces_of(draft, stretch, i) as g:
            if S:
                draft.step(mechanism(draft).twist, pose, segments.at(i, g), S_=S[i])
            draft.step(mechanism(draft).pose, pose, segments.at(i, g), **pose)
    copy_pose(as_index(last))


def animal_inertia(
    draft: Draft, state: State, H_tail: Block, columns: Array, R: Ref | None = None
) -> tuple[list[Segments], Vectors]:
    """Compute everything that H consists of (Eqs. 2, 16, 18): ``mass, h, I`` at B, momentum
    columns, H of the coordinates of all chains (lower triangle), which do not couple.

    The columns are in torso axes, or in world axes if the attitude R of the torso is given. Returns
    the segments of each chain, and ``mass, h, I``.
    """
    if draft.tail.branches:
        with draft.loop("k", draft.tail.nt) as k:
            draft.fill(H_tail(k, as_index(0), draft.tail.nt), 0)
    found: list[Segments] = []
    total = Vectors({})
    for chain in each_chain(draft):
        segments, total = tail_inertia(draft, state.on(chain), H_tail, columns, total, R)
        found.append(segments)
        if "rotor" in chain.passive:
            with draft.loop("k", chain.nt) as k:
                own = Instead({"tail_rotor": draft.entry("tail_rotor", k, 1)})
                at = k + chain.coordinates_before
                draft.step(passive.rotor_inertia, own, inertia_=H_tail(at, at))
    return found, total


def tail_inertia(
    draft: Draft,
    state: State,
    H_tail: Block,
    columns: Array,
    total: Vectors,
    R: Ref | None,
) -> tuple[Segments, Vectors]:
    """Compute what one chain gives to H (Eqs. 2, 16, 18); ``total``: ``mass, h, I`` of the chains
    before it.
    """
    segments = mechanism(draft).prepare(draft, state, True)
    if draft.tail.prescribed:  # a body of the torso at each time
        return segments, with_torso(draft, gather_inertia(draft, segments, {}, columns), total)
    pose = torso_pose(draft, R)
    roots = segment_roots(draft)
    tail, step = draft.tail, draft.of_segment(torso.segment_coupling)
    S = draft.array("S", 6 * tail.width, max(tail.segments - 1, 1))
    forward_roots(draft, segments, pose, roots, S)
    composite = with_torso(draft, gather_inertia(draft, segments, roots, columns, H_tail), total)

    # blocks of two segments
    with draft.loop("i", tail.segments, start=1) as i, draft.loop("l", i) as other:
        first, own = tail.coordinate(other), tail.coordinate(i)
        names = ("H_pitch", "H_yaw")[: tail.width]
        blocks = {name: H_tail(own + k, first, tail.width) for k, name in enumerate(names)}
        reads = {"S": S[other], "columns": columns_of(tail, columns, i)}
        draft.step(step, reads, **blocks)
    turn_columns(draft, columns)
    return segments, composite


def turn_columns(draft: Draft, columns: Array) -> None:
    """Turn the momentum columns of a mirrored chain into the axes of the torso."""
    if draft.tail.mirrored and not draft.tail.prescribed:
        step = sided(draft, branch.mirrored_columns)
        with draft.loop("i", draft.tail.segments) as i:
            own = columns_of(draft.tail, columns, i)
            draft.step(step, {"columns": own}, columns=own)


def columns_and_inertia(draft: Draft, state: State) -> tuple[list[Segments], Array, Vectors]:
    """Return the segments of each chain, the momentum columns, and ``mass, h, I`` at B, without
    H.
    """
    found, total = prepared(draft, state, True), Vectors({})
    columns = draft.array("columns", 12, draft.tail.segments)
    for segments in on_each(draft, found):
        roots = {} if draft.tail.prescribed else segment_roots(draft)
        if roots:
            forward_roots(draft, segments, torso_pose(draft), roots)
        total = with_torso(draft, gather_inertia(draft, segments, roots, columns), total)
        turn_columns(draft, columns)
    return found, columns, total


def column_of(columns: Array, k: Index) -> Ref:
    """Momentum column of tail coordinate k."""
    return columns.part(6 * k, 6)


def columns_of(tail: Tail, columns: Array, i: Index) -> Ref:
    """All momentum columns of segment i of a chain."""
    return columns.part(6 * tail.coordinate(i), 6 * tail.width)
