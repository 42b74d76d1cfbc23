"""``Rollouts``: the samples, measures and errors of many runs, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.errors import SimulationError, ViewError
from ..model.model import Model
from ..model.parameters import RunParameters
from ..motion.derived import Derived, settled
from ..motion.methods import Exports
from ..motion.text import arrays_of, framed, how_made
from ..motion.trajectory import MONOTONE, Trajectory
from .audit import Audit
from .energies import trajectory_or_error
from .ground import GroundSettings
from .runs.outcomes import Outcomes, Samples, sampled

LATER = (*MONOTONE, "audit", "warnings")  # fields that are derived when they are first used
SHOWN = 3  # runs that a notebook shows over each other


@dataclass(frozen=True, eq=False)
class Source:
    """What one run's trajectory is made from; outcomes by the numbers of the runs."""

    model: Model
    parameters: RunParameters
    ground: GroundSettings
    outcomes: Outcomes
    info: dict[str, Any]

    def model_of(self, k: int) -> Model:
        """Return the model with the parameters of run k."""
        changes = self.parameters.of(k)
        return self.model.with_parameters(**changes) if changes else self.model

    def trajectory(self, k: int, samples: Samples) -> Trajectory:
        """Return the trajectory of run k; raise its error if it failed."""
        samples = replace(samples, info=samples.info | self.info)
        return trajectory_or_error(self.model_of(k), samples, self.ground)


@dataclass(frozen=True, eq=False)
class Rollouts(Exports):
    """k motions of one model, sampled at the same s times; ``rollouts[k]`` is a Trajectory.

    The arrays are read-only, and NaN after the end of a run. ``len(rollouts)`` is k.
    ``rollouts[k]`` has the run's own parameters, counts and contact; for a failed run it raises
    the run's error.

    Attributes
    ----------
    t : ndarray, shape (s,)
        Times (s).
    q : ndarray, shape (k, s, nq)
        Configurations, as in ``Trajectory``.
    v : ndarray, shape (k, s, nv)
        Velocities, as in ``Trajectory``.
    tau : ndarray, shape (k, s, 2m)
        Torques (N m).
    kinetic, potential : ndarray, shape (k, s)
        Energies (J).
    linear_momentum : ndarray, shape (k, s, 3)
        Momentum (kg m/s, world).
    angular_momentum : ndarray, shape (k, s, 3)
        Angular momentum about the centre of mass (kg m^2/s, world).
    bristles : ndarray, shape (k, s, points, 2)
        Stretch of the friction springs (m).
    ends : ndarray, shape (k,)
        Time at which each run ended (s): the last time, an event of ``stop_at``, or the time of
        failure.
    errors : list of SimulationError or None
        Error of each run; its ``trajectory`` is the motion up to the failure.
    audit : Audit
        Work, impulses, and what these do not account for; arrays of shape (k, ...).
    warnings : list of list of str
        For each run, what does not balance. ``rollouts[k].warnings`` also reports motions that
        no animal can make.
    info : dict
        What all runs have in common, JSON-ready; steps, rejected, evaluations and
        factorisations are sums over all runs.

    Examples
    --------
    >>> rollouts = st.simulate(model, starts, v0, t_span=0.3)  # doctest: +SKIP
    >>> rollouts.q[:, -1], rollouts[0].warnings  # doctest: +SKIP
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    kinetic: np.ndarray
    potential: np.ndarray
    linear_momentum: np.ndarray
    angular_momentum: np.ndarray
    bristles: np.ndarray
    ends: np.ndarray
    errors: list[SimulationError | None]
    audit: Audit
    warnings: list[list[str]]
    info: dict[str, Any]
    source: "Source" = field(repr=False)

    def __len__(self) -> int:
        return len(self.q)

    def __getstate__(self) -> dict[str, Any]:
        return settled(self, LATER)

    def __repr__(self) -> str:
        """At most six lines: number of runs, samples, method, and which failed."""
        model, failed = self.source.model, [k for k, e in enumerate(self.errors) if e is not None]
        lines = [
            f"Rollouts of {model.name}, {model.tail_words()}: {len(self)} runs of "
            f"{len(self.t)} samples, {self.t[0]:.6g} to {self.t[-1]:.6g} s",
            arrays_of(self),
            how_made(self.info) + " in all",
        ]
        if failed:
            lines.append(
                f"{len(failed)} failed, the first run {failed[0]}: {self.errors[failed[0]]}"
            )
        warned = sum(map(bool, self.warnings))
        return framed(lines + ([f"{warned} have warnings"] if warned else []))

    def view(self, k: int | Sequence[int], path: str | PathLike[str] = "run.html") -> Path:
        """Write a page that shows one run or several.

        Parameters
        ----------
        k : int or sequence of int
            Numbers of the runs, from 0. A failed run is shown up to its failure.
        path : str or path, default "run.html"
            The .html file.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        ViewError
            There is no such run, or as of ``view``.
        SimulationError
            The run failed before its first sample.
        """
        from ..show.page.view import view

        numbers = [k] if isinstance(k, int | np.integer) else k
        if not isinstance(numbers, Sequence) or any(n not in range(len(self)) for n in numbers):
            raise ViewError(f"k: value {k!r:.200}: needs a run, or runs, from 0 to {len(self) - 1}")
        motions = [self._begun(number) for number in numbers]
        return view(motions, path, names=[f"run {number}" for number in numbers])

    def _repr_html_(self) -> str:
        """Text and page of the first runs, for notebooks."""
        from ..show.page.view import in_notebook

        begun = [k for k, e in enumerate(self.errors) if e is None or e.trajectory is not None]
        begun = begun[:SHOWN]
        names = [f"run {k}" for k in begun]
        return in_notebook(self, lambda: [self._begun(k) for k in begun], names)

    def _begun(self, k: int) -> Trajectory:
        """Return the trajectory of run k, up to its failure if it failed."""
        error = self.errors[k]
        if error is None:
            return self[k]
        if error.trajectory is None:
            raise error
        return error.trajectory

    def __getitem__(self, k: int) -> Trajectory:
        """Return the trajectory of run k, or raise its error."""
        k = range(len(self))[k]
        error = self.errors[k]
        if error is not None:
            raise error
        arrays = {name: getattr(self, name)[k] for name in ("q", "v", "tau", "bristles")}
        return self.source.trajectory(k, sampled(self.t, arrays, self.source.outcomes[k]))


for _name in LATER:
    setattr(Rollouts, _name, Derived(_name))
