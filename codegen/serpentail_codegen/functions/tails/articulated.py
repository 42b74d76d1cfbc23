"""The tails: for each, which steps describe one piece of a segment, so that the same sweeps serve
both.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from fractions import Fraction

from ...ir.program import Array, Index, Ref
from ...mechanics import link
from ..draft import Draft
from .mechanism import Mechanism, motion, still

# ---- articulated: link by link in link-local frames ----------------------------------------------


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
    d.apply(
        still(d, link.link_motion, bool(v_dot)),
        reads,
        a_joint=d.known["a_joint"],
        swing=d.known["swing"],
        **here,
    )
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
