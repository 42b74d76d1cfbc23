"""Schedules over time: angles of the legs, and reference angles of the tail."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from ...basics.checks import finite_array, number, one_of, refusal
from ...basics.errors import SimulationError
from ...basics.plausible_values import warn_of_degrees
from ...basics.short_repr import brief
from ...model.model import Model
from ...model.state import Quantities, Quantity, shared_among_links
from .moves import Moves, moves_of
from .piecewise import Piecewise, checked_nodes, linear, shaped, spline

BLENDS = ("linear", "quintic", "spline")


@dataclass(frozen=True, eq=False)
class Reference:
    """Reference angles of the tail over time, which ``Pfl`` can track.

    Parameters
    ----------
    times : array_like, shape (K,)
        Increasing times (s), two or more; before the first and after the last, angles are held.
    angles : array_like, shape (K, 2m)
        Tail coordinates (rad).
    blend : {"quintic", "spline", "linear"}, default "quintic"
        "quintic": from rest to rest between nodes, so that equal nodes hold; "spline": a cubic
        spline through all nodes; "linear": straight lines, whose rate jumps.

    Attributes
    ----------
    curve : Piecewise
        The angles as a function of time.

    Raises
    ------
    SimulationError
        Times, angles or blend are wrong.

    Examples
    --------
    >>> import serpentail as st
    >>> reference = st.Reference([0.0, 0.1], [[0.0, 0.0], [0.5, 0.0]])
    >>> reference.curve.at(0.05)[0].tolist()
    [0.25, 0.0]
    """

    times: Quantities
    angles: Quantities
    blend: str = "quintic"
    curve: Piecewise = field(init=False)
    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the nodes."""
        one_of("Reference: blend", self.blend, BLENDS, SimulationError)
        angles = finite_array("Reference: angles", self.angles, SimulationError, "rad")
        width = angles.shape[1] if angles.ndim == 2 else 0
        nodes = checked_nodes("Reference", "angles", (self.times, angles), width)
        if len(nodes[0]) < 2:
            raise SimulationError("Reference: one node only: give two or more")
        curve = spline(*nodes) if self.blend == "spline" else shaped(*nodes, self.blend)
        object.__setattr__(self, "curve", curve)

    @classmethod
    def of_bends(
        cls, model: Model, times: Quantities, bends: Quantities, blend: str = "quintic"
    ) -> Self:
        """Make the reference of a tail from the bends of its segments.

        Parameters
        ----------
        model : Model
            The model: each of a segment's n links takes 1/n of its bend; an arc takes all of it.
        times : array_like, shape (K,)
            Increasing times (s).
        bends : array_like, shape (K, m, 2) or (K, m)
            Pitch and yaw bend of each segment (rad), or pitch alone.
        blend : str, default "quintic"
            As of ``Reference``.

        Returns
        -------
        Reference
            The reference.

        Raises
        ------
        SimulationError
            An argument is wrong.

        Warns
        -----
        UnusualSize
            A bend is beyond a whole turn: degrees, most likely.
        """
        checked = finite_array("bends", bends, SimulationError, "rad")
        if model.manifest["scene"]["coordinates"] != "polar":
            warn_of_degrees("bends", checked, calls=2)
        m = model.segments
        if checked.shape[1:] not in ((m,), *[(m, 2)] * (not model.layout.hinges)):
            raise SimulationError(
                f"bends has shape {checked.shape}: give (times, {m}) or (times, {m}, 2): pitch, or "
                "pitch and yaw, of each segment"
            )
        return cls(times, shared_among_links(model, checked.reshape(len(checked), m, -1)), blend)


@dataclass(frozen=True, eq=False)
class Legs:
    """Leg angles over time, linear between nodes and held outside.

    Parameters
    ----------
    times : array_like, shape (K,)
        Increasing times (s).
    gamma, delta : float or array_like, shape (K,) or (K, 2)
        Leg angles (rad), Eqs. 5 to 9: a constant, or at each time for both legs, or for the right
        and the left leg.

    Attributes
    ----------
    curve : Piecewise
        gamma and delta of the right leg, then of the left, as a function of time.
    landing : Piecewise or None
        The same from a touch-down of the feet on, over the time since then; only of moves.
    landing_from : float
        The first touch-down from this time (s) on begins the landing.

    Raises
    ------
    SimulationError
        Times or angles are wrong.

    See Also
    --------
    Legs.fixed, Legs.ramp, Legs.moves

    Examples
    --------
    >>> import serpentail as st
    >>> legs = st.Legs.moves(3.67, -0.26, [{"at": 0.1, "delta": -1.2, "rate": 20.0}])
    >>> legs.curve.at(0.0)[0].tolist()
    [3.67, -0.26, 3.67, -0.26]
    """

    times: Quantities
    gamma: Quantities
    delta: Quantities
    curve: Piecewise = field(init=False)
    landing: Piecewise | None = field(init=False, default=None)
    landing_from: float = field(init=False, default=0.0)
    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the nodes."""
        times = np.atleast_1d(finite_array("Legs: times", self.times, SimulationError, "s"))
        gamma, delta = (_both_legs(name, getattr(self, name), times) for name in ("gamma", "delta"))
        nodes = checked_nodes(
            "Legs", "angles", (times, np.stack([gamma, delta], axis=-1).reshape(len(times), 4)), 4
        )
        object.__setattr__(self, "curve", linear(*nodes))

    @classmethod
    def fixed(cls, gamma: float, delta: float) -> Self:
        """Make legs that do not move.

        Parameters
        ----------
        gamma, delta : float
            Angles of both legs (rad).

        Returns
        -------
        Legs
            The schedule.
        """
        return cls([0.0], gamma, delta)

    @classmethod
    def ramp(cls, gamma: Quantity, delta: Quantities, at: Quantity, rate: Quantity) -> Self:
        """Make legs whose delta goes from one angle to another at a constant rate: a kick (Eq. 48).

        Parameters
        ----------
        gamma : float
            Angle of both legs (rad), constant.
        delta : (float, float)
            First and last angle (rad).
        at : float
            Time at which the ramp begins (s).
        rate : float
            Rate (rad/s), of any sign except 0.

        Returns
        -------
        Legs
            The schedule.

        Raises
        ------
        SimulationError
            An argument is wrong.
        """
        angles = finite_array("Legs.ramp: delta", delta, SimulationError, "rad")
        if angles.shape != (2,) or angles[0] == angles[1]:
            raise refusal("Legs.ramp: delta", delta, "two angles that differ", SimulationError)
        speed = number("Legs.ramp: rate", rate, SimulationError, unit="rad/s")
        if speed == 0:
            raise refusal("Legs.ramp: rate", rate, "a number that is not 0", SimulationError)
        gamma = number("Legs.ramp: gamma", gamma, SimulationError, unit="rad")
        move = {"at": number("Legs.ramp: at", at, SimulationError, unit="s"), "delta": angles[1]}
        return cls.moves(gamma, angles[0], [move | {"rate": math.fabs(speed)}])

    @classmethod
    def moves(cls, gamma: Quantity, delta: Quantity, moves: Iterable[Mapping[str, Any]]) -> Self:
        """Make legs that move from time to time, both alike, and are held between the moves.

        Parameters
        ----------
        gamma, delta : float
            First angles (rad).
        moves : iterable of mapping
            Moves in the order of time. Each has ``at`` (s), the last ``gamma``, ``delta`` or both
            (rad), and either ``duration`` (s) or ``rate`` (rad/s, the largest of the angle that
            changes more). ``shape`` is "linear", at a constant rate; "accelerate", from rest at a
            constant acceleration, so that the rate is largest at the end; "decelerate", to rest,
            with the largest rate at the beginning; or "quintic", from rest to rest. The last move
            may have ``at="touch_down"``: it begins when the feet first touch down after the moves
            before it, from t = 0 on.

        Returns
        -------
        Legs
            The schedule.

        Raises
        ------
        SimulationError
            A move is incomplete, or begins before the last one ends.
        """
        first = finite_array("legs", [gamma, delta], SimulationError, "rad")
        made: Moves = moves_of(first, moves)
        legs = cls(made.times, *made.angles.T)
        both = np.tile(made.angles, 2)
        object.__setattr__(legs, "curve", shaped(made.times, both, *made.shapes))
        if made.landing is not None:
            goal, duration, shape = made.landing
            ways = np.tile([made.angles[-1], goal], 2)
            object.__setattr__(legs, "landing", shaped(np.array([0.0, duration]), ways, shape))
            object.__setattr__(legs, "landing_from", made.landing_from)
        return legs

    def before_landing(self) -> Self:
        """Return the same legs without what begins at a touch-down."""
        legs = copy(self)
        object.__setattr__(legs, "landing", None)
        return legs


def _both_legs(name: str, value: Quantities, times: np.ndarray) -> np.ndarray:
    """Return angles (K, 2)."""
    angles = finite_array(f"Legs: {name}", value, SimulationError, "rad")
    if angles.shape not in ((), (len(times),), (len(times), 2)):
        shapes = f"not a number, ({len(times)},) or ({len(times)}, 2)"
        raise SimulationError(f"Legs: {name} has shape {angles.shape}, {shapes}")
    if angles.ndim == 1:
        angles = angles[:, None]
    return np.broadcast_to(angles, (len(times), 2))
