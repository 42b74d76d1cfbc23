"""``Sequence``: one motion of several phases, each made for the state in which the last ends."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..brief import brief
from ..checks import number, refusal
from ..errors import PlanningError, SimulationError
from ..model.model import Model
from ..motion.joined import joined
from ..motion.trajectory import Trajectory
from ..planning.planner import plan as planned
from ..planning.predictive.mpc import Mpc
from ..planning.problem import checked_goal
from ..planning.result.plan import Plan
from ..simulation.controllers import Controller, Phases, parts_of
from ..simulation.pfl import Pfl
from ..simulation.schedules import Legs
from ..simulation.simulate import simulate
from .ballistic import landing_time
from .phase import AIRBORNE, BEFORE, Phase, Tracking

SAMPLES = 400  # of a phase that is looked through for where it is clear of the ground
State = tuple[np.ndarray, np.ndarray]  # q, v


@dataclass(frozen=True, eq=False)
class PhaseRun:
    """How a phase went: begin, end (s, of the whole motion), what ended it, and its plan."""

    name: str
    begin: float
    end: float
    ended_by: str
    plan: Plan | None = None
    __repr__ = brief

    def info(self) -> dict[str, Any]:
        """What a trajectory's info says of it."""
        told = {"name": self.name, "begin": self.begin, "end": self.end, "ended_by": self.ended_by}
        return told if self.plan is None else told | {"plan": self.plan.report}


@dataclass(frozen=True, eq=False)
class SequenceRun:
    """A motion of several phases, and how each of them went; ``complete``: whether all were made.

    Its trajectory's ``info["phases"]`` tells the same.
    """

    trajectory: Trajectory
    phases: tuple[PhaseRun, ...]
    complete: bool
    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Sequence:
    """Phases one after another, each on its own clock, in one motion.

    gamma, delta: rad, of both legs, where they begin; later they are where the phases' moves bring
    them.  settings: of ``st.simulate`` for all phases: method, rtol, atol, output_step, ...
    """

    model: Model
    phases: list[Phase] | tuple[Phase, ...]
    gamma: float | None = None
    delta: float | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    __repr__ = brief

    def __post_init__(self) -> None:
        """Refuse what is no sequence."""
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
        _check_legs(self.model, self.gamma, self.delta)
        for phase in phases:
            _check_phase(self.model, phase)

    def simulate(
        self, q0: ArrayLike, v0: ArrayLike, bristles0: ArrayLike | None = None
    ) -> SequenceRun:
        """Make the motion from a start (q0 (nq,), v0 (nv,)); bristles0 as in ``st.simulate``.

        A phase whose end is not met within its duration ends the motion: ``complete`` is false and
        the trajectory's warnings say so.  Raises what ``st.simulate`` and ``st.plan`` raise, with
        the phase's name; the error's ``trajectory`` is the motion up to there.
        """
        state: State = np.asarray(q0, float), np.asarray(v0, float)
        parts: list[Trajectory] = []
        runs: list[PhaseRun] = []
        moves: list[dict[str, float]] = []
        begin, complete, bristles = 0.0, True, bristles0
        for phase in self.phases:
            try:
                controller, plan, own = self._acting(phase, state, begin, moves)
                moves += own
                motion, ended_by = self._made(phase, controller, (state, bristles), begin, moves)
            except (SimulationError, PlanningError) as error:
                raise _told(phase, error, parts) from error
            except KeyboardInterrupt as stop:
                vars(stop)["motion"] = _so_far(parts, getattr(stop, "motion", None))
                raise
            parts.append(motion)
            end = float(motion.t[-1])
            runs.append(PhaseRun(phase.name, begin, end, ended_by, plan))
            state, begin = (motion.q[-1], motion.v[-1]), end
            bristles = None if motion.contact is None else motion.contact.bristles[-1]
            if phase.until is not None and ended_by == "duration":
                complete = False
                break
        return SequenceRun(_whole(parts, runs, self.phases), tuple(runs), complete)

    def legs(self, moves: Iterable[Mapping[str, float]]) -> dict[str, Legs]:
        """Return the setting ``legs`` of a run with these moves, where there are feet."""
        if self.gamma is None or self.delta is None:
            return {}
        return {"legs": Legs.moves(self.gamma, self.delta, moves)}

    def _acting(
        self, phase: Phase, state: State, begin: float, moves: list[dict[str, float]]
    ) -> tuple[Controller, Plan | None, list[dict[str, float]]]:
        """Return what acts in a phase that begins in a state, its plan, and its moves in time."""
        if not phase.plan:
            return phase.controller, None, [_at(move, begin) for move in phase.moves]
        angles = self._last_angles(phase, moves)
        found: list[tuple[Plan, float | None]] = []
        for arguments in phase.plan:
            found.append(self._planned(phase, dict(arguments), state, angles))
            if found[-1][0].success:
                break
        plan, landing = min(found, key=lambda pair: _off(pair[0]))
        law = _tracking(self.model, plan, phase.tracking)
        return law, plan, [_at(move, begin, landing) for move in phase.moves]

    def _planned(
        self, phase: Phase, arguments: dict[str, Any], state: State, angles: np.ndarray
    ) -> tuple[Plan, float | None]:
        """Return a plan from a state, and when (s) it would land, where that is needed."""
        landing = None
        if "duration" not in arguments or any(BEFORE in move for move in phase.moves):
            goal = checked_goal(arguments.get("goal"), self.model.layout.nt)
            landing = landing_time(self.model, state, goal, angles)
            arguments = {"duration": landing - phase.tracking.early} | arguments
        return planned(self.model, start=state, **arguments), landing

    def _last_angles(self, phase: Phase, moves: list[dict[str, float]]) -> np.ndarray:
        """Return gamma, delta (rad) after all moves up to the end of a phase."""
        angles = [self.gamma or 0.0, self.delta or 0.0]
        for move in (*moves, *phase.moves):
            angles = [move.get("gamma", angles[0]), move.get("delta", angles[1])]
        return np.array(angles)

    def _made(
        self,
        phase: Phase,
        controller: Controller,
        start: tuple[State, ArrayLike | None],
        begin: float,
        moves: list[dict[str, float]],
    ) -> tuple[Trajectory, str]:
        """Return the motion of a phase, and what ended it."""
        (q, v), bristles = start
        settings = dict(self.settings) | self.legs(moves)
        settings["controller"] = Phases([(begin, controller)])
        if bristles is not None:
            settings["bristles0"] = bristles
        end = begin + phase.duration
        if phase.until == AIRBORNE:
            trial = settings | {"output_step": phase.duration / SAMPLES}
            looked = simulate(self.model, q, v, t_span=(begin, end), **trial)
            assert isinstance(looked, Trajectory)
            clear = _clear(looked, phase.clearance)
            motion = simulate(self.model, q, v, t_span=(begin, clear or end), **settings)
            assert isinstance(motion, Trajectory)
            return motion, AIRBORNE if clear else "duration"
        events = phase.stop_at(self.model)
        if events:
            settings["stop_at"] = events
        motion = simulate(self.model, q, v, t_span=(begin, end), **settings)
        assert isinstance(motion, Trajectory)
        return motion, _ended_by(motion, events, end)


def _tracking(model: Model, plan: Plan, tracking: Tracking) -> Controller:
    """Return what flies a plan."""
    if tracking.mpc is not None:
        return Mpc(model, plan, **tracking.mpc)
    return Pfl(model, plan, tracking.kp, tracking.kd, torque=plan.problem.bounds.torque)


def _off(plan: Plan) -> float:
    """Return how far (deg) a plan's torques miss the goal; below 0 where it is true."""
    error = plan.report["open_loop_goal_error_deg"]
    return -1.0 if plan.success else np.inf if error is None else float(error)


def _clear(motion: Trajectory, clearance: float) -> float | None:
    """Return the first time (s) at which nothing touches and all points are that high (m)."""
    assert motion.contact is not None
    high = motion.contact.points[..., 2].min(axis=1) > clearance
    clear = high & (motion.contact.forces[..., 2].max(axis=1) <= 0)
    clear[0] = False  # a phase takes some time
    return float(motion.t[clear.argmax()]) if clear.any() else None


def _ended_by(motion: Trajectory, events: Iterable[tuple[str, str]], end: float) -> str:
    """Return the event that ended a motion, as words, or "duration"."""
    for event in motion.info.get("events", [])[::-1]:
        if (event["kind"], event["group"]) in set(events) and motion.t[-1] < end:
            return f"{event['kind']} of {event['group']}"
    return "duration"


def _at(move: Mapping[str, float], begin: float, landing: float | None = None) -> dict[str, float]:
    """Return a move of a phase's clock on the clock of the motion."""
    rest = {name: value for name, value in move.items() if name not in ("at", BEFORE)}
    if landing is not None and BEFORE in move:
        before = number(f"moves.{BEFORE}", move[BEFORE], SimulationError, least=0)
        return rest | {"at": begin + max(landing - before, 0.0)}
    return rest | {"at": begin + number("moves.at", move["at"], SimulationError, least=0)}


def _whole(parts: list[Trajectory], runs: list[PhaseRun], phases: Iterable[Phase]) -> Trajectory:
    """Return the motion of all phases, which tells of each."""
    motion = joined(parts)
    warnings = list(motion.info.get("warnings", []))
    for run, phase in zip(runs, phases, strict=False):
        if run.plan is not None and not run.plan.success:
            warnings.append(f"the plan of phase {run.name!r} is not true: see its report")
        if phase.until is not None and run.ended_by == "duration":
            warnings.append(
                f"phase {run.name!r} met no {phase.words} within {phase.duration:.6g} s"
            )
    told = {"phases": [run.info() for run in runs], "warnings": warnings}
    return replace(motion, info=motion.info | told)


def _told(
    phase: Phase, error: SimulationError | PlanningError, parts: list[Trajectory]
) -> SimulationError | PlanningError:
    """Return an error that names its phase, with the motion up to there."""
    found = type(error)(f"phase {phase.name!r}: {error}")
    if isinstance(found, SimulationError):
        found.trajectory = _so_far(parts, getattr(error, "trajectory", None))
    return found


def _so_far(parts: list[Trajectory], last: Trajectory | None) -> Trajectory | None:
    """Return the motion of the phases that were made, and of a part of one more."""
    made = parts if last is None else [*parts, last]
    return joined(made) if made else None


def _check_legs(model: Model, gamma: Any, delta: Any) -> None:
    """SimulationError where angles of legs are missing, or there are no legs."""
    has = "feet" in model.contacts
    for name, value in (("gamma", gamma), ("delta", delta)):
        if has:
            number(f"Sequence: {name}", value, SimulationError)
        elif value is not None:
            raise SimulationError(f"Sequence: {name}: {model.name} has no legs: leave it out")


def _check_phase(model: Model, phase: Phase) -> None:
    """SimulationError where a model knows nothing of what ends a phase, acts in it, or moves."""
    where = f"phase {phase.name!r}"
    if phase.until is not None and not model.contacts:
        remedy = "add `contacts` to its scene, or leave it out"
        raise SimulationError(f"{where}: until: {model.name} touches nothing: {remedy}")
    for kind, group in phase.stop_at(model):
        if group not in model.contacts:
            choices = ", ".join(map(repr, model.contacts))
            needs = f"one of {choices}"
            raise refusal(f"{where}: until: {kind}", group, needs, SimulationError)
    try:
        parts_of(phase.controller, model.layout.nt)
    except SimulationError as error:
        raise SimulationError(f"{where}: {error}") from error
    if phase.moves and "feet" not in model.contacts:
        raise SimulationError(f"{where}: moves: {model.name} has no legs: leave them out")
