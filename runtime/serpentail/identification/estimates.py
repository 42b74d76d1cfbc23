"""Results of an identification: estimated numbers, torques, and the motion of each trial."""

from dataclasses import dataclass

import numpy as np

from ..basics.short_repr import brief
from ..motion.trajectory import Trajectory
from .tracks import MarkerTracks


@dataclass(frozen=True)
class Estimate:
    """One estimated number with its standard deviation and interval.

    begin: the value at the start of the search; at_bound: the value went to its lower bound, 0 or
    almost 0.
    """

    name: str
    value: float
    std: float
    low: float
    high: float
    unit: str
    begin: float
    at_bound: bool = False

    def __str__(self) -> str:
        told = f"{self.name} = {self.value:.6g} {self.unit}".rstrip()
        if np.isinf(self.high - self.low):
            return f"{told}, not determined"
        return f"{told}, from {self.low:.6g} to {self.high:.6g}"


@dataclass(frozen=True, eq=False)
class EstimatedTorques:
    """Torques at the knots of a trial; ``torques[k]`` is that of tail coordinate k, (U,).

    times (U,) s; values, standard deviations, and interval limits low and high (U, 2m) N m.
    """

    times: np.ndarray
    values: np.ndarray
    std: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __getitem__(self, coordinate: int) -> np.ndarray:
        """Return the values of a tail coordinate (U,); IndexError if there is none."""
        return self.values[:, coordinate]

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class IdentifiedTrial:
    """One trial of an identification.

    tracks: what was seen; trajectory: the motion at its frames; modelled (F, M, 3): positions of
    the markers by the model (m, world); torques: if they were estimated.
    """

    tracks: MarkerTracks
    trajectory: Trajectory
    modelled: np.ndarray
    torques: EstimatedTorques | None

    __repr__ = brief

    @property
    def residuals(self) -> np.ndarray:
        """Seen less modelled positions, (F, M, 3), m; nan in gaps."""
        return self.tracks.positions - self.modelled

    @property
    def power(self) -> np.ndarray:
        """Power of each torque, (F, 2m), W: torque times the rate of its tail coordinate."""
        return self.trajectory.tau * self.trajectory.v[:, 6:]
