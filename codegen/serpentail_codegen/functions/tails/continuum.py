"""The continuum tail: arc by arc, in the frames of the arcs' roots."""

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from math import ceil, log2, sqrt

from ...ir.program import Array, Index, Ref
from ...ir.step import Step
from ...mechanics import air, arc, arc_inertia, arc_shape, arc_wrench
from ...mechanics.lower import derive
from ..draft import Draft
from ..scope import Instead, Motion, State, Vectors
from .mechanism import Mechanism, Place, Segments, in_turn, simplified, widths

ARC = {"tip": 8, "shape": 16, "E": 9, "r": 3, "bend": 12}
# places and weights of Gauss's rule of four points on [0, 1]
PLACES = [sqrt(3 / 7 + side * 2 / 7 * sqrt(6 / 5)) for side in (-1, 1)]
WEIGHTS = [(18 + side * sqrt(30)) / 72 for side in (1, -1)]
SLICES = [
    number
    for place, weight in zip(PLACES, WEIGHTS, strict=True)
    for side in (-1, 1)
    for number in ((1 + side * place) / 2, weight)
]
OWN = {"h_own": 3, "I_own": 6, "pitch_own": 6, "yaw_own": 6, "H_own": 3}


def shape_step(bend_range: float) -> Step:
    """Return the step of a segment's shape with as many quadruplings as the range needs."""
    levels = max(0, ceil(log2(bend_range / arc_shape.SERIES_REACH)))
    return derive(arc_shape.segment_shape, levels=levels)


def bend_range(draft: Draft) -> dict[str, Ref]:
    """Return the range within which bends are declared to stay."""
    return {"bend_range": draft.fixed("bend_range", [draft.tail.bend_range])}


def own_sections(draft: Draft, name: str, part: Fraction) -> Array:
    """Store mass and length of a part of every segment, from the segment's own."""
    array = draft.array(name, 2, draft.tail.segments)
    share = {"share": draft.fixed(f"part_of_{name}", [part])}
    for run in draft.tail.runs("continuum"):
        with draft.loop("i", run.stop, start=run.first) as i:
            k = i + -run.other_segments
            own = {key: draft.entry(key, k, 1) for key in ("arc_masses", "arc_lengths")}
            draft.step(arc.own_section_properties, Instead(own), share, section=array[i])
    return array


def section_properties(draft: Draft, state: State) -> Segments:
    """Store the properties of every segment, or those of one segment if all are equal."""
    if draft.tail.shape.own:
        return Segments(state, {"section": own_sections(draft, "section", Fraction(1))})
    share = draft.fixed("share", [Fraction(1, draft.tail.segments)])
    one = draft.store(arc.section_properties, {"share": share}, section=2)
    return Segments(state, {}, one.named)


def describe_arc(draft: Draft, piece: Vectors) -> None:
    """Store shape, tip and own inertia of a segment."""
    limit, margin = bend_range(draft), draft.scratch(margin=1)
    draft.step(shape_step(draft.tail.bend_range), piece, **piece.only("tip", "shape"))
    draft.step(arc_shape.bend_margin, piece, limit, **margin)
    draft.guard(margin["margin"], "OUT_OF_RANGE", piece["tip"], piece["shape"])
    draft.step(arc.segment_tip, piece, **piece.only("E", "r", "bend"))
    draft.step(arc_inertia.segment_inertia, piece, **piece.only(*OWN))


def prepare_arcs(draft: Draft, state: State, doubled: bool = False) -> Segments:
    """Shape, tip and own inertia of every segment."""
    del doubled
    own = section_properties(draft, state)
    return in_turn(draft, "continuum", own, ARC | OWN, describe_arc)


def sample_section(draft: Draft) -> tuple[dict[str, Ref], Callable[[Index], dict[str, Ref]]]:
    """Store the properties of one n-th of a segment; return the fraction, and the properties by
    segment.
    """
    part = Fraction(1, draft.tail.links)
    fraction = {"fraction": draft.fixed("fraction", [part])}
    if draft.tail.shape.own:
        own = own_sections(draft, "section_sample", part)
        return fraction, lambda i: {"section": own[i]}
    share = draft.fixed("share_sample", [part / draft.tail.segments])
    section = draft.vector("section_sample", 2)
    draft.step(arc.section_properties, {"share": share}, section=section)
    return fraction, lambda i: {"section": section}


def sample_arrays(draft: Draft) -> dict[str, Array]:
    """Declare arrays for one n-th of every segment."""
    return {
        name: draft.array(f"{name}_sample", ARC[name], draft.tail.segments)
        for name in ("E", "r", "bend")
    }


def prepare_arc_samples(draft: Draft, state: State, segments: Segments | None) -> Segments:
    """Rotation, position and columns over one n-th of every segment."""
    del segments
    fraction, section = sample_section(draft)
    samples = Segments(state, sample_arrays(draft))
    part, tip = draft.vector("part", 2), draft.vector("tip_sample", 8)
    margin, limit = draft.vector("margin_sample", 1), bend_range(draft)
    for run in draft.tail.runs("continuum"):
        with draft.loop("i", run.stop, start=run.first) as i:
            sample, angles = samples.at(i), {"angles": state.angles(i)}
            shape = shape_step(draft.tail.bend_range / draft.tail.links)
            draft.step(arc.part_of_bend, angles, fraction, part=part)
            draft.step(shape, {"angles": part}, tip=tip)

            # the range is that of whole segments
            draft.step(arc_shape.bend_margin, angles, limit, margin=margin)
            draft.guard(margin, "OUT_OF_RANGE", tip)
            bent = {"angles": part, "tip": tip}
            draft.step(arc.segment_tip, bent, section(i), **sample.only("E", "r", "bend"))
            draft.step(arc.columns_of_bend, sample, fraction, bend=sample["bend"])
    return samples


def bending_torques(draft: Draft) -> Array | None:
    """Declare the generalised forces of all segments' own bends."""
    return draft.array("torque_own", 2, draft.tail.segments)


def move_arc(
    draft: Draft,
    segments: Segments,
    place: Place,
    motion: Motion,
    v_dot: Array | None,
    wrench: Vectors,
    u: Ref | None = None,
) -> None:
    """Store the inertial wrench of one arc and its generalised forces, less those of the air, then
    carry ``w, w_dot, a`` to its tip.
    """
    reads = segments.at(*place), segments.motion(place[0], v_dot), motion
    forced = v_dot is not None
    draft.step(simplified(arc_wrench.segment_wrench, segments.state, forced), *reads, **wrench)
    if u:
        add_drag(draft, segments, place, Vectors({"w": motion.w, "u": u}), wrench)
    draft.step(simplified(arc.segment_motion, segments.state, forced), *reads, **motion)


def each_slice(draft: Draft, piece: Vectors) -> Iterator[Vectors]:
    """Open a loop over the slices of an arc at which the air acts; yields what is known of each."""
    numbers = draft.fixed("slices", SLICES).array
    part = draft.scratch(angles_part=2, section_part=2, tip_part=8)
    found = draft.scratch(E_slice=9, r_slice=3, bend_slice=12)
    angles, section, tip = (part[name] for name in part.named)
    with draft.loop("l", len(SLICES) // 2) as k:
        own = {"slice": numbers.part(2 * k, 2)}
        draft.step(air.part_of_arc, piece, own, angles=angles, section=section)
        draft.step(shape_step(draft.tail.bend_range), {"angles": angles}, tip=tip)
        bent = {"angles": angles, "section": section, "tip": tip}
        at = {name.removesuffix("_slice"): ref for name, ref in found.named.items()}
        draft.step(arc.segment_tip, bent, **at)
        yield Vectors(own | at | {"section": piece["section"]})


def add_drag(
    draft: Draft, segments: Segments, place: Place, velocity: Vectors, wrench: Vectors
) -> None:
    """Add minus the wrench of the air on one arc and its generalised forces, then carry u to its
    tip; w is that of the root.
    """
    piece, rates, own = segments.at(*place), segments.motion(place[0]), widths(draft, place[1])
    adds = {f"{name}_": ref for name, ref in wrench.named.items()}
    for at in each_slice(draft, piece):
        draft.step(air.arc_drag, at, rates, velocity, own, **adds)
    draft.step(arc.segment_velocity, piece, rates, velocity, u=velocity["u"])


def arc_drag_power(
    draft: Draft, segments: Segments, place: Place, virtual_rates: Ref, flow: Vectors, power: Ref
) -> None:
    """Add the power of minus the wrench of the air on one arc, and carry ``u`` to its tip."""
    piece, rates, own = segments.at(*place), segments.motion(place[0]), widths(draft, place[1])
    virtual = {"virtual_rates": virtual_rates}
    for at in each_slice(draft, piece):
        draft.step(air.arc_drag_power, at, rates, virtual, flow, own, power_=power)
    draft.step(arc.segment_velocity, piece, rates, flow, u=flow["u"])


def arc_momentum(
    draft: Draft, segments: Segments, place: Place, velocity: Vectors, writes: Mapping[str, Ref]
) -> None:
    """Give the momentum or kinetic energy of one arc, then carry ``w, u`` to its tip."""
    reads = segments.at(*place), segments.motion(place[0]), velocity
    draft.step(arc_inertia.segment_momentum, *reads, **writes)
    draft.step(arc.segment_velocity, *reads, **velocity)


CONTINUUM = Mechanism(
    prepare=prepare_arcs,
    properties=section_properties,
    data=ARC | OWN,
    describe=describe_arc,
    prepare_samples=prepare_arc_samples,
    declare_torques=bending_torques,
    move=move_arc,
    drag_power=arc_drag_power,
    momentum=arc_momentum,
    pose=arc.segment_pose,
    twist=arc.segment_twist,
    gather=arc_inertia.gather_segment,
    gather_wrench=arc_wrench.gather_segment_wrench,
    gather_moment=arc_inertia.gather_segment_moment,
    power=arc_wrench.segment_power,
)
