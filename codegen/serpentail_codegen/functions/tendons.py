"""Lengths of tendons, and the torques of their tensions."""

from collections.abc import Callable, Iterator
from fractions import Fraction

from ..ir.program import Array, Index, Ref
from ..mechanics import link, tendon
from .draft import Draft
from .scope import State
from .sweeps.pieces import each_segment, pieces_of

SIZES = {"tendon_offsets": 2, "tendon_ends": 2, "tendon_guides": 1, "tendon_roots": 1}


def each_slope(
    draft: Draft, state: State, lengths: Array | None = None
) -> Iterator[tuple[int, Index, Ref]]:
    """Open a loop over the segments that each tendon passes; yields the tendon, the segment, and
    the derivatives of its length by the segment's coordinates; lengths are added up.
    """
    slope, tail, whole = draft.vector("slope", 2), draft.tail, draft.parameters
    pieces, arcs = _pieces(draft), tail.kind == "continuum"
    joints = slope.array if arcs else draft.array("joint", 4, tail.segments)
    run = draft.vectors(**{} if arcs else {"inner": 3, "outer": 3})
    if not arcs:
        with draft.loop("i", tail.segments) as i:
            draft.step(link.joint_trigonometry, {"angles": state.angles(i)}, joint=joints[i])
    for k, to in enumerate(tail.shape.tendons):
        # steps find the numbers of this tendon by the names of all
        own = {n: whole[n].array.part(size * k, size) for n, size in SIZES.items() if n in whole}
        draft.parameters = {**whole, **own}
        adds = {"slope_": slope} | ({"length_": lengths.part(k, 1)} if lengths else {})
        if tail.shape.guided:
            draft.step(tendon.first_guide, **run.only("inner"))
            # where guides of links are between the torso's, 0, and the last one, 1
            links = next(each for each in tail.stretches if to <= each.stop).pieces_before(to)
            shares = [Fraction(g + 1, links) for g in range(links)]
            along = draft.fixed(f"places_{links}", shares).array
        for stretch, i in each_segment(draft, stop=to):
            draft.fill(slope, 0)
            if arcs:
                arc = {"piece": pieces(i), "angles": state.angles(i)}
                draft.step(tendon.conduit, arc, **adds)
            elif not tail.shape.guided:
                times = {"times": draft.fixed(f"times_{stretch.pieces}", [stretch.pieces])}
                draft.step(tendon.run_of_all, {"piece": pieces(i)}, **run)
                draft.step(tendon.free_run, {"joint": joints[i]}, times, run, **adds)
            else:
                once = {"times": draft.fixed("times_1", [1])}
                with pieces_of(draft, stretch, i) as g:
                    piece = {"piece": pieces(g)}
                    place = {"along": along.part(g, 1), **piece}
                    draft.step(tendon.next_guide, place, **run.only("outer"))
                    draft.step(tendon.free_run, {"joint": joints[i]}, once, run, **adds)
                    draft.step(tendon.next_run, run.only("outer"), piece, **run.only("inner"))
            yield k, i, slope
    draft.parameters = whole


def _pieces(draft: Draft) -> Callable[[Index], Ref]:
    """Return the length of a link or arc by its number."""
    if draft.tail.shape.own:
        name = "arc_lengths" if draft.tail.shape.arcs else "link_lengths"
        return lambda g: draft.entry(name, g, 1)
    share = draft.fixed("share", [Fraction(1, draft.tail.pieces)])
    length = draft.store(tendon.piece_length, {"share": share}, piece=1)["piece"]
    return lambda _: length


def assemble_tendon_lengths(draft: Draft, arrays: dict[str, Array]) -> None:
    """Free runs from guide to guide, or conduits along arcs."""
    lengths, B, tail = arrays["lengths"], arrays["B"], draft.tail
    for whole in (lengths.whole(), B.whole()):
        draft.fill(whole, 0)
    for k, i, slope in each_slope(draft, draft.state(arrays["q"]), lengths):
        draft.copy(tail.segment_tau(B, i + tail.segments * k), slope)


def assemble_tendon_torques(draft: Draft, arrays: dict[str, Array]) -> None:
    """-B^T T, segment by segment."""
    draft.fill(arrays["tau"].whole(), 0)
    for k, i, slope in each_slope(draft, draft.state(arrays["q"])):
        reads = {"tension": arrays["tension"].part(k, 1), "slope": slope}
        draft.step(tendon.pull, reads, tau_=draft.tail.segment_tau(arrays["tau"], i))


ASSEMBLIES = {
    "tendon_lengths": assemble_tendon_lengths,
    "tendon_torques": assemble_tendon_torques,
}
