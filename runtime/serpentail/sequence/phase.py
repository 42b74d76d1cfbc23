"""``Phase``: one phase of a sequence, its controller or plan, and the event that ends it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..basics.checks import number, one_of, refusal
from ..basics.errors import SimulationError
from ..basics.short_repr import brief
from ..model.model import Model
from ..simulation.controllers.controller import CHOICES, Controller, Phases
from ..simulation.controllers.moves import MOVE, move_value
from ..simulation.controllers.pfl import KD, KP
from ..simulation.ground import KINDS

AIRBORNE, LANDING = "airborne", "landing"
BEFORE = "before_landing"  # of a move: s, in place of `at`
EARLY = 0.003  # s before it would land that a plan ends
Event = tuple[str, str]  # kind, group
GIVEN = {  # arguments of ``plan`` that a phase has no choice of, and what is needed instead
    "start": "none: it is the state in which the phase begins",
    "free_start": "none: the phase begins in the state in which the one before ends",
    "design": "none: all phases have the sequence's model: choose its parameters by st.plan before",
}


@dataclass(frozen=True)
class Tracking:
    """How a planned flight is tracked, and how early it ends.

    Parameters
    ----------
    kp : float, default 4e4
        Gain of ``Pfl`` (1/s^2); its torques stay within the plan's bound.
    kd : float, default 400
        Gain of ``Pfl`` (1/s).
    early : float, default 0.003
        Time before the predicted landing at which the plan ends (s), if the plan has no
        ``duration``.
    mpc : mapping, optional
        Settings of ``Mpc``, such as ``{"rate": 100}``. With it, ``Mpc`` tracks the plan in place
        of ``Pfl``.

    Raises
    ------
    SimulationError
        A number is negative or not finite.
    """

    kp: Any = KP  # numbers or texts; then numbers
    kd: Any = KD
    early: Any = EARLY
    mpc: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, unit in (("kp", "1/s2"), ("kd", "1/s"), ("early", "s")):
            value = number(
                f"Tracking: {name}", getattr(self, name), SimulationError, unit=unit, least=0
            )
            object.__setattr__(self, name, value)
        if not isinstance(self.mpc, Mapping | None):
            needs = "a mapping of st.Mpc's settings, or None"
            raise refusal("Tracking: mpc", self.mpc, needs, SimulationError)


@dataclass(frozen=True, eq=False)
class Phase:
    """One phase of a ``Sequence``; its clock is 0 where it begins.

    Parameters
    ----------
    name : str
        Name of the phase.
    duration : float
        Longest duration (s).
    until : {"landing", "airborne"} or sequence of (str, str), optional
        What ends the phase earlier: "landing", the first touch-down; "airborne", as soon as
        nothing touches the ground and no point is below ``clearance``; or the first of some
        events, such as ``[("take_off", "feet")]``. Default: nothing.
    clearance : float, default 0
        Height (m) for "airborne".
    controller : controller or callable, optional
        As of ``simulate``. Beside a plan it acts if no plan is true.
    plan : mapping or sequence of mapping, optional
        Arguments of ``plan``, which is tracked. The plan starts at the state in which the phase
        begins. Of several, the first successful one is used; if there is none, a warning says
        which bound to raise. Without a ``duration`` the plan ends where the body would land in
        the goal's posture.
    tracking : Tracking, optional
        How the plan is tracked.
    moves : iterable of mapping, optional
        Moves of the legs, as in ``Legs.moves``. In a phase with a plan, ``before_landing`` (s)
        may replace ``at``. A move at "touch_down" begins at once if the phase before ended with
        the touch-down of the feet.

    Raises
    ------
    SimulationError
        An argument is wrong; the message names the phase.

    Examples
    --------
    >>> import serpentail as st
    >>> st.Phase("fall", 0.5, until="landing").words
    'touch-down'
    """

    name: str
    duration: Any  # a number or a text; then a number
    until: Any = None
    clearance: Any = 0.0
    controller: Controller = None
    plan: Any = None
    tracking: Tracking = field(default_factory=Tracking)
    moves: Iterable[Mapping[str, Any]] = ()
    __repr__ = brief

    def __post_init__(self) -> None:
        """Check all that does not need the model."""
        if not isinstance(self.name, str) or not self.name.strip():
            raise refusal("Phase: name", self.name, "a word", SimulationError)
        where = f"phase {self.name!r}"
        duration = number(f"{where}: duration", self.duration, SimulationError, unit="s", above=0)
        object.__setattr__(self, "duration", duration)
        object.__setattr__(self, "until", _until(where, self.until))
        clear = number(f"{where}: clearance", self.clearance, SimulationError, unit="m", least=0)
        object.__setattr__(self, "clearance", clear)
        if self.clearance and self.until != AIRBORNE:
            remedy = f"it belongs to until = {AIRBORNE!r}: add that, or leave it out"
            raise SimulationError(f"{where}: clearance: value {self.clearance}: {remedy}")
        object.__setattr__(self, "plan", _plans(where, self.plan))
        object.__setattr__(self, "moves", _moves(where, self.moves, bool(self.plan)))
        _check_controller(where, self.controller)

    @property
    def words(self) -> str:
        """The event that ends it, in words for messages."""
        if isinstance(self.until, tuple):
            return " or ".join(f"{kind} of {group}" for kind, group in self.until)
        return "touch-down" if self.until == LANDING else "flight clear of the ground"

    def stop_at(self, model: Model) -> list[Event]:
        """Return the events (kind, group) that end it, for a model."""
        if self.until == LANDING:
            return [("touch_down", group) for group in model.contacts]
        return list(self.until) if isinstance(self.until, tuple) else []


def _until(where: str, until: Any) -> Any:
    """Return what ends a phase: a word, a tuple of events, or None."""
    if until is None or (isinstance(until, str) and until in (AIRBORNE, LANDING)):
        return until
    needs = f"{AIRBORNE!r}, {LANDING!r}, or events such as [('take_off', 'feet')]"
    try:
        events = tuple((kind, group) for kind, group in until)
    except (TypeError, ValueError):
        events = ()
    if not events or any(kind not in KINDS or not isinstance(group, str) for kind, group in events):
        raise refusal(f"{where}: until", until, needs, SimulationError)
    return events


def _moves(where: str, moves: Any, planned: bool) -> tuple[Mapping[str, Any], ...]:
    """Return moves whose keys are known; of their numbers ``Legs.moves`` takes care."""
    if isinstance(moves, str | Mapping) or not isinstance(moves, Iterable):
        raise refusal(f"{where}: moves", moves, "an array of tables", SimulationError)
    keys, listed = MOVE | ({BEFORE: "s"} if planned else {}), []
    for k, move in enumerate(moves):
        if not isinstance(move, Mapping):
            raise refusal(f"{where}: moves[{k}]", move, "a table", SimulationError)
        for key in move:
            one_of(f"{where}: moves[{k}]: key", key, keys, SimulationError)
        if ("at" in move) == (BEFORE in move):
            needs = f"at or {BEFORE}, not both" if planned else "at"
            raise refusal(f"{where}: moves[{k}]", dict(move), needs, SimulationError)
        listed.append(
            {
                key: move_value(f"{where}: moves[{k}].{key}", key, value, keys[key])
                for key, value in move.items()
            }
        )
    return tuple(listed)


def _plans(where: str, plan: Any) -> tuple[Mapping[str, Any], ...]:
    """Return arguments of plans, in the order in which they are tried; none without a plan."""
    if plan is None:
        return ()
    plans = (plan,) if isinstance(plan, Mapping) else plan
    if not isinstance(plans, list | tuple) or not all(isinstance(each, Mapping) for each in plans):
        needs = "a mapping of st.plan's arguments, or a list of such"
        raise refusal(f"{where}: plan", plan, needs, SimulationError)
    for each in plans:
        for name, needs in GIVEN.items():
            if name in each:
                raise refusal(f"{where}: plan.{name}", each[name], needs, SimulationError)
    return tuple(plans)


def _check_controller(where: str, controller: Any) -> None:
    """SimulationError for what is no controller of one phase."""
    if isinstance(controller, Phases):
        raise SimulationError(
            f"{where}: controller is Phases: give each of its controllers a phase of the sequence"
        )
    if not (controller is None or callable(controller) or hasattr(controller, "parts")):
        raise refusal(f"{where}: controller", controller, CHOICES, SimulationError)
