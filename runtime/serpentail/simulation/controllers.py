"""Torque laws of the tail that a user can give, checked and split into what each adds up."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..brief import brief
from ..checks import finite_array, numbers, numbers_in, refusal
from ..errors import SimulationError
from .pfl import Pfl
from .piecewise import Piecewise, checked_nodes, linear

TorqueFunction = Callable[[float, np.ndarray, np.ndarray], ArrayLike]  # (t, q, v) -> tau
CHOICES = (
    "None, Damping, TorqueTable, TorqueCurve, Pfl, Mpc, Phases, NativeTorque or a function "
    "(t, q, v)"
)


@dataclass(frozen=True, eq=False)
class OwnState:
    """What a function of C keeps of a run.

    begin: called with the record of a run that begins, and the controller's clock (s).  told: what
    the run's info has of it.  stops: times (s) at which steps must end.
    """

    begin: Callable[[Any, float], None]
    told: Callable[[], dict[str, Any]]
    stops: list[float]


@dataclass(frozen=True, eq=False)
class Parts:
    """What one controller adds up; damping (2m,) in N m s, functions of C and of Python.

    clock: s, the run's time at which that of the function of C is 0; own: what that keeps.
    """

    damping: np.ndarray | None = None
    torques: Piecewise | None = None
    pfl: Pfl | None = None
    native: "NativeTorque | None" = None
    user: TorqueFunction | None = None
    clock: float = 0.0
    own: OwnState | None = None

    def since(self, begin: float) -> "Parts":
        """Return the parts with a clock that is at 0 at the time ``begin`` (s) of the run."""
        if begin == 0:
            return self
        user = self.user
        return replace(
            self,
            torques=None if self.torques is None else self.torques.later(begin),
            pfl=None if self.pfl is None else self.pfl.later(begin),
            user=None if user is None else lambda t, q, v: user(t - begin, q, v),
            clock=begin,
        )

    def kinks(self) -> list[float]:
        """Times at which these torques jump or have a kink."""
        times: list[float] = []
        if self.torques is not None:
            times += self.torques.kinks(2).tolist()
        if self.pfl is not None:
            times += self.pfl.curve.kinks(3).tolist()
        if self.own is not None:
            times += [self.clock + stop for stop in self.own.stops]
        return times


@dataclass(frozen=True)
class Damping:
    """tau = -damping q_t_dot (Eq. 47); damping in N m s, one number or one a tail coordinate."""

    damping: float | tuple[float, ...] = 1e-3

    def parts(self, nt: int) -> Parts:
        """Return what it adds up for 2m tail coordinates."""
        return Parts(_damping(self.damping, nt))


@dataclass(frozen=True)
class TorqueTable:
    """Torques (K, 2m) in N m at increasing times (K,) in s, less damping q_t_dot.

    They are linear in between, and held outside.
    """

    times: ArrayLike
    torques: ArrayLike
    damping: float | tuple[float, ...] = 0.0
    __repr__ = brief

    def parts(self, nt: int) -> Parts:
        """Return what it adds up for 2m tail coordinates."""
        nodes = checked_nodes("TorqueTable", "torques", (self.times, self.torques), nt)
        return Parts(_damping(self.damping, nt), linear(*nodes))


@dataclass(frozen=True, eq=False)
class TorqueCurve:
    """Torques in N m as polynomials piece by piece, of 2m channels; less damping q_t_dot."""

    torques: Piecewise
    damping: float | tuple[float, ...] = 0.0

    def parts(self, nt: int) -> Parts:
        """Return what it adds up for 2m tail coordinates."""
        if not isinstance(self.torques, Piecewise) or self.torques.channels != nt:
            needs = f"a Piecewise of {nt} channels"
            raise refusal("TorqueCurve: torques", self.torques, needs, SimulationError)
        return Parts(_damping(self.damping, nt), self.torques)


@dataclass(frozen=True)
class NativeTorque:
    """A compiled function, which returns 0 for success.

    ``int f(void *context, real t, const real *q, const real *v, real *tau)``.  t: s, on the clock
    of its phase.  function: a ctypes function, or an address; context: an address, or None.  The
    caller keeps both alive.
    """

    function: Any
    context: int | None = None

    def parts(self, nt: int) -> Parts:
        """Return what it adds up, whatever the number of tail coordinates."""
        return Parts(native=self)


@dataclass(frozen=True, eq=False)
class Phases:
    """Controllers one after another: pairs of an increasing time (s) and what acts from then on.

    Each has a clock of its own, which is at 0 where its phase begins: a plan for the state at 0.4 s
    is tracked by ``Phases([(0.0, None), (0.4, Pfl(model, plan))])``.
    """

    phases: Iterable[tuple[float, "Controller"]]
    __repr__ = brief

    def __post_init__(self) -> None:
        """Refuse what is no list of pairs in the order of time."""
        try:
            pairs = tuple((begin, controller) for begin, controller in self.phases)
        except (TypeError, ValueError):
            needs = "pairs (time, controller)"
            raise refusal("Phases", self.phases, needs, SimulationError) from None
        begins = [begin for begin, _ in pairs]
        times = finite_array("Phases: times", begins or 0.0, SimulationError)
        if times.ndim != 1 or (np.diff(times) <= 0).any():
            needs = "one or more increasing times, in s"
            raise refusal("Phases: times", begins, needs, SimulationError)
        if any(isinstance(controller, Phases) for _, controller in pairs):
            raise SimulationError(
                "Phases: one of the controllers is Phases itself: put all pairs in one list"
            )
        acting = (controller for _, controller in pairs)
        object.__setattr__(self, "phases", tuple(zip(times.tolist(), acting, strict=True)))


Single = Damping | TorqueTable | TorqueCurve | Pfl | NativeTorque | TorqueFunction
Controller = Single | Phases | None


def controllers_of(controller: object, runs: int | None) -> list[Any]:
    """Return the controllers that are given: one for all runs, or one a run.

    runs: None for a single start.  Of many a list, or a TorqueTable or Damping whose numbers have a
    leading axis of the runs; SimulationError where it has another number of them.
    """
    if runs is None and isinstance(controller, list | tuple):
        remedy = "give one controller, or q0 or v0 a row a run"
        raise SimulationError(f"controller: a list of {len(controller)}, one start: {remedy}")
    given = None if runs is None else _rows(controller)
    if given is None:
        return [controller]
    if len(given) != runs:
        raise SimulationError(
            f"controller: {len(given)} controllers for {runs} runs: give one, or one a run"
        )
    return given


def _rows(controller: object) -> list[Any] | None:
    """Return a controller a run, None where there is one for all."""
    if isinstance(controller, list | tuple):
        return [*controller]
    if isinstance(controller, TorqueTable):
        torques, damping = numbers_in(controller.torques), numbers_in(controller.damping)
        if torques is None or torques.ndim != 3:
            return None
        own = damping is not None and damping.ndim == 2 and len(damping) == len(torques)
        lost: Iterable[Any] = damping if damping is not None and own else repeat(controller.damping)
        pairs = zip(torques, lost)  # noqa: B905  the damping may be repeated
        return [TorqueTable(controller.times, row, each) for row, each in pairs]
    if isinstance(controller, Damping):
        damping = numbers_in(controller.damping)
        if damping is not None and damping.ndim == 2:
            return [Damping(row) for row in damping]
    return None


def phases_of(controller: Controller) -> list[tuple[float, Controller]]:
    """Return pairs of time and controller."""
    return [*controller.phases] if isinstance(controller, Phases) else [(0.0, controller)]


def parts_of(controller: Controller, nt: int) -> Parts:
    """Return the parts of one controller for 2m tail coordinates; SimulationError if it is none."""
    if controller is None:
        return Parts()
    if isinstance(controller, Pfl):
        return Parts(pfl=controller)
    if callable(getattr(controller, "parts", None)) and not isinstance(controller, type):
        parts: Parts = controller.parts(nt)
        return parts
    if callable(controller):
        return Parts(user=controller)
    raise refusal("controller", controller, CHOICES, SimulationError)


def _damping(damping: float | tuple[float, ...], nt: int) -> np.ndarray:
    """Return joint damping (2m,), N m s."""
    return numbers("damping", damping, nt, SimulationError, least=0)
