"""One phase of a sequence: what acts in it, and what ends it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..brief import brief
from ..checks import none_of, number, refusal
from ..errors import SimulationError
from ..model.model import Model
from ..simulation.controllers import CHOICES, Controller, Phases
from ..simulation.ground import KINDS
from ..simulation.pfl import KD, KP
from ..simulation.schedules import MOVE

AIRBORNE, LANDING = "airborne", "landing"
BEFORE = "before_landing"  # of a move: s, in place of `at`
EARLY = 0.003  # s before it would land that a plan ends
Event = tuple[str, str]  # kind, group


@dataclass(frozen=True)
class Tracking:
    """How a planned flight is tracked, and when it ends.

    kp (1/s^2), kd (1/s): gains of Pfl, whose torques keep to the plan's bound; early: s before the
    landing that the plan ends, where it is given no duration.  mpc: settings of ``Mpc``, such as
    {"rate": 100}, which controls the flight in place of Pfl.
    """

    kp: float = KP
    kd: float = KD
    early: float = EARLY
    mpc: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that cannot be."""
        for name in ("kp", "kd", "early"):
            number(f"Tracking: {name}", getattr(self, name), SimulationError, least=0)
        if not isinstance(self.mpc, Mapping | None):
            needs = "a mapping of st.Mpc's settings, or None"
            raise refusal("Tracking: mpc", self.mpc, needs, SimulationError)


@dataclass(frozen=True, eq=False)
class Phase:
    """One phase of a ``Sequence``; its clock is at 0 where it begins.

    duration: s, at most.
    until: what ends it before: "landing" (the first touch-down), "airborne" (nothing touches the
    ground, and no point is below ``clearance`` (m)), or events such as [("take_off", "feet")], of
    which the first one does; None: nothing does.
    controller: of ``st.simulate``.
    plan: arguments of ``st.plan`` for the state at which the phase begins, in place of a
    controller; or several such, of which the first whose plan is true is taken.  Without a
    ``duration`` a plan ends where the animal would land in the goal's posture.  tracking: of it.
    moves: of the legs, as in ``Legs.moves``; in phases with a plan ``before_landing`` (s) may stand
    in place of ``at``.
    """

    name: str
    duration: float
    until: Any = None
    clearance: float = 0.0
    controller: Controller = None
    plan: Any = None
    tracking: Tracking = field(default_factory=Tracking)
    moves: Iterable[Mapping[str, float]] = ()
    __repr__ = brief

    def __post_init__(self) -> None:
        """Refuse what cannot be a phase of any model."""
        if not isinstance(self.name, str) or not self.name.strip():
            raise refusal("Phase: name", self.name, "a word", SimulationError)
        where = f"phase {self.name!r}"
        number(f"{where}: duration", self.duration, SimulationError, above=0)
        object.__setattr__(self, "until", _until(where, self.until))
        number(f"{where}: clearance", self.clearance, SimulationError, least=0)
        if self.clearance and self.until != AIRBORNE:
            remedy = f"it belongs to until = {AIRBORNE!r}: add that, or leave it out"
            raise SimulationError(f"{where}: clearance: value {self.clearance}: {remedy}")
        object.__setattr__(self, "plan", _plans(where, self.plan))
        object.__setattr__(self, "moves", _moves(where, self.moves, bool(self.plan)))
        _check_acting(where, self.controller, bool(self.plan))

    @property
    def words(self) -> str:
        """What ends it, for messages."""
        if isinstance(self.until, tuple):
            return " or ".join(f"{kind} of {group}" for kind, group in self.until)
        return "touch-down" if self.until == LANDING else "flight clear of the ground"

    def stop_at(self, model: Model) -> list[Event]:
        """Return the events of a model that end it."""
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
        raise refusal(f"{where}: until", until, needs, SimulationError) from None
    if not events or any(kind not in KINDS or not isinstance(group, str) for kind, group in events):
        raise refusal(f"{where}: until", until, needs, SimulationError)
    return events


def _moves(where: str, moves: Any, planned: bool) -> tuple[Mapping[str, float], ...]:
    """Return moves whose keys are known; of their numbers ``Legs.moves`` takes care."""
    if isinstance(moves, str | Mapping) or not isinstance(moves, Iterable):
        raise refusal(f"{where}: moves", moves, "an array of tables", SimulationError)
    found = tuple(moves)
    keys = (*MOVE, BEFORE) if planned else MOVE
    for k, move in enumerate(found):
        if not isinstance(move, Mapping):
            raise refusal(f"{where}: moves[{k}]", move, "a table", SimulationError)
        for key in move:
            unknown = none_of(f"{where}: moves[{k}]: key", key, keys)
            if unknown:
                raise SimulationError(unknown)
        if ("at" in move) == (BEFORE in move):
            needs = f"at or {BEFORE}, not both" if planned else "at"
            raise refusal(f"{where}: moves[{k}]", dict(move), needs, SimulationError)
    return found


def _plans(where: str, plan: Any) -> tuple[Mapping[str, Any], ...]:
    """Return arguments of plans, in the order in which they are tried; none without a plan."""
    if plan is None:
        return ()
    plans = (plan,) if isinstance(plan, Mapping) else plan
    if not isinstance(plans, list | tuple) or not all(isinstance(each, Mapping) for each in plans):
        needs = "a mapping of st.plan's arguments, or a list of such"
        raise refusal(f"{where}: plan", plan, needs, SimulationError)
    for each in plans:
        if "start" in each:
            needs = "none: it is the state in which the phase begins"
            raise refusal(f"{where}: plan.start", each["start"], needs, SimulationError)
    return tuple(plans)


def _check_acting(where: str, controller: Any, planned: bool) -> None:
    """SimulationError where what is no controller, or a plan and a controller, would act."""
    if planned and controller is not None:
        raise SimulationError(
            f"{where}: has a controller and a plan: the plan is tracked: leave one out"
        )
    if isinstance(controller, Phases):
        raise SimulationError(
            f"{where}: controller is Phases: give each of its controllers a phase of the sequence"
        )
    if not (controller is None or callable(controller) or hasattr(controller, "parts")):
        raise refusal(f"{where}: controller", controller, CHOICES, SimulationError)
