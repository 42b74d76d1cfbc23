"""``Sequence``: one motion of several phases; each begins at the end of the one before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..basics.checks import number, refusal
from ..basics.errors import PlanningError, SimulationError
from ..basics.near_names import NearNames
from ..basics.short_repr import brief
from ..model.model import Model
from ..model.state import State, parted
from ..motion.ground import peaks
from ..motion.trajectory import Trajectory
from ..simulation.controllers.controller import Controller, Phases, parts_of
from ..simulation.controllers.moves import TOUCH_DOWN
from ..simulation.controllers.schedules import Legs
from ..simulation.ground import LANDED_AT
from ..simulation.simulate import simulate
from .flight import planned_flight
from .phase import AIRBORNE, BEFORE, Event, Phase
from .run import PhaseRun, SequenceRun, motion_until, whole

TOUCH = f"{TOUCH_DOWN} of feet"  # what ends a phase after which legs yield at once
SAMPLES = 400  # of a phase, to find when it is clear of the ground


@dataclass(frozen=True, eq=False)
class PhaseStart:
    """The state in which a phase begins: time (s) of the motion, q, v, and friction springs."""

    time: float
    q: np.ndarray
    v: np.ndarray
    bristles: ArrayLike | None


@dataclass(frozen=True, eq=False)
class Sequence(NearNames):
    """A motion of several phases, such as a jump, a planned flight and a landing.

    Each phase has its own clock and begins in the state in which the one before ends; plans are
    made for that state.

    Parameters
    ----------
    model : Model
        The model.
    phases : sequence of Phase
        The phases, with different names.
    gamma, delta : float, optional
        Leg angles at the start (rad), of both legs; required if the model has feet. Later they
        follow the moves of the phases.
    settings : mapping, optional
        Arguments of ``simulate`` for all phases, such as method, rtol, atol, output_step.

    Raises
    ------
    SimulationError
        A phase or a setting is wrong.

    Examples
    --------
    >>> right = st.Phase("right", 0.5, until="landing", plan={"goal": "upright"})  # doctest: +SKIP
    >>> sequence = st.Sequence(model, [right], gamma=3.67, delta=-0.26)  # doctest: +SKIP
    >>> run = sequence.simulate(q0, v0)  # doctest: +SKIP
    >>> run.complete, run.trajectory.warnings  # doctest: +SKIP
    """

    model: Model
    phases: list[Phase] | tuple[Phase, ...]
    gamma: Any = None  # numbers or texts; then numbers
    delta: Any = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the phases against each other and the model."""
        try:
            phases = tuple(self.phases)
        except TypeError:
            raise refusal("phases", self.phases, "a list of st.Phase", SimulationError) from None
        if not phases or not all(isinstance(phase, Phase) for phase in phases):
            raise refusal("phases", self.phases, "a list of st.Phase", SimulationError)
        names = [phase.name for phase in phases]
        for name in names:
            if names.count(name) > 1:
                raise SimulationError(f"phases: two are called {name!r}: give each its own name")
        object.__setattr__(self, "phases", phases)
        for name, angle in (("gamma", self.gamma), ("delta", self.delta)):
            if "feet" in self.model.contacts:
                plain = number(f"Sequence: {name}", angle, SimulationError, unit="rad")
                object.__setattr__(self, name, plain)
            elif angle is not None:
                raise SimulationError(
                    f"Sequence: {name}: {self.model.name} has no legs: leave it out"
                )
        for phase in phases:
            _check_phase(self.model, phase)

    def simulate(
        self,
        q0: ArrayLike | State,
        v0: ArrayLike | None = None,
        bristles0: ArrayLike | None = None,
    ) -> SequenceRun:
        """Make the motion from a start.

        A phase with an end event that does not occur within its duration ends the motion. Then
        ``complete`` is False, and a warning of the trajectory says so.

        Parameters
        ----------
        q0, v0 : array_like, shapes (nq,) and (nv,)
            State at the start; or one argument, as of ``simulate``.
        bristles0 : array_like, shape (points, 2), optional
            As of ``simulate``.

        Returns
        -------
        SequenceRun
            The motion and the outcome of each phase.

        Raises
        ------
        SimulationError, PlanningError
            As of ``simulate`` and ``plan``, with the phase's name. The ``trajectory`` of a
            SimulationError is the motion up to there.
        StateError, ModelError, ExtraMissing
            As of ``simulate`` and ``plan``.
        """
        q, v = (np.asarray(part, float) for part in parted(self.model, q0, v0)[0])
        start = PhaseStart(0.0, q, v, bristles0)
        parts: list[Trajectory] = []
        runs: list[PhaseRun] = []
        moves: list[dict[str, Any]] = []
        complete = True
        for phase in self.phases:
            controller, plan, landing = phase.controller, None, None
            try:
                # what acts: the controller, or the plan for the state in which the phase begins
                if phase.plan:
                    angles = self.last_angles(phase, moves)
                    flight = planned_flight(self.model, phase, (start.q, start.v), angles)
                    controller, plan, landing = flight.controller, flight.plan, flight.landing
                touches = bool(runs) and runs[-1].ended_by == TOUCH
                moves += [timed(move, start.time, landing, touches) for move in phase.moves]
                motion, ended_by = self._made(phase, controller, start, moves)
            except (SimulationError, PlanningError) as error:
                named = type(error)(f"phase {phase.name!r}: {error}")
                if isinstance(named, SimulationError):
                    named.trajectory = motion_until(parts, getattr(error, "trajectory", None))
                raise named from error
            except KeyboardInterrupt as stop:
                vars(stop)["motion"] = motion_until(parts, getattr(stop, "motion", None))
                raise

            # the next phase begins where this one ends
            parts.append(motion)
            moves = [*_begun(moves, motion.info.get(LANDED_AT))]
            end = float(motion.t[-1])
            peak = peaks(motion)["all"].force if motion.contact else 0.0
            runs.append(PhaseRun(phase.name, start.time, end, ended_by, plan, peak))
            bristles = None if motion.contact is None else motion.contact.bristles[-1]
            start = PhaseStart(end, motion.q[-1], motion.v[-1], bristles)
            if phase.until is not None and ended_by == "duration":
                complete = False
                break
        return SequenceRun(whole(parts, runs, self.phases), tuple(runs), complete)

    def legs(self, moves: Iterable[Mapping[str, Any]]) -> dict[str, Legs]:
        """Return the setting ``legs`` of a run with these moves; empty without feet."""
        if self.gamma is None or self.delta is None:
            return {}
        return {"legs": Legs.moves(self.gamma, self.delta, moves)}

    def last_angles(self, phase: Phase, moves: Iterable[Mapping[str, Any]]) -> np.ndarray:
        """Return gamma, delta (rad) after all moves up to the end of a phase."""
        gamma, delta = self.gamma or 0.0, self.delta or 0.0
        for move in (*moves, *(each for each in phase.moves if each.get("at") != TOUCH_DOWN)):
            gamma, delta = move.get("gamma", gamma), move.get("delta", delta)
        return np.array([gamma, delta])

    def _made(
        self,
        phase: Phase,
        controller: Controller,
        start: PhaseStart,
        moves: Iterable[Mapping[str, Any]],
    ) -> tuple[Trajectory, str]:
        """Return the motion of a phase, and what ended it."""
        settings = dict(self.settings) | self.legs(moves)
        settings["controller"] = Phases([(start.time, controller)])
        if start.bristles is not None:
            settings["bristles0"] = start.bristles

        def run(end: float, **more: Any) -> Trajectory:
            span = (start.time, end)
            motion = simulate(self.model, start.q, start.v, t_span=span, **settings | more)
            assert isinstance(motion, Trajectory)  # of one start
            return motion

        end = start.time + phase.duration
        if phase.until == AIRBORNE:  # found in samples of a first run
            clear = clear_of_ground(run(end, output_step=phase.duration / SAMPLES), phase.clearance)
            return run(clear or end), AIRBORNE if clear else "duration"
        events = phase.stop_at(self.model)
        motion = run(end, stop_at=events) if events else run(end)
        return motion, _ended_by(motion, events, end)


def _check_phase(model: Model, phase: Phase) -> None:
    """SimulationError if a model cannot make a phase: its events, its controller or its moves."""
    where = f"phase {phase.name!r}"
    if phase.until is not None and not model.contacts:
        remedy = "add `contacts` to its scene, or leave it out"
        raise SimulationError(f"{where}: until: {model.name} has no contacts: {remedy}")
    for kind, group in phase.stop_at(model):
        if group not in model.contacts:
            needs = f"one of {', '.join(map(repr, model.contacts))}"
            raise refusal(f"{where}: until: {kind}", group, needs, SimulationError)
    try:
        parts_of(phase.controller, model.layout.nt)
    except SimulationError as error:
        raise SimulationError(f"{where}: {error}") from error
    if phase.moves and "feet" not in model.contacts:
        raise SimulationError(f"{where}: moves: {model.name} has no legs: leave them out")


def clear_of_ground(motion: Trajectory, clearance: float) -> float | None:
    """Return the first time (s) at which nothing touches and all points are above a height (m)."""
    assert motion.contact is not None
    high = motion.contact.points[..., 2].min(axis=1) > clearance
    clear = high & (motion.contact.forces[..., 2].max(axis=1) <= 0)
    clear[0] = False  # a phase takes some time
    return float(motion.t[clear.argmax()]) if clear.any() else None


def _ended_by(motion: Trajectory, events: list[Event], end: float) -> str:
    """Return the event that ended a motion, as words, or "duration"."""
    for event in motion.info.get("events", [])[::-1]:
        if (event["kind"], event["group"]) in events and motion.t[-1] < end:
            return f"{event['kind']} of {event['group']}"
    return "duration"


def _begun(moves: Iterable[dict[str, Any]], at: float | None) -> Iterator[dict[str, Any]]:
    """Yield moves, that at a touch-down with the time at which it began, or not if it did not."""
    for move in moves:
        if move["at"] != TOUCH_DOWN:
            yield move
        elif at is not None:
            yield move | {"at": at}


def timed(
    move: Mapping[str, Any], begin: float, landing: float | None, touches: bool
) -> dict[str, Any]:
    """Return a move on the clock of the motion, from one on its phase's clock.

    touches: whether the phase begins with a touch-down of the feet.
    """
    rest = {name: value for name, value in move.items() if name not in ("at", BEFORE)}
    if landing is not None and BEFORE in move:
        before = number(f"moves.{BEFORE}", move[BEFORE], SimulationError, least=0)
        return rest | {"at": begin + max(landing - before, 0.0)}
    if move["at"] == TOUCH_DOWN:
        return {**move} | ({"at": begin} if touches else {})
    return rest | {"at": begin + number("moves.at", move["at"], SimulationError, least=0)}
