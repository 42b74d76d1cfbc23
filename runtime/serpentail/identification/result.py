"""``Identification``: parameters with intervals, motions, torques and residuals."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from serpentail_scene.layout import TAIL_V

from ..basics.checks import refusal
from ..basics.errors import IdentificationError
from ..basics.near_names import NearNames
from ..basics.short_repr import brief
from ..model.model import Model
from ..motion.archive import origin
from ..motion.text import as_text
from ..motion.trajectory import Trajectory
from .certainty import Combination
from .placement import Placements
from .tracks import MarkerTracks

if TYPE_CHECKING:
    from ..show.pictures.plot import Figure


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

    @property
    def row(self) -> dict[str, Any]:
        """The estimate, ready for JSON; null in place of numbers that are not determined."""
        row = {"value": self.value, "std": self.std, "low": self.low, "high": self.high}
        finite = {name: x if np.isfinite(x) else None for name, x in row.items()}
        return finite | {"unit": self.unit, "begin": self.begin, "at_bound": self.at_bound}

    def __str__(self) -> str:
        value = f"{self.name} = {self.value:.6g} {self.unit}".rstrip()
        if np.isinf(self.high - self.low):
            return f"{value}, not determined"
        return f"{value}, from {self.low:.6g} to {self.high:.6g}"


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
        return self.trajectory.tau * self.trajectory.v[:, TAIL_V]


@dataclass(frozen=True, eq=False)
class Identification(NearNames):
    """Parameters, motions and torques that fit marker tracks best, and how certain they are.

    ``identification["tail_mass"]`` is the Estimate of that name.

    Attributes
    ----------
    model : Model
        The model with the estimated parameters.
    placed : Placements
        The markers, with their estimated offsets.
    parameters : tuple of Estimate
        Each estimated number: ``name``, ``value``, ``std``, the interval ``low`` to ``high``,
        ``unit``, ``begin``, ``at_bound``.
    covariance : ndarray, shape (P, P)
        Covariance of the parameters, SI; inf if the data determine nothing.
    singular_values : ndarray, shape (P,)
        Singular values of the information on relative changes; each is 1 over a relative
        standard deviation.
    undetermined : tuple of Combination
        Combinations of parameters that are known to a factor at best.
    noise : float
        Standard deviation of a marker's coordinate (m), as given or estimated.
    confidence : float
        Probability of the intervals.
    trials : tuple of IdentifiedTrial
        Each trial: ``tracks``, ``trajectory``, ``modelled``, ``residuals`` (m), ``torques`` and
        ``power`` (W).
    iterations : int
        Iterations of the search.
    success : bool
        Whether the search converged.
    seconds : float
        Time that it took (s).
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
        """JSON-ready summary; intervals that the data do not determine are null."""
        report: dict[str, Any] = {
            "success": self.success,
            "iterations": self.iterations,
            "seconds": self.seconds,
            "noise_m": self.noise,
            "confidence": self.confidence,
            "parameters": {each.name: each.row for each in self.parameters},
            "undetermined": [str(each) for each in self.undetermined],
            "rms_m": {},
        }
        for k, trial in enumerate(self.trials):
            rms = np.sqrt(np.nanmean(np.sum(trial.residuals**2, axis=2), axis=0))
            name = "rms_m" if len(self.trials) == 1 else f"rms_m of trial {k + 1}"
            report[name] = dict(zip(trial.tracks.names, rms.tolist(), strict=True))
            if trial.torques is not None:
                for name, values in (
                    ("peak_torque_Nm", trial.trajectory.tau),
                    ("peak_power_W", trial.power),
                ):
                    report.setdefault(name, []).append(float(np.abs(values).max()))
        return {name: value for name, value in report.items() if value != {}}

    @property
    def table(self) -> str:
        """The parameters as lines of text: value, unit, standard deviation, interval."""
        rows = {
            each.name: f"{each.value:.5g} {each.unit}, std {each.std:.2g}, "
            f"{self.confidence:.0%}: {each.low:.5g} to {each.high:.5g}"
            for each in self.parameters
        }
        return as_text(rows)

    def __repr__(self) -> str:
        head = f"<Identification of {self.model.name}, trials: {len(self.trials)}, noise "
        head += f"{1e3 * self.noise:.3g} mm, {'converged' if self.success else 'NOT converged'}"
        lines = [*map(str, self.parameters), *(f"undetermined: {x}" for x in self.undetermined)]
        return "\n  ".join([head, *lines]) + ">"

    def plot(self, path: str | PathLike[str] | None = None, trial: int = 0) -> tuple["Figure", Any]:
        """Draw residuals, torques and power of a trial over time; needs the extra "plot".

        Parameters
        ----------
        path : str or path, optional
            A .pdf, .png or .svg file to write the figure to.
        trial : int, default 0
            Number of the trial.

        Returns
        -------
        figure : matplotlib.figure.Figure
            The figure.
        axes : ndarray of matplotlib.axes.Axes
            Its axes.

        Raises
        ------
        IdentificationError
            There is no such trial.
        ExtraMissing
            Matplotlib is not installed.
        """
        from ..show.pictures.results import residual_figure

        if not isinstance(trial, int) or not 0 <= trial < len(self.trials):
            raise refusal("trial", trial, f"0 to {len(self.trials) - 1}", IdentificationError)
        chosen = self.trials[trial]
        bands = chosen.torques
        return residual_figure(
            chosen.trajectory,
            (chosen.tracks.names, chosen.residuals, self.noise),
            None if bands is None else (bands.times, bands.low, bands.high, self.confidence),
            path,
        )

    def view(self, path: str | PathLike[str] = "identified.html") -> Path:
        """Write a page of the motions, with the seen markers over the model.

        Parameters
        ----------
        path : str or path, default "identified.html"
            The .html file.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        ViewError, ModelError
            As of ``serpentail.view``.
        """
        from ..show.page.view import view

        several = len(self.trials) > 1
        names = [f"trial {k + 1}" for k in range(len(self.trials))] if several else None
        motions = [trial.trajectory for trial in self.trials]
        seen = [trial.tracks.positions for trial in self.trials]
        return view(motions, path, names=names, markers=seen)


def trajectory_of(
    model: Model, times: np.ndarray, states: np.ndarray, tau: np.ndarray
) -> Trajectory:
    """Return states (F, nx) and torques (F, 2m) at times as a motion."""
    q, v = states[:, : model.nq], states[:, model.nq :]
    kinetic, potential = model.energy(q, v)
    linear, angular = model.momentum(q, v)
    info = {"kind": "identified"} | origin(model)
    return Trajectory(times, q, v, tau, kinetic, potential, linear, angular, info, model=model)
