"""A limb: hinge by hinge, each about an axis of its own, with a body or without."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial

from ...ir.program import Array, Ref
from ...ir.step import Step
from ...mechanics import hinge
from ...mechanics.lower import declared_shapes, derive
from ..draft import Draft
from ..scope import Instead, Motion, State, Vectors
from .mechanism import Mechanism, Place, Segments, simplified
from .mixed import NOTHING

BODIES = {"limb": hinge.along_body, "placed_limb": hinge.placed_body}
BARE = "bare"  # ends the kind of hinges without bodies


def prepare_hinges(draft: Draft, state: State, doubled: bool = False) -> Segments:
    """Bodies and rotors, and the trigonometry of every hinge."""
    tail, bodies, fill = draft.tail, 0, BODIES[draft.tail.kind]
    sizes = {"joint": 2, "body": 13} | ({"twice": 5} if doubled else {})
    arrays = {name: draft.array(name, size, tail.segments) for name, size in sizes.items()}
    if tail.shape.rotors:  # the parameter, number by number
        rotors = draft.parameters["rotors"].array
        arrays["rotor"] = replace(rotors, size=1, count=tail.segments)
    segments = Segments(state, arrays)
    for stretch in tail.stretches:
        with draft.loop("i", stretch.stop, start=stretch.first) as i:
            own, k = segments.at(i), i + (bodies - stretch.first)
            if not stretch.kind.endswith(BARE):
                shapes = declared_shapes(fill).items()
                entries = {name: draft.entry(name, k, size) for name, (size, _) in shapes}
                draft.step(fill, Instead(entries), body=own["body"])
            draft.step(hinge.hinge_trigonometry, own, joint=own["joint"])
            if doubled:
                draft.step(hinge.hinge_double_angle, own, twice=own["twice"])
        bodies += 0 if stretch.kind.endswith(BARE) else stretch.stop - stretch.first
    return segments


def samples_of_hinges(draft: Draft, state: State, segments: Segments | None) -> Segments:
    """The points are the joints and the tip, so the data of the hinges serve for them, too."""
    return segments or prepare_hinges(draft, state)


def rotor_torques(draft: Draft) -> Array | None:
    """Declare the torques of all rotors."""
    return draft.array("torque_own", 1, draft.tail.segments)


def move_hinge(
    step: Step,
    draft: Draft,
    segments: Segments,
    place: Place,
    motion: Motion,
    v_dot: Array | None,
    wrench: Vectors,
) -> None:
    """Carry ``w, w_dot, a`` over one hinge and store the inertial wrench of its body."""
    simple = simplified(step, segments.state, v_dot is not None)
    moving = segments.motion(place[0], v_dot)
    draft.step(simple, segments.at(*place), moving, motion, **wrench, **motion)


def hinge_momentum(
    step: Step,
    draft: Draft,
    segments: Segments,
    place: Place,
    velocity: Vectors,
    writes: Mapping[str, Ref],
) -> None:
    """Carry ``w, u`` over one hinge and give the momentum or kinetic energy of its body."""
    moving = segments.motion(place[0])
    draft.step(step, segments.at(*place), moving, velocity, **writes, **velocity)


@cache
def limb(kind: str, geared: bool, hinges: str = "") -> Mechanism:
    """Return the steps of hinges of one kind, such as "x" or "y_bare"; outside of loops over
    segments only the data of all hinges are there.
    """
    steps = {**NOTHING, "prepare": prepare_hinges, "prepare_samples": samples_of_hinges}
    steps["declare_torques"] = rotor_torques
    if hinges:
        own = hinges + "_along" * (kind == "limb" and BARE not in hinges) + "_geared" * geared
        names = {"pose": hinge.hinge_pose, "twist": hinge.hinge_twist, "power": hinge.hinge_power}
        names |= {"gather": hinge.gather_hinge, "gather_wrench": hinge.gather_hinge_wrench}
        names |= {"gather_moment": hinge.gather_hinge_moment}
        steps |= {name: derive(function, kind=own) for name, function in names.items()}
        steps["move"] = partial(move_hinge, derive(hinge.hinge_motion, kind=own))
        steps["momentum"] = partial(hinge_momentum, derive(hinge.hinge_momentum, kind=own))
    return Mechanism(**steps)
