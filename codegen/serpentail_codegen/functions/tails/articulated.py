"""The articulated tail: link by link, in the frames of the links."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction

from ...ir.program import Array, Ref
from ...mechanics import air, link
from ...mechanics.ratio import WITH_RATIO
from ...scene.variant import SegmentRun
from ..draft import Draft
from ..scope import Instead, Motion, State, Vectors
from .mechanism import Mechanism, Place, Segments, StepFunction, in_turn, simplified, widths

JOINT = {"joint": 4, "twice": 10}
SIZES = {"link_inertias": 3}  # parameters with more than one number for each link


def of_joint(draft: Draft, function: StepFunction) -> StepFunction:
    """Return a step of mechanics for joints that turn by the segment's angles, or by a share."""
    return WITH_RATIO[function] if draft.tail.shape.ratios else function


def own_links(draft: Draft) -> Array:
    """Store the properties of every link from its own mass, length, COM and inertia, one after
    another.
    """
    array = draft.array("link", 6, draft.tail.pieces)
    fill_links(draft, array, lambda run: run.other_pieces)
    return array


def fill_links(draft: Draft, array: Array, others: Callable[[SegmentRun], int]) -> None:
    """Store the properties of every link; ``others``: entries of the array before, of arcs."""
    names = ("link_masses", "link_lengths", "link_centers", "link_inertias")
    for run in draft.tail.runs("articulated"):
        with draft.loop("g", run.stop_piece, start=run.first_piece) as g:
            k = g + -run.other_pieces
            own = {name: draft.entry(name, k, SIZES.get(name, 1)) for name in names}
            draft.step(link.own_link_properties, Instead(own), link=array[k + others(run)])


def link_properties(draft: Draft, state: State) -> Segments:
    """Store the properties of every link, or those of one link if all are equal."""
    if draft.tail.shape.own:
        return Segments(state, {}, {}, {"link": own_links(draft)})
    share = draft.fixed("share", [Fraction(1, draft.tail.total)])
    return Segments(state, {}, draft.store(link.link_properties, {"share": share}, link=6).named)


def describe_joint(draft: Draft, piece: Vectors) -> None:
    """Store the trigonometry of a segment's joint, and that of twice its angles if wanted."""
    joint = piece.only("joint")
    draft.step(of_joint(draft, link.joint_trigonometry), piece, **joint)
    if "twice" in piece.named:
        draft.step(link.double_angles, joint, **piece.only("twice"))


def prepare_links(draft: Draft, state: State, doubled: bool = False) -> Segments:
    """Link properties, and the trigonometry of every segment's joint."""
    sizes = JOINT if doubled else {"joint": JOINT["joint"]}
    own = link_properties(draft, state)
    if draft.tail.shape.ratios:
        return prepare_each_joint(draft, own, sizes)
    return in_turn(draft, "articulated", own, sizes, describe_joint)


def prepare_each_joint(draft: Draft, own: Segments, sizes: Mapping[str, int]) -> Segments:
    """Return the data of links whose joints have ratios: each has trigonometry of its own."""
    count = draft.tail.pieces
    each = {name: draft.array(name, size, count) for name, size in sizes.items()}
    ratios = draft.parameters["joint_ratios"].array  # number by number
    each["ratio"] = replace(ratios, size=1, count=count)
    segments = replace(own, each={**own.each, **each})
    for stretch in draft.tail.stretches:
        n = stretch.pieces
        with draft.loop("i", stretch.stop, start=stretch.first) as i, draft.loop("j", n) as j:
            describe_joint(
                draft, segments.at(i, n * i + j + (stretch.first_piece - n * stretch.first))
            )
    return segments


def prepare_link_samples(draft: Draft, state: State, segments: Segments | None) -> Segments:
    """The tail points are the joints, so the data of the links serve for them, too."""
    return segments or prepare_links(draft, state)


def no_torques(draft: Draft) -> Array | None:
    """Return nothing: a link does not bend."""
    return None


def move_link(
    draft: Draft,
    segments: Segments,
    place: Place,
    motion: Motion,
    v_dot: Array | None,
    wrench: Vectors,
    u: Ref | None = None,
) -> None:
    """Carry ``w, w_dot, a`` over one link and store its inertial wrench, less that of the air."""
    joint = draft.scratch(a_joint=3, swing=3)
    piece = segments.at(*place)
    draft.step(
        simplified(of_joint(draft, link.link_motion), segments.state, v_dot is not None),
        piece,
        segments.motion(place[0], v_dot),
        motion,
        **joint,
        **motion,
    )
    inertial = simplified(link.link_wrench, segments.state)
    draft.step(inertial, piece, motion, joint, F=wrench["F"])
    if u:
        add_drag(draft, segments, place, Vectors({"w": motion.w, "u": u}), wrench)


def add_drag(
    draft: Draft, segments: Segments, place: Place, velocity: Vectors, wrench: Vectors
) -> None:
    """Carry u over one link, which turns with w, and add minus the wrench of the air."""
    piece, joint = segments.at(*place), draft.scratch(u_joint=3)
    draft.step(link.link_linear_velocity, piece, velocity, u=velocity["u"], **joint)
    draft.step(air.link_drag, piece, velocity, joint, widths(draft, place[1]), F_=wrench["F"])


def link_drag_power(
    draft: Draft, segments: Segments, place: Place, virtual_rates: Ref, flow: Vectors, power: Ref
) -> None:
    """Carry ``u`` over one link and add the power of minus the wrench of the air."""
    reads = segments.at(*place), segments.motion(place[0]), {"virtual_rates": virtual_rates}
    own = widths(draft, place[1])
    draft.step(of_joint(draft, air.link_drag_power), *reads, flow, own, power_=power, u=flow["u"])


def link_momentum(
    draft: Draft, segments: Segments, place: Place, velocity: Vectors, writes: Mapping[str, Ref]
) -> None:
    """Carry ``w, u`` over one link and give its momentum or kinetic energy."""
    piece, rates = segments.at(*place), segments.motion(place[0])
    joint = draft.scratch(u_joint=3)
    turn = of_joint(draft, link.link_angular_velocity)
    draft.step(turn, piece, rates, velocity, w=velocity["w"])
    draft.step(link.link_linear_velocity, piece, velocity, u=velocity["u"], **joint)
    draft.step(link.link_momentum, piece, velocity, joint, **writes)


ARTICULATED = Mechanism(
    prepare=prepare_links,
    properties=link_properties,
    data=JOINT,
    describe=describe_joint,
    prepare_samples=prepare_link_samples,
    declare_torques=no_torques,
    move=move_link,
    drag_power=link_drag_power,
    momentum=link_momentum,
    pose=link.link_pose,
    twist=link.joint_twist,
    gather=link.gather_links,
    gather_wrench=link.gather_wrench,
    gather_moment=link.gather_moment,
    power=link.link_power,
)
WITH_RATIOS = replace(
    ARTICULATED,
    twist=WITH_RATIO[link.joint_twist],
    gather=WITH_RATIO[link.gather_links],
    gather_wrench=WITH_RATIO[link.gather_wrench],
    power=WITH_RATIO[link.link_power],
)
