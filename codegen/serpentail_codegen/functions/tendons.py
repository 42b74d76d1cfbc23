"""Lengths of tendons, and the torques of their tensions."""

from collections.abc import Callable, Iterator
from fractions import Fraction

from ..ir.program import Array, Index, Ref
from ..ir.step import Step, specialised
from ..mechanics import link, tendon
from ..mechanics.lower import derived
from .draft import Draft
from .scope import Instead, State
from .sweeps.pieces import each_segment, pieces_of

SIZES = {"tendon_offsets": 2, "tendon_ends": 2, "tendon_guides": 1, "tendon_roots": 1}
Own = Callable[..., Instead]  # names of parameters -> those of one tendon
Pieces = Callable[[Index], Ref]  # the number of a link or arc -> its length


def each_slope(
    draft: Draft, state: State, lengths: Array | None = None
) -> Iterator[tuple[int, Index, Ref]]:
    """Open a loop over the segments that each tendon passes; yields the tendon, the segment, and
    the derivatives of its length by the segment's coordinates; lengths are added up.
    """
    slope, arcs = draft.vector("slope", 2), draft.tail.kind == "continuum"
    pieces, joints = _pieces(draft), None if arcs else _joints(draft, state)
    for k, to in enumerate(draft.tail.shape.tendons):
        own, adds = _own(draft, k), {"slope_": slope}
        adds |= {"length_": lengths.part(k, 1)} if lengths else {}
        if draft.tail.shape.guided:
            first = own("tendon_offsets", "tendon_roots")
            draft.step(tendon.first_guide, first, **draft.scratch(inner=3))
        for stretch, i in each_segment(draft, stop=to):
            draft.fill(slope, 0)
            if joints is None:
                arc = {"piece": pieces(i), "angles": state.angles(i)}
                draft.step(tendon.conduit, own("tendon_offsets"), arc, **adds)
            elif not draft.tail.shape.guided:
                run = draft.scratch(inner=3, outer=3)
                alike = own("tendon_offsets", "tendon_guides")
                draft.step(tendon.run_of_all, alike, {"piece": pieces(i)}, **run)
                draft.step(_times(stretch.pieces), {"joint": joints[i]}, run, **adds)
            else:
                along = _places(draft, to)
                with pieces_of(draft, stretch, i) as g:
                    reads = {"joint": joints[i], "piece": pieces(g), "along": along.part(g, 1)}
                    _cross(draft, own, reads, adds)
            yield k, i, slope


def _own(draft: Draft, k: int) -> Own:
    at = Index() + k
    return lambda *names: Instead({name: draft.entry(name, at, SIZES[name]) for name in names})


def _pieces(draft: Draft) -> Pieces:
    if draft.tail.shape.own:
        name = "arc_lengths" if draft.tail.shape.arcs else "link_lengths"
        return lambda g: draft.entry(name, g, 1)
    share = draft.fixed("share", [Fraction(1, draft.tail.pieces)])
    length = draft.store(tendon.piece_length, {"share": share}, piece=1)["piece"]
    return lambda _: length


def _joints(draft: Draft, state: State) -> Array:
    """Store the trigonometry of each segment's joint."""
    joints = draft.array("joint", 4, draft.tail.segments)
    with draft.loop("i", draft.tail.segments) as i:
        draft.step(link.joint_trigonometry, {"angles": state.angles(i)}, joint=joints[i])
    return joints


def _times(count: int) -> Step:
    """Return the step of so many runs that are alike."""
    return specialised(derived(tendon.free_run), f"free_run_{count}", times=(count,))


def _places(draft: Draft, to: int) -> Array:
    """Return where the guides of links are between the torso's, 0, and the last one, 1."""
    stretch = next(each for each in draft.tail.stretches if to <= each.stop)
    links = stretch.pieces_before(to)
    return draft.fixed(f"places_{links}", [Fraction(g + 1, links) for g in range(links)]).array


def _cross(draft: Draft, own: Own, reads: dict[str, Ref], adds: dict[str, Ref]) -> None:
    """Add a tendon's run to the guide of the next link."""
    run, piece = draft.scratch(inner=3, outer=3), {"piece": reads["piece"]}
    places = own("tendon_offsets", "tendon_ends", "tendon_guides")
    draft.step(tendon.next_guide, places, {"along": reads["along"]}, piece, **run.only("outer"))
    draft.step(_times(1), {"joint": reads["joint"]}, run, **adds)
    draft.step(tendon.next_run, run.only("outer"), piece, **run.only("inner"))


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
