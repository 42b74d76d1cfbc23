"""The tails: for each, which steps describe one piece of a segment, so that the same sweeps serve
both.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from fractions import Fraction
from math import ceil, log2

from ...ir.program import Array, Index, Ref
from ...ir.step import Step
from ...mechanics import arc, arc_shape
from ...mechanics.lower import derive
from ..draft import Draft
from .mechanism import Mechanism, motion, still

# ---- continuum: arc by arc in the arcs' root frames ----------------------------------------------

ARC = {"tip": 8, "shape": 16, "E": 9, "r": 3, "bend": 12}
OWN = {"h_own": 3, "I_own": 6, "pitch_own": 6, "yaw_own": 6, "H_own": 3}


def shape_step(bend_range: float) -> Step:
    """Return the step of a segment's shape with as many quadruplings as the range needs."""
    levels = max(0, ceil(log2(bend_range / arc_shape.SERIES_REACH)))
    return derive(arc_shape.segment_shape, levels=levels)


def prepare_arcs(d: Draft, doubled: bool = False) -> None:
    """Shape, tip and own inertia of every segment."""
    del doubled
    d.known["share"] = d.constant("share", [Fraction(1, d.tail.segments)])[0]
    d.store(arc.section_properties, section=2)
    d.pieces |= {name: d.array(name, size, d.tail.segments) for name, size in (ARC | OWN).items()}
    d.known["bend_range"] = d.constant("bend_range", [d.tail.bend_range])[0]
    margin = d.array("margin", 1)[0]
    with d.loop("i", d.tail.segments) as i:
        piece = d.piece(i)
        d.apply(shape_step(d.tail.bend_range), piece, tip=piece["tip"], shape=piece["shape"])
        d.step(arc_shape.bend_margin, piece, margin=margin)
        d.guard(margin, "OUT_OF_RANGE", piece["tip"], piece["shape"])
        d.step(arc.segment_tip, piece, E=piece["E"], r=piece["r"], bend=piece["bend"])
        d.step(arc.segment_inertia, piece, **{name: piece[name] for name in OWN})


def prepare_arc_samples(d: Draft) -> None:
    """Rotation, position and columns over one n-th of every segment."""
    fraction = Fraction(1, d.tail.links)
    d.known["fraction"] = d.constant("fraction", [fraction])[0]
    d.known["share"] = d.constant("share_sample", [fraction / d.tail.segments])[0]
    d.step(arc.section_properties, section=d.array("section_sample", 2)[0])
    section = {"section": next(a for a in d.arrays if a.name == "section_sample")[0]}
    d.samples |= {
        name: d.array(f"{name}_sample", ARC[name], d.tail.segments) for name in ("E", "r", "bend")
    }
    part, tip, margin = (
        d.array("part", 2)[0],
        d.array("tip_sample", 8)[0],
        d.array("margin_sample", 1)[0],
    )
    if "bend_range" not in d.known:
        d.known["bend_range"] = d.constant("bend_range", [d.tail.bend_range])[0]
    with d.loop("i", d.tail.segments) as i:
        sample = d.sample(i)
        d.step(arc.part_of_bend, {"angles": d.angles(i)}, part=part)
        d.apply(shape_step(d.tail.bend_range / d.tail.links), {"angles": part}, tip=tip)
        d.step(arc_shape.bend_margin, {"angles": d.angles(i)}, margin=margin)
        d.guard(margin, "OUT_OF_RANGE", tip)
        d.step(arc.segment_tip, {"angles": part, "tip": tip} | section, **sample)
        d.step(arc.columns_of_bend, sample, bend=sample["bend"])


def move_arc(d: Draft, i: Index, here: dict[str, Ref], v_dot: Array | None, wrench: Ref) -> None:
    """Store the inertial wrench of one arc and its generalised forces, then carry ``w, w_dot, a``
    to its tip.
    """
    if "torque_own" not in d.pieces:
        d.pieces["torque_own"] = d.array("torque_own", 2, d.tail.segments)
    reads = d.known | d.piece(i) | here | motion(d, i, v_dot)
    d.apply(
        still(d, arc.segment_wrench, bool(v_dot)), reads, F=wrench, torque_own=reads["torque_own"]
    )
    d.apply(still(d, arc.segment_motion, bool(v_dot)), reads, **here)


def arc_momentum(d: Draft, i: Index, writes: dict[str, Ref]) -> None:
    """Give the momentum or kinetic energy of one arc, then carry ``w, u`` to its tip."""
    reads = d.piece(i) | {"rates": d.rates(i)}
    d.step(arc.segment_momentum, reads, **writes)
    d.step(arc.segment_velocity, reads, w=d.known["w"], u=d.known["u"])


CONTINUUM = Mechanism(
    pieces=lambda tail: 1,
    prepare=prepare_arcs,
    prepare_samples=prepare_arc_samples,
    pose=arc.segment_pose,
    twist=arc.segment_twist,
    gather=arc.gather_segment,
    gather_wrench=arc.gather_segment_wrench,
    gather_moment=arc.gather_segment_moment,
    move=move_arc,
    momentum=arc_momentum,
    power=arc.segment_power,
)
