"""``Sequence``: one motion of several phases; each begins at the end of the one before."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..basics.checks import number, refusal
from ..basics.errors import PlanningError, SimulationError
from ..basics.short_repr import brief
from ..model.model import Model
from ..motion.trajectory import Trajectory
from ..mpc.mpc import Mpc
from ..planning.planner import plan as planned
from ..planning.problem import checked_goal
from ..planning.result.plan import Plan
from ..simulation.controllers.controller import Controller, Phases
from ..simulation.controllers.pfl import Pfl
from ..simulation.controllers.schedules import Legs
from ..simulation.simulate import simulate
from .ballistic import landing_time
from .checks import check_legs, check_phase
from .phase import AIRBORNE, BEFORE, Phase, Tracking
from .run import PhaseRun, SequenceRun, so_far, told, whole

SAMPLES = 400  # of a phase, to find when it is clear of the ground
State = tuple[np.ndarray, np.ndarray]  # q, v


@dataclass(frozen=True, eq=False)
class Sequence:
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
    gamma: float | None = None
    delta: float | None = None
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
        check_legs(self.model, self.gamma, self.delta)
        for phase in phases:
            check_phase(self.model, phase)

    def simulate(
        self, q0: ArrayLike, v0: ArrayLike, bristles0: ArrayLike | None = None
    ) -> SequenceRun:
        """Make the motion from a start.

        A phase with an end event that does not occur within its duration ends the motion. Then
        ``complete`` is False, and a warning of the trajectory says so.

        Parameters
        ----------
        q0 : array_like, shape (nq,)
            Configuration.
        v0 : array_like, shape (nv,)
            Velocity.
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
                raise told(phase, error, parts) from error
            except KeyboardInterrupt as stop:
                vars(stop)["motion"] = so_far(parts, getattr(stop, "motion", None))
                raise
            parts.append(motion)
            end = float(motion.t[-1])
            runs.append(PhaseRun(phase.name, begin, end, ended_by, plan))
            state, begin = (motion.q[-1], motion.v[-1]), end
            bristles = None if motion.contact is None else motion.contact.bristles[-1]
            if phase.until is not None and ended_by == "duration":
                complete = False
                break
        return SequenceRun(whole(parts, runs, self.phases), tuple(runs), complete)

    def legs(self, moves: Iterable[Mapping[str, float]]) -> dict[str, Legs]:
        """Return the setting ``legs`` of a run with these moves; empty without feet."""
        if self.gamma is None or self.delta is None:
            return {}
        return {"legs": Legs.moves(self.gamma, self.delta, moves)}

    def _acting(
        self, phase: Phase, state: State, begin: float, moves: list[dict[str, float]]
    ) -> tuple[Controller, Plan | None, list[dict[str, float]]]:
        """Return the controller, the plan and the timed moves of a phase that begins in a state."""
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
        """Return a plan from a state, and the time of its landing (s) if that is needed."""
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
    """Return the controller that tracks a plan."""
    if tracking.mpc is not None:
        return Mpc(model, plan, **tracking.mpc)
    return Pfl(model, plan, tracking.kp, tracking.kd, torque=plan.problem.bounds.torque)


def _off(plan: Plan) -> float:
    """Return how far (deg) a plan's true motion misses the goal; -1 for a successful plan."""
    error = plan.report["open_loop_goal_error_deg"]
    return -1.0 if plan.success else np.inf if error is None else float(error)


def _clear(motion: Trajectory, clearance: float) -> float | None:
    """Return the first time (s) at which nothing touches and all points are above a height (m)."""
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
    """Return a move on the clock of the motion, from one on its phase's clock."""
    rest = {name: value for name, value in move.items() if name not in ("at", BEFORE)}
    if landing is not None and BEFORE in move:
        before = number(f"moves.{BEFORE}", move[BEFORE], SimulationError, least=0)
        return rest | {"at": begin + max(landing - before, 0.0)}
    return rest | {"at": begin + number("moves.at", move["at"], SimulationError, least=0)}
