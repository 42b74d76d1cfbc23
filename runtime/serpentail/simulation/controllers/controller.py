"""Torque laws for ``simulate``, and their checks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import repeat
from typing import Any, cast

import numpy as np

from ...basics.checks import finite_array, numbers, numbers_in, refusal
from ...basics.errors import SimulationError
from ...basics.short_repr import brief
from ...model.state import Quantities
from .parts import NativeTorque, Parts, TorqueFunction
from .pfl import Pfl
from .piecewise import Piecewise, checked_nodes, linear
from .sampled import Sampled

CHOICES = (
    "None, Damping, TorqueTable, TorqueCurve, TensionTable, TensionCurve, Pfl, Gains, Mpc, "
    "Sampled, Phases, NativeTorque or a function (t, q, v)"
)


@dataclass(frozen=True)
class Damping:
    """Joint damping: tau = -damping * q_t_dot (Eq. 47).

    Parameters
    ----------
    damping : float or sequence of float, default 1e-3
        Damping (N m s), one number or one for each of the 2m tail coordinates, zero or more.

    Examples
    --------
    >>> import serpentail as st
    >>> st.Damping(1e-4)
    Damping(damping=0.0001)
    """

    damping: Quantities = 1e-3

    def parts(self, nt: int) -> Parts:
        """Return its parts for 2m tail coordinates."""
        return Parts(_damping(self.damping, nt))


@dataclass(frozen=True)
class TorqueTable:
    """Torques at given times, linear between them, less joint damping.

    Parameters
    ----------
    times : array_like, shape (K,)
        Increasing times (s). Before the first and after the last, the torques are held.
    torques : array_like, shape (K, 2m)
        Torques of the tail coordinates (N m).
    damping : float or sequence of float, default 0
        Damping (N m s), as of ``Damping``, in addition.

    Examples
    --------
    >>> import serpentail as st
    >>> law = st.TorqueTable([0.0, 0.1], [[0.0, 0.0], [0.01, 0.0]])
    """

    times: Quantities
    torques: Quantities
    damping: Quantities = 0.0
    __repr__ = brief

    def parts(self, nt: int) -> Parts:
        """Return its parts for 2m tail coordinates."""
        nodes = checked_nodes("TorqueTable", "torques", (self.times, self.torques), nt, "N m")
        return Parts(_damping(self.damping, nt), linear(*nodes))


@dataclass(frozen=True, eq=False)
class TorqueCurve:
    """Torques as piecewise polynomials of time, less joint damping.

    Parameters
    ----------
    torques : Piecewise
        Torques of the 2m tail coordinates (N m), one channel each.
    damping : float or sequence of float, default 0
        Damping (N m s), as of ``Damping``, in addition.
    """

    torques: Piecewise
    damping: Quantities = 0.0

    def parts(self, nt: int) -> Parts:
        """Return its parts for 2m tail coordinates."""
        if not isinstance(self.torques, Piecewise) or self.torques.channels != nt:
            needs = f"a Piecewise of {nt} channels"
            raise refusal("TorqueCurve: torques", self.torques, needs, SimulationError)
        return Parts(_damping(self.damping, nt), self.torques)


@dataclass(frozen=True)
class TensionTable:
    """Tensions of tendons at given times, linear between them, and joint damping.

    Parameters
    ----------
    times, damping
        As of ``TorqueTable``.
    tensions : array_like, shape (K, tendons)
        Tensions (N), from 0 to the limit of each tendon.

    Examples
    --------
    >>> import serpentail as st
    >>> law = st.TensionTable([0.0, 0.1], [["0 N", "2 N"], ["1 N", "0 N"]])
    """

    times: Quantities
    tensions: Quantities
    damping: Quantities = 0.0
    __repr__ = brief

    def parts(self, nt: int) -> Parts:
        """Return its parts for 2m tail coordinates."""
        width = np.shape(self.tensions)[-1] if np.ndim(self.tensions) == 2 else 1
        given = (self.times, self.tensions)
        nodes = checked_nodes("TensionTable", "tensions", given, width, "N")
        return Parts(_damping(self.damping, nt), tensions=linear(*nodes))


@dataclass(frozen=True, eq=False)
class TensionCurve:
    """Tensions of tendons as piecewise polynomials of time, and joint damping.

    Parameters
    ----------
    tensions : Piecewise
        Tensions (N), one channel for each tendon, from 0 to its limit.
    damping
        As of ``TorqueCurve``.
    """

    tensions: Piecewise
    damping: Quantities = 0.0

    def parts(self, nt: int) -> Parts:
        """Return its parts for 2m tail coordinates."""
        if not isinstance(self.tensions, Piecewise):
            raise refusal("TensionCurve: tensions", self.tensions, "a Piecewise", SimulationError)
        return Parts(_damping(self.damping, nt), tensions=self.tensions)


@dataclass(frozen=True, eq=False)
class Phases:
    """Controllers that act one after another, each on its own clock.

    Parameters
    ----------
    phases : iterable of (float, controller)
        Pairs of a time (s) and the controller that acts from then on, in the order of time. The
        clock of a controller is 0 at the beginning of its phase. A controller is anything that
        ``simulate`` takes, except Phases.

    Raises
    ------
    SimulationError
        The pairs are not in the order of time, or one of them is wrong.

    Examples
    --------
    A plan for the state at 0.4 s is tracked from then on:

    >>> law = st.Phases([(0.0, None), (0.4, st.Pfl(model, plan))])  # doctest: +SKIP
    """

    phases: Iterable[tuple[float, Controller]]
    __repr__ = brief

    def __post_init__(self) -> None:
        """Refuse anything but pairs in the order of time."""
        try:
            pairs = tuple((begin, controller) for begin, controller in self.phases)
        except (TypeError, ValueError):
            needs = "pairs (time, controller)"
            raise refusal("Phases", self.phases, needs, SimulationError) from None
        begins = [begin for begin, _ in pairs]
        times = finite_array("Phases: times", begins or 0.0, SimulationError, "s")
        if times.ndim != 1 or (np.diff(times) <= 0).any():
            needs = "one or more increasing times, in s"
            raise refusal("Phases: times", begins, needs, SimulationError)
        if any(isinstance(controller, Phases) for _, controller in pairs):
            raise SimulationError(
                "Phases: one of the controllers is Phases itself: put all pairs in one list"
            )
        acting = (controller for _, controller in pairs)
        object.__setattr__(self, "phases", tuple(zip(times.tolist(), acting, strict=True)))


def remembers(controller: Any) -> bool:
    """Tell whether a controller calls a user's function that may remember an earlier run."""
    each = [law for _, law in controller.phases] if isinstance(controller, Phases) else [controller]
    return any(isinstance(law, Sampled) for law in each)


Tables = Damping | TorqueTable | TorqueCurve | TensionTable | TensionCurve
Single = Tables | Pfl | Sampled | NativeTorque | TorqueFunction
Controller = Single | Phases | None


def controllers_of(controller: object, runs: int | None) -> list[Any]:
    """Return the controllers that are given: one for all runs, or one for each.

    runs: number of runs, None for a single start. For many runs the controller may be a list, or a
    TorqueTable or Damping whose numbers have a leading axis of the runs. SimulationError if their
    number differs from that of the runs.
    """
    if runs is None and isinstance(controller, list | tuple):
        remedy = "give one controller, or q0 or v0 one row for each run"
        raise SimulationError(f"controller: a list of {len(controller)}, one start: {remedy}")
    given = None if runs is None else _rows(controller)
    if given is None:
        return [controller]
    if len(given) != runs:
        raise SimulationError(
            f"controller: {len(given)} controllers for {runs} runs: give one, or one for each run"
        )
    return given


def _rows(controller: object) -> list[Any] | None:
    """Return one controller for each run; None if one controller serves all."""
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
    """Return the parts of a controller for 2m tail coordinates.

    SimulationError if it is not a controller.
    """
    if controller is None:
        return Parts()
    parts = getattr(controller, "parts", None)
    if callable(parts) and not isinstance(controller, type):
        return cast(Parts, parts(nt))
    if callable(controller):
        return Parts(user=controller)
    raise refusal("controller", controller, CHOICES, SimulationError)


def _damping(damping: Quantities, nt: int) -> np.ndarray:
    """Return joint damping (2m,), N m s."""
    return numbers("damping", damping, nt, SimulationError, unit="N m s", least=0)
