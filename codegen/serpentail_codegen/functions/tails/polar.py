"""The tails: for each, which steps describe one piece of a segment, so that the same sweeps serve
both.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from dataclasses import replace
from fractions import Fraction

from ...ir.program import Array, Index, Ref
from ...mechanics import arc
from ...mechanics import polar_arc as pol
from ...mechanics.lower import derive
from ..draft import Draft
from .continuum import ARC, CONTINUUM, OWN
from .mechanism import motion, still

# ---- continuum in polar angles, for comparison: the closed forms of the paper --------------------

POLAR_OWN = {"trig": 4, "E_v": 15, "Q_v": 10, "loading": 27}


def guard_polar(d: Draft, i: Index, *protects: Ref) -> None:
    """Refuse a segment that is straight or bent beyond the range."""
    for name in ("bent", "margin"):
        if name not in d.known:
            d.vector(name, 1)
    d.step(
        pol.polar_margins, {"angles": d.angles(i)}, bent=d.known["bent"], margin=d.known["margin"]
    )
    for name in ("bent", "margin"):
        d.guard(d.known[name], "OUT_OF_RANGE", *protects)


def prepare_polar_arcs(d: Draft, doubled: bool = False) -> None:
    """Integrals over the slices, tip and own inertia of every segment."""
    del doubled
    d.known["share"] = d.constant("share", [Fraction(1, d.tail.segments)])[0]
    d.store(arc.section_properties, section=2)
    sizes = (
        {name: size for name, size in ARC.items() if name not in ("tip", "shape")} | OWN | POLAR_OWN
    )
    d.pieces |= {name: d.array(name, size, d.tail.segments) for name, size in sizes.items()}
    d.known["bend_range"] = d.constant("bend_range", [d.tail.bend_range])[0]
    with d.loop("i", d.tail.segments) as i:
        piece = d.piece(i)
        d.step(pol.segment_trigonometry, piece, trig=piece["trig"])
        d.step(pol.slice_integrals, piece, E_v=piece["E_v"], Q_v=piece["Q_v"])
        guard_polar(d, i, piece["trig"], piece["E_v"], piece["Q_v"])
        d.step(pol.segment_tip, piece, E=piece["E"], r=piece["r"], bend=piece["bend"])
        d.step(pol.segment_inertia, piece, **{name: piece[name] for name in OWN})


def prepare_polar_samples(d: Draft) -> None:
    """Rotation, position and columns over one n-th of every segment."""
    fraction = Fraction(1, d.tail.links)
    d.known["fraction"] = d.constant("fraction", [fraction])[0]
    d.known["share"] = d.constant("share_sample", [fraction / d.tail.segments])[0]
    section = d.array("section_sample", 2)[0]
    d.step(arc.section_properties, section=section)
    d.samples |= {
        name: d.array(f"{name}_sample", ARC[name], d.tail.segments) for name in ("E", "r", "bend")
    }
    part, trig = d.array("part", 2)[0], d.array("trig_sample", 4)[0]
    if "bend_range" not in d.known:
        d.known["bend_range"] = d.constant("bend_range", [d.tail.bend_range])[0]
    with d.loop("i", d.tail.segments) as i:
        sample = d.sample(i)
        d.step(pol.part_of_arc, {"angles": d.angles(i)}, part=part)
        d.step(pol.segment_trigonometry, {"angles": part}, trig=trig)
        guard_polar(d, i, trig)
        d.step(pol.segment_tip, {"angles": part, "trig": trig, "section": section}, **sample)
        d.step(pol.columns_of_arc, sample, bend=sample["bend"])


def move_polar_arc(
    d: Draft, i: Index, here: dict[str, Ref], v_dot: Array | None, wrench: Ref
) -> None:
    """Store the inertial wrench of one arc and its generalised forces, then carry ``w, w_dot, a``
    to its tip.
    """
    if "torque_own" not in d.pieces:
        d.pieces["torque_own"] = d.array("torque_own", 2, d.tail.segments)
    reads = d.known | d.piece(i) | here | motion(d, i, v_dot)
    d.apply(still(d, pol.segment_loading, bool(v_dot)), reads, loading=reads["loading"])
    d.apply(derive(pol.segment_wrench), reads, F=wrench, torque_own=reads["torque_own"])
    d.apply(still(d, pol.segment_motion, bool(v_dot)), reads, **here)


POLAR = replace(
    CONTINUUM,
    prepare=prepare_polar_arcs,
    prepare_samples=prepare_polar_samples,
    move=move_polar_arc,
)
