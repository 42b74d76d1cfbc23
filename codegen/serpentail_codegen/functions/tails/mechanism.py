"""What a kind of tail must say of itself, so that the same sweeps serve all of them.

A segment of the articulated tail has n pieces, its links; a segment of the continuum tail is one
piece.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ...ir.program import Array, Index, Ref
from ...ir.step import Step, specialised
from ...mechanics.lower import derive
from ..draft import Draft
from ..layout import segment_v
from ..scope import Motion, State, Vectors
from ..tail import Tail

StepFunction = Callable[..., dict]  # a function of mechanics, from which a step is derived


@dataclass(frozen=True)
class Segments:
    """What describes the pieces of all segments: arrays with an entry a segment, and vectors that
    all of them share.
    """

    state: State
    arrays: dict[str, Array]
    shared: Mapping[str, Ref] = field(default_factory=dict)

    def at(self, i: Index) -> Vectors:
        """Return what describes the pieces of segment i, and its coordinates."""
        entries = {name: array[i] for name, array in self.arrays.items()}
        return Vectors(entries | dict(self.shared) | {"angles": self.state.angles(i)})

    def motion(self, i: Index, v_dot: Array | None = None) -> Vectors:
        """Return the rates of segment i if it moves, and its accelerations if there are any."""
        named = {"rates": self.state.rates(i)} if self.state.v else {}
        if v_dot:
            named["accelerations"] = segment_v(v_dot, i)
        return Vectors(named)


@dataclass(frozen=True)
class Wrenches:
    """Wrenches (or momenta) of all pieces, and the generalised forces of bends themselves."""

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
    """How one piece moves, what it weighs, and how it passes things on.

    ``prepare(draft, state, doubled)`` stores what describes the pieces, ``prepare_samples`` what
    lies between two tail points, given what describes the pieces if that is there.
    ``declare_torques`` declares what ``move`` stores a bend's own generalised forces in.
    ``move(draft, segments, i, motion, v_dot, wrench)`` carries the motion over a piece and stores
    its inertial wrench; ``momentum(draft, segments, i, velocity, writes)`` carries angular and
    linear velocity ``w, u`` and gives momentum or kinetic energy.  The others are steps.
    """

    pieces: Callable[[Tail], int]
    prepare: Callable[[Draft, State, bool], Segments]
    prepare_samples: Callable[[Draft, State, Segments | None], Segments]
    declare_torques: Callable[[Draft], Array | None]
    move: Callable[[Draft, Segments, Index, Motion, Array | None, Vectors], None]
    momentum: Callable[[Draft, Segments, Index, Vectors, Mapping[str, Ref]], None]
    pose: StepFunction
    twist: StepFunction
    gather: StepFunction
    gather_wrench: StepFunction
    gather_moment: StepFunction
    power: StepFunction


def simplified(function: StepFunction, state: State, forced: bool = True) -> Step:
    """Return a step, specialised to an animal at rest or to a tail that does not accelerate."""
    step = derive(function)
    if state.v is None:
        step = specialised(step, f"{step.name}_rest", rates=(0, 0), w=(0, 0, 0))
    if not forced:
        step = specialised(step, f"{step.name}_unforced", accelerations=(0, 0))
    return step
