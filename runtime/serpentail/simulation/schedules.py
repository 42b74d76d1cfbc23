"""Schedules: nodes of leg angles and of tail angles go in; checked functions of time come out."""

import math
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from ..errors import SimulationError
from ..library import real_array
from .piecewise import Piecewise, blends, checked_nodes, linear, spline

BLENDS = {"linear": linear, "quintic": blends, "spline": spline}


@dataclass(frozen=True, eq=False)
class Reference:
    """Tail angles (K, 2m) in rad at increasing times (K,) in s, held outside: what Pfl can track.

    blend: "quintic", from rest to rest between nodes (equal nodes hold); "spline", a cubic one through all nodes;
    "linear", whose rate jumps.  ``curve`` is the function of time.
    """

    times: object
    angles: object
    blend: str = "quintic"
    curve: Piecewise = field(init=False)

    def __post_init__(self) -> None:
        """Refuse nodes that are no motion."""
        if not isinstance(self.blend, str) or self.blend not in BLENDS:
            raise SimulationError(f"Reference: blend {self.blend!r}: give one of {', '.join(BLENDS)}")
        width = np.shape(self.angles)[1] if np.ndim(self.angles) == 2 else 0
        nodes = checked_nodes("Reference", "angles", (self.times, self.angles), width)
        if len(nodes[0]) < 2:
            raise SimulationError("Reference: one node only: give two or more")
        object.__setattr__(self, "curve", BLENDS[self.blend](*nodes))


@dataclass(frozen=True, eq=False)
class Legs:
    """Leg angles gamma, delta (rad) at increasing times (K,) in s: linear in between, held outside.

    gamma, delta: a number, which never changes; (K,), of both legs; or (K, 2), of the right and the left leg.
    """

    times: object
    gamma: object
    delta: object
    curve: Piecewise = field(init=False)

    def __post_init__(self) -> None:
        """Refuse nodes that are no motion."""
        times = np.atleast_1d(real_array("Legs: times", self.times, error=SimulationError))
        gamma, delta = (_both_legs(name, getattr(self, name), times) for name in ("gamma", "delta"))
        nodes = checked_nodes("Legs", "angles", (times, np.stack([gamma, delta], axis=-1).reshape(len(times), 4)), 4)
        object.__setattr__(self, "curve", linear(*nodes))

    @classmethod
    def fixed(cls, gamma: float, delta: float) -> Self:
        """Legs that do not move."""
        return cls([0.0], gamma, delta)

    @classmethod
    def ramp(cls, gamma: float, delta: tuple[float, float], at: float, rate: float) -> Self:
        """Legs whose delta goes from one angle to another at a rate (rad/s, of any sign) from a time (s) on: a kick."""
        delta = real_array("Legs.ramp: delta", delta, error=SimulationError)
        if delta.shape != (2,):
            raise SimulationError(f"Legs.ramp: delta has shape {delta.shape}: give two angles, from and to")
        numbers = real_array("Legs.ramp: gamma, delta, at, rate", [gamma, *delta, at, rate], error=SimulationError)
        if not np.isfinite(numbers).all() or rate == 0 or delta[0] == delta[1]:
            given = f"Legs.ramp: delta {tuple(delta.tolist())}, at {at!r}, rate {rate!r}"
            raise SimulationError(f"{given}: give finite numbers, two angles that differ, and a rate that is not 0")
        return cls([at, at + math.fabs((delta[1] - delta[0]) / rate)], gamma, delta)


def _both_legs(name: str, value, times: np.ndarray) -> np.ndarray:
    """Return angles (K, 2)."""
    angles = real_array(f"Legs: {name}", value, error=SimulationError)
    if angles.shape not in ((), (len(times),), (len(times), 2)):
        shapes = f"not a number, ({len(times)},) or ({len(times)}, 2)"
        raise SimulationError(f"Legs: {name} has shape {angles.shape}, {shapes}")
    return np.broadcast_to(angles[:, None] if angles.ndim == 1 else angles, (len(times), 2))
