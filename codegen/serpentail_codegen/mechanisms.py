"""The tails: for each, which steps describe one piece of a segment, so that the same sweeps serve both.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one piece.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, log2

from .draft import Draft, Tail
from .ir.program import Array, Index, Ref
from .ir.step import Step, specialised
from .mechanics import arc, arc_shape, link
from .mechanics import polar_arc as pol
from .mechanics.lower import derive


@dataclass(frozen=True)
class Mechanism:
    """How one piece moves, what it weighs, and how it passes things on; steps are SymPy functions."""

    pieces: Callable[[Tail], int]
    prepare: Callable[[Draft, bool], None]
    prepare_samples: Callable[[Draft], None]
    pose: Callable
    twist: Callable
    gather: Callable
    gather_wrench: Callable
    gather_moment: Callable
    move: Callable[[Draft, Index, dict[str, Ref], Array | None, Ref], None]
    momentum: Callable[[Draft, Index, dict[str, Ref]], None]
    power: Callable


def still(d: Draft, function: Callable, moving: bool = True):
    """Return a step, specialised to a tail that does not accelerate unless it does, and to rest where the draft is."""
    step = derive(function)
    zeros = {"rest": {"rates": (0, 0), "w": (0, 0, 0)} if d.at_rest else {}, "unforced": {"accelerations": (0, 0)}}
    zeros["unforced"] = {} if moving else zeros["unforced"]
    for name, constants in zeros.items():
        step = specialised(step, f"{step.name}_{name}", **constants) if constants else step
    return step


def motion(d: Draft, i: Index, v_dot: Array | None) -> dict[str, Ref]:
    """Rates, and accelerations if there are any, of segment i."""
    return {"rates": d.rates(i)} | ({"accelerations": v_dot.part(6 + 2 * i, 2)} if v_dot else {})


# ---- articulated: link by link in link-local frames ---------------------------------------------------------------


def prepare_link(d: Draft) -> None:
    """Properties of a link."""
    d.known["share"] = d.constant("share", [Fraction(1, d.tail.total)])[0]
    d.store(link.link_properties, link=6)


def prepare_links(d: Draft, doubled: bool = False) -> None:
    """Link properties, and the trigonometry of every segment's joint."""
    prepare_link(d)
    d.pieces["joint"] = joint = d.array("joint", 4, d.tail.segments)
    twice = d.array("twice", 10, d.tail.segments) if doubled else None
    with d.loop("i", d.tail.segments) as i:
        d.step(link.joint_trigonometry, {"angles": d.angles(i)}, joint=joint[i])
        if doubled:
            d.pieces["twice"] = twice
            d.step(link.double_angles, {"joint": joint[i]}, twice=twice[i])
    d.samples |= d.pieces


def prepare_link_samples(d: Draft) -> None:
    """Tail points are the joints: what describes the links describes them."""
    if not d.samples:
        prepare_links(d)


def move_link(d: Draft, i: Index, here: dict[str, Ref], v_dot: Array | None, wrench: Ref) -> None:
    """Carry ``w, w_dot, a`` over one link and store its inertial wrench."""
    for name in ("a_joint", "swing"):
        if name not in d.known:
            d.vector(name, 3)
    reads = d.known | d.piece(i) | here | motion(d, i, v_dot)
    d.apply(still(d, link.link_motion, bool(v_dot)), reads, a_joint=d.known["a_joint"], swing=d.known["swing"], **here)
    d.apply(still(d, link.link_wrench), d.known | here, F=wrench)


def link_momentum(d: Draft, i: Index, writes: dict[str, Ref]) -> None:
    """Carry ``w, u`` over one link and give its momentum or kinetic energy."""
    if "u_joint" not in d.known:
        d.vector("u_joint", 3)
    reads = d.piece(i) | {"rates": d.rates(i)}
    d.step(link.link_angular_velocity, reads, w=d.known["w"])
    d.step(link.link_linear_velocity, reads, u_joint=d.known["u_joint"], u=d.known["u"])
    d.step(link.link_momentum, **writes)


ARTICULATED = Mechanism(
    pieces=lambda tail: tail.links,
    prepare=prepare_links,
    prepare_samples=prepare_link_samples,
    pose=link.link_pose,
    twist=link.joint_twist,
    gather=link.gather_links,
    gather_wrench=link.gather_wrench,
    gather_moment=link.gather_moment,
    move=move_link,
    momentum=link_momentum,
    power=link.link_power,
)


# ---- continuum: arc by arc in the arcs' root frames ---------------------------------------------------------------

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
    d.samples |= {name: d.array(f"{name}_sample", ARC[name], d.tail.segments) for name in ("E", "r", "bend")}
    part, tip, margin = d.array("part", 2)[0], d.array("tip_sample", 8)[0], d.array("margin_sample", 1)[0]
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
    """Store the inertial wrench of one arc and its generalised forces, then carry ``w, w_dot, a`` to its tip."""
    if "torque_own" not in d.pieces:
        d.pieces["torque_own"] = d.array("torque_own", 2, d.tail.segments)
    reads = d.known | d.piece(i) | here | motion(d, i, v_dot)
    d.apply(still(d, arc.segment_wrench, bool(v_dot)), reads, F=wrench, torque_own=reads["torque_own"])
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


# ---- continuum in polar angles, for comparison: the closed forms of the paper -------------------------------------

POLAR_OWN = {"trig": 4, "E_v": 15, "Q_v": 10, "loading": 27}


def guard_polar(d: Draft, i: Index, *protects: Ref) -> None:
    """Refuse a segment that is straight or bent beyond the range."""
    for name in ("bent", "margin"):
        if name not in d.known:
            d.vector(name, 1)
    d.step(pol.polar_margins, {"angles": d.angles(i)}, bent=d.known["bent"], margin=d.known["margin"])
    for name in ("bent", "margin"):
        d.guard(d.known[name], "OUT_OF_RANGE", *protects)


def prepare_polar_arcs(d: Draft, doubled: bool = False) -> None:
    """Integrals over the slices, tip and own inertia of every segment."""
    del doubled
    d.known["share"] = d.constant("share", [Fraction(1, d.tail.segments)])[0]
    d.store(arc.section_properties, section=2)
    sizes = {name: size for name, size in ARC.items() if name not in ("tip", "shape")} | OWN | POLAR_OWN
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
    d.samples |= {name: d.array(f"{name}_sample", ARC[name], d.tail.segments) for name in ("E", "r", "bend")}
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


def move_polar_arc(d: Draft, i: Index, here: dict[str, Ref], v_dot: Array | None, wrench: Ref) -> None:
    """Store the inertial wrench of one arc and its generalised forces, then carry ``w, w_dot, a`` to its tip."""
    if "torque_own" not in d.pieces:
        d.pieces["torque_own"] = d.array("torque_own", 2, d.tail.segments)
    reads = d.known | d.piece(i) | here | motion(d, i, v_dot)
    d.apply(still(d, pol.segment_loading, bool(v_dot)), reads, loading=reads["loading"])
    d.apply(derive(pol.segment_wrench), reads, F=wrench, torque_own=reads["torque_own"])
    d.apply(still(d, pol.segment_motion, bool(v_dot)), reads, **here)


POLAR = replace(CONTINUUM, prepare=prepare_polar_arcs, prepare_samples=prepare_polar_samples, move=move_polar_arc)


def mechanism_of(tail: Tail) -> Mechanism:
    """Return the steps of a tail."""
    if tail.polar:
        return POLAR
    return {"articulated": ARTICULATED, "continuum": CONTINUUM}[tail.kind]
