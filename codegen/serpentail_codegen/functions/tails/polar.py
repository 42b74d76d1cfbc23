"""The continuum tail in polar angles, for comparison: the closed forms of the paper."""

from dataclasses import replace

from ...ir.program import Array, Ref
from ...mechanics import polar_arc
from ..draft import Draft
from ..scope import Motion, State, Vectors
from .continuum import (
    ARC,
    CONTINUUM,
    OWN,
    bend_range,
    sample_arrays,
    sample_section,
    section_properties,
)
from .mechanism import Place, Segments, in_turn, simplified

POLAR_DATA = {name: ARC[name] for name in ("E", "r", "bend")} | OWN
POLAR_DATA |= {"trig": 4, "E_v": 15, "Q_v": 10, "loading": 27}


def guard_polar(draft: Draft, angles: Ref, limit: dict[str, Ref], *protects: Ref) -> None:
    """Refuse a segment that is straight, or bent beyond the range."""
    margins = draft.store(polar_arc.polar_margins, {"angles": angles}, limit, bent=1, margin=1)
    for margin in margins.named.values():
        draft.guard(margin, "OUT_OF_RANGE", *protects)


def prepare_polar_arcs(draft: Draft, state: State, doubled: bool = False) -> Segments:
    """Integrals over the slices, tip and own inertia of every segment."""
    del doubled
    own = section_properties(draft, state)
    return in_turn(draft, "continuum", own, POLAR_DATA, describe_polar_arc)


def describe_polar_arc(draft: Draft, piece: Vectors) -> None:
    """Store integrals over the slices, tip and own inertia of a segment."""
    draft.step(polar_arc.segment_trigonometry, piece, trig=piece["trig"])
    draft.step(polar_arc.slice_integrals, piece, **piece.only("E_v", "Q_v"))
    guarded = piece.only("trig", "E_v", "Q_v").named.values()
    guard_polar(draft, piece["angles"], bend_range(draft), *guarded)
    draft.step(polar_arc.segment_tip, piece, **piece.only("E", "r", "bend"))
    draft.step(polar_arc.segment_inertia, piece, **piece.only(*OWN))


def prepare_polar_samples(draft: Draft, state: State, segments: Segments | None) -> Segments:
    """Rotation, position and columns over one n-th of every segment."""
    del segments
    fraction, section = sample_section(draft)
    samples = Segments(state, sample_arrays(draft))
    part, trig, limit = draft.vector("part", 2), draft.vector("trig_sample", 4), bend_range(draft)
    with draft.loop("i", draft.tail.segments) as i:
        sample, angles = samples.at(i), state.angles(i)
        draft.step(polar_arc.part_of_arc, {"angles": angles}, fraction, part=part)
        draft.step(polar_arc.segment_trigonometry, {"angles": part}, trig=trig)
        guard_polar(draft, angles, limit, trig)
        bent = {"angles": part, "trig": trig}
        draft.step(polar_arc.segment_tip, bent, section(i), **sample.only("E", "r", "bend"))
        draft.step(polar_arc.columns_of_arc, sample, fraction, bend=sample["bend"])
    return samples


def move_polar_arc(
    draft: Draft,
    segments: Segments,
    place: Place,
    motion: Motion,
    v_dot: Array | None,
    wrench: Vectors,
) -> None:
    """Store the inertial wrench of one arc and its generalised forces, then carry ``w, w_dot, a``
    to its tip.
    """
    piece, state, forced = segments.at(*place), segments.state, v_dot is not None
    reads = piece, segments.motion(place[0], v_dot), motion
    loading = simplified(polar_arc.segment_loading, state, forced)
    draft.step(loading, *reads, loading=piece["loading"])
    draft.step(polar_arc.segment_wrench, piece, **wrench)
    draft.step(simplified(polar_arc.segment_motion, state, forced), *reads, **motion)


POLAR = replace(
    CONTINUUM,
    prepare=prepare_polar_arcs,
    data=POLAR_DATA,
    describe=describe_polar_arc,
    prepare_samples=prepare_polar_samples,
    move=move_polar_arc,
)
