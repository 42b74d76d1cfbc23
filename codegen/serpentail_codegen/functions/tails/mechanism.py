"""What a kind of tail must define so that the same sweeps serve all kinds.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from ...ir.program import Array, Index, Ref
from ...ir.step import Step, specialised
from ...mechanics.lower import derived
from ..draft import Draft
from ..scope import Instead, State, Vectors

StepFunction = Callable[..., dict]  # a function of mechanics, from which a step is derived
Place = tuple[Index, Index]  # a segment, and a piece


@dataclass(frozen=True)
class Segments:
    """The data of the pieces of all segments: arrays with an entry for each segment, vectors that
    all segments share, and arrays with an entry for each piece.
    """

    state: State
    arrays: dict[str, Array]
    shared: Mapping[str, Ref] = field(default_factory=dict)
    each: Mapping[str, Array] = field(default_factory=dict)

    def at(self, i: Index, g: Index | None = None) -> Vectors:
        """Return the data of piece g of segment i, and the coordinates of the segment."""
        entries = {name: array[i] for name, array in self.arrays.items()}
        own = {} if g is None else {name: array[g] for name, array in self.each.items()}
        shared = dict(self.shared) | {"angles": self.state.angles(i)}
        return Vectors(entries | own | shared)

    def motion(self, i: Index, v_dot: Array | None = None) -> Vectors:
        """Return the rates of segment i if it moves, and its accelerations if there are any."""
        named = {"rates": self.state.rates(i)} if self.state.v else {}
        accelerations = self.state.accelerations(i, v_dot)
        return Vectors(named | ({"accelerations": accelerations} if accelerations else {}))


def in_turn(
    draft: Draft,
    kind: str,
    own: Segments,
    sizes: Mapping[str, int],
    describe: Callable[[Draft, Vectors], None],
) -> Segments:
    """Return the properties of segments, and their data, computed segment by segment."""
    count = draft.tail.segments
    arrays = {name: draft.array(name, size, count) for name, size in sizes.items()}
    segments = replace(own, arrays=arrays | own.arrays)
    for run in draft.tail.runs(kind):
        with draft.loop("i", run.stop, start=run.first) as i:
            describe(draft, segments.at(i))
    return segments


@dataclass(frozen=True)
class Wrenches:
    """Wrenches (or momenta) of all pieces, and the generalised forces of the bends."""

    F: Array
    torque_own: Array | None = None

    def at(self, i: Index, g: Index) -> Vectors:
        """Return what acts on piece g, which is of segment i."""
        named = {"F": self.F[g]}
        if self.torque_own:
            named["torque_own"] = self.torque_own[i]
        return Vectors(named)


@dataclass(frozen=True)
class Mechanism:
    """How one piece moves, its mass properties, and how it passes quantities on.

    ``prepare(draft, state, doubled)`` stores the data of the pieces: their ``properties(draft,
    state)``, which are constant, and ``data`` (sizes) of each segment, which
    ``describe(draft, piece)`` computes from its coordinates.
    ``prepare_samples`` stores the data of what lies between two tail points; it is given the data
    of the pieces if they exist.
    ``declare_torques`` declares the array in which ``move`` stores the generalised forces of bends.
    ``move(draft, segments, place, motion, v_dot, wrench, u)`` carries the motion over a piece and
    stores its inertial wrench, less that of the air if ``u``, a velocity against it, is given.
    ``drag_power(draft, segments, place, virtual_rates, flow, power)`` carries ``u`` of a flow over
    a piece and adds the power of minus the wrench of the air under a virtual motion.
    ``momentum(draft, segments, place, velocity, writes)`` carries angular and linear velocity ``w,
    u`` over a piece and gives momentum or kinetic energy.
    A place is a segment and one of its pieces. The other fields are steps.
    """

    prepare: Callable[[Draft, State, bool], Segments]
    properties: Callable[[Draft, State], Segments]
    data: Mapping[str, int]
    describe: Callable[[Draft, Vectors], None]
    prepare_samples: Callable[[Draft, State, Segments | None], Segments]
    declare_torques: Callable[[Draft], Array | None]
    move: Callable[..., None]
    drag_power: Callable[[Draft, Segments, Place, Ref, Vectors, Ref], None]
    momentum: Callable[[Draft, Segments, Place, Vectors, Mapping[str, Ref]], None]
    pose: StepFunction | Step
    twist: StepFunction | Step
    gather: StepFunction | Step
    gather_wrench: StepFunction | Step
    gather_moment: StepFunction | Step
    power: StepFunction | Step


def simplified(function: StepFunction | Step, state: State, forced: bool = True) -> Step:
    """Return a step, specialised to an animal at rest or to a tail that does not accelerate."""
    step, none = derived(function), (0,) * state.tail.width
    forced = forced or state.tail.prescribed
    if state.v is None:
        step = specialised(step, f"{step.name}_rest", rates=none, w=(0, 0, 0))
    if not forced:
        step = specialised(step, f"{step.name}_unforced", accelerations=none)
    return step


def widths(draft: Draft, g: Index) -> Instead:
    """Return the widths at both ends of piece g."""
    return Instead({"tail_widths": draft.parameters["tail_widths"].array.part(g, 2)})
