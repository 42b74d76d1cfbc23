"""The articulated tail: link by link, in the frames of the links."""

from collections.abc import Mapping
from fractions import Fraction

from ...ir.program import Array, Index, Ref
from ...mechanics import link
from ..draft import Draft
from ..scope import Motion, State, Vectors
from .mechanism import Mechanism, Segments, simplified


def link_properties(draft: Draft) -> Vectors:
    """Store the properties of a link, all being equal."""
    share = draft.fixed("share", [Fraction(1, draft.tail.total)])
    return draft.store(link.link_properties, {"share": share}, link=6)


def prepare_links(draft: Draft, state: State, doubled: bool = False) -> Segments:
    """Link properties, and the trigonometry of every segment's joint."""
    properties = link_properties(draft)
    arrays = {"joint": draft.array("joint", 4, draft.tail.segments)}
    if doubled:
        arrays["twice"] = draft.array("twice", 10, draft.tail.segments)
    with draft.loop("i", draft.tail.segments) as i:
        joint = arrays["joint"][i]
        draft.step(link.joint_trigonometry, {"angles": state.angles(i)}, joint=joint)
        if doubled:
            draft.step(link.double_angles, {"joint": joint}, twice=arrays["twice"][i])
    return Segments(state, arrays, properties.named)


def prepare_link_samples(draft: Draft, state: State, segments: Segments | None) -> Segments:
    """Tail points are the joints: what describes the links describes them."""
    return segments or prepare_links(draft, state)


def no_torques(draft: Draft) -> Array | None:
    """A link does not bend."""
    return None


def move_link(
    draft: Draft,
    segments: Segments,
    i: Index,
    motion: Motion,
    v_dot: Array | None,
    wrench: Vectors,
) -> None:
    """Carry ``w, w_dot, a`` over one link and store its inertial wrench."""
    joint = draft.vectors(a_joint=3, swing=3)
    draft.step(
        simplified(link.link_motion, segments.state, v_dot is not None),
        segments.at(i),
        segments.motion(i, v_dot),
        motion,
        **joint,
        **motion,
    )
    inertial = simplified(link.link_wrench, segments.state)
    draft.step(inertial, segments.at(i), motion, joint, F=wrench["F"])


def link_momentum(
    draft: Draft, segments: Segments, i: Index, velocity: Vectors, writes: Mapping[str, Ref]
) -> None:
    """Carry ``w, u`` over one link and give its momentum or kinetic energy."""
    piece, rates = segments.at(i), segments.motion(i)
    joint = draft.vectors(u_joint=3)
    draft.step(link.link_angular_velocity, piece, rates, velocity, w=velocity["w"])
    draft.step(link.link_linear_velocity, piece, velocity, u=velocity["u"], **joint)
    draft.step(link.link_momentum, piece, velocity, joint, **writes)


ARTICULATED = Mechanism(
    pieces=lambda tail: tail.links,
    prepare=prepare_links,
    prepare_samples=prepare_link_samples,
    declare_torques=no_torques,
    move=move_link,
    momentum=link_momentum,
    pose=link.link_pose,
    twist=link.joint_twist,
    gather=link.gather_links,
    gather_wrench=link.gather_wrench,
    gather_moment=link.gather_moment,
    power=link.link_power,
)
