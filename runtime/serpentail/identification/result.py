"""What an identification comes to: parameters with intervals, motions, torques, residuals."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import IdentificationError
from ..model.model import Model
from ..motion.origin import origin
from ..motion.table import as_text
from ..motion.trajectory import Trajectory
from .certainty import Combination
from .placement import Placements
from .tracks import MarkerTracks


@dataclass(frozen=True)
class Estimate:
    """One estimated number with its standard deviation and interval; begin: what the search began
    with; at_bound: it went to 0, below which it cannot be.
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
    """Torques at the knots of a trial: times (U,) s; values and their standard deviations (U, 2m)
    N m; intervals low, high (U, 2m).
    """

    times: np.ndarray
    values: np.ndarray
    std: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, eq=False)
class IdentifiedTrial:
    """One trial: what was seen, the motion at its frames, where the model has the markers (F, M, 3)
    m, the torques where these were estimated.
    """

    tracks: MarkerTracks
    trajectory: Trajectory
    modelled: np.ndarray
    torques: EstimatedTorques | None

    @property
    def residuals(self) -> np.ndarray:
        """Seen less modelled positions (F, M, 3), m; nan in gaps."""
        return self.tracks.positions - self.modelled

    @property
    def power(self) -> np.ndarray:
        """Power of each torque (F, 2m), W: tau times the rate of its tail coordinate."""
        return self.trajectory.tau * self.trajectory.v[:, 6:]


@dataclass(frozen=True, eq=False)
class Identification:
    """Parameters, motions and torques that fit marker tracks best, and how certain they are.

    parameters: an Estimate of each number; covariance (P, P) of them, SI, inf where the data
    determine nothing; singular_values (P,) of the information about relative changes: each is 1
    over a relative standard deviation; undetermined: combinations that are known to no better than
    a factor.  noise: standard deviation of a marker's coordinate, m, stated or estimated.
    model: with these parameters; placed: the markers, with these offsets; trials; confidence of the
    intervals; iterations; success: whether the search converged; seconds that it took.
    """

    model: Model
    placed: Placements
    parameters: tuple[Estimate, ...]
    covariance: np.ndarray
    singular_values: np.ndarray
    undetermined: tuple[Combination, ...]
    noise: float
    confidence: float
    trials: tuple[IdentifiedTrial, ...]
    iterations: int
    success: bool
    seconds: float

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of a name, such as "torso_inertia[0]" or "marker:head.x"."""
        for each in self.parameters:
            if each.name == name:
                return each
        names = ", ".join(each.name for each in self.parameters)
        raise IdentificationError(f"parameters: value {name!r}: there are {names or 'none'}")

    @property
    def trajectory(self) -> Trajectory:
        """The motion of the first trial."""
        return self.trials[0].trajectory

    @property
    def report(self) -> dict[str, Any]:
        """What came out, ready for JSON; intervals of what the data do not tell are null."""
        told: dict[str, Any] = {
            "success": self.success,
            "iterations": self.iterations,
            "seconds": self.seconds,
            "noise_m": self.noise,
            "confidence": self.confidence,
            "parameters": {each.name: _row(each) for each in self.parameters},
            "undetermined": [str(each) for each in self.undetermined],
            "rms_m": {},
        }
        for k, trial in enumerate(self.trials):
            rms = np.sqrt(np.nanmean(np.sum(trial.residuals**2, axis=2), axis=0))
            name = "rms_m" if len(self.trials) == 1 else f"rms_m of trial {k + 1}"
            told[name] = dict(zip(trial.tracks.names, rms.tolist(), strict=True))
            if trial.torques is not None:
                told.setdefault("peak_torque_Nm", []).append(
                    float(np.abs(trial.trajectory.tau).max())
                )
                told.setdefault("peak_power_W", []).append(float(np.abs(trial.power).max()))
        return {name: value for name, value in told.items() if value != {}}

    @property
    def table(self) -> str:
        """The parameters as lines: value, unit, standard deviation, interval."""
        rows = {
            each.name: f"{each.value:.5g} {each.unit}, std {each.std:.2g}, "
            f"{self.confidence:.0%}: {each.low:.5g} to {each.high:.5g}"
            for each in self.parameters
        }
        return as_text(rows)

    def __repr__(self) -> str:
        head = f"<Identification of {self.model.name}: {len(self.trials)} trials, noise "
        head += f"{1e3 * self.noise:.3g} mm, {'converged' if self.success else 'NOT converged'}"
        lines = [*map(str, self.parameters), *(f"undetermined: {x}" for x in self.undetermined)]
        return "\n  ".join([head, *lines]) + ">"

    def plot(self, path: str | PathLike[str] | None = None, trial: int = 0) -> Any:
        """Draw residuals, torques and power of a trial over time; return figure and axes.

        path: also write it to this .pdf, .png or .svg file.  ExtraMissing without the extra "plot".
        """
        from ..pictures.residuals import residual_figure

        chosen = self._trial(trial)
        bands = chosen.torques
        return residual_figure(
            chosen.trajectory,
            (chosen.tracks.names, chosen.residuals, self.noise),
            None if bands is None else (bands.times, bands.low, bands.high),
            path,
        )

    def view(self, path: str | PathLike[str] = "identified.html") -> Path:
        """Write the page of the motions with the seen markers over the model; return its path."""
        from ..viewer.view import view

        names = None
        if len(self.trials) > 1:
            names = [f"trial {k + 1}" for k in range(len(self.trials))]
        motions = [trial.trajectory for trial in self.trials]
        seen = [trial.tracks.positions for trial in self.trials]
        return view(motions, path, names=names, markers=seen)

    def _trial(self, k: Any) -> IdentifiedTrial:
        """Return a trial by its index."""
        if not isinstance(k, int) or not 0 <= k < len(self.trials):
            raise IdentificationError(f"trial: value {k!r}: needs 0 to {len(self.trials) - 1}")
        return self.trials[k]


def _row(each: Estimate) -> dict[str, Any]:
    """Return an estimate, ready for JSON."""
    row = {"value": each.value, "std": each.std, "low": each.low, "high": each.high}
    finite = {name: x if np.isfinite(x) else None for name, x in row.items()}
    return finite | {"unit": each.unit, "begin": each.begin, "at_bound": each.at_bound}


def trajectory_of(
    model: Model, times: np.ndarray, states: np.ndarray, tau: np.ndarray
) -> Trajectory:
    """Return states (F, nx) and torques (F, 2m) at times as a motion."""
    q, v = states[:, : model.nq], states[:, model.nq :]
    kinetic, potential = model.energy(q, v)
    linear, angular = model.momentum(q, v)
    info = {"kind": "identified"} | origin(model)
    return Trajectory(times, q, v, tau, kinetic, potential, linear, angular, info, model=model)
