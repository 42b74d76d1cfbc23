"""What many runs came to: their samples, measures and errors as one set of arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import SimulationError, ViewError
from ..model.model import Model
from ..model.parameters import RunParameters
from ..motion.account import arrays_of, framed, how_made, tail_of
from ..motion.derived import Derived, settled
from ..motion.exports import Exports
from ..motion.trajectory import MONOTONE, Trajectory
from .audit import Audit
from .compiled_run import Samples, sampled
from .ground import Ground
from .measured import trajectory_or_error
from .outcomes import Outcomes

LATER = (*MONOTONE, "audit", "warnings")  # what is derived when somebody asks
SHOWN = 3  # runs that a notebook shows over each other


@dataclass(frozen=True, eq=False)
class Source:
    """What a single run of rollouts is made of anew; outcomes by the numbers of the runs."""

    model: Model
    parameters: RunParameters
    ground: Ground
    outcomes: Outcomes
    info: dict[str, Any]

    def model_of(self, k: int) -> Model:
        """Return the model with the parameters of run k."""
        changes = self.parameters.of(k)
        return self.model.with_parameters(**changes) if changes else self.model

    def trajectory(self, k: int, samples: Samples) -> Trajectory:
        """Return the trajectory of run k, or raise what ended it."""
        samples = replace(samples, info=samples.info | self.info)
        return trajectory_or_error(self.model_of(k), samples, self.ground)


@dataclass(frozen=True, eq=False)
class Rollouts(Exports):
    """k motions, sampled at the same s times, in read-only arrays; NaN after a motion's end.

    t (s,) s; q (k, s, 7+2m), v (k, s, 6+2m); tau (k, s, 2m) N m; kinetic, potential (k, s) J;
    linear_momentum, angular_momentum (k, s, 3); bristles (k, s, points, 2) m: as Trajectory has
    them.  ends (k,) s: when each run ended: at the last time, at an event of ``stop_at``, or where
    it failed.  errors: None or the SimulationError of each run, which keeps the trajectory up to
    there.  audit: work, impulses and what they do not account for, (k,); warnings: of each run,
    what does not balance; ``rollouts[k].warnings`` tell also what no animal does.  info: what all
    have in common, JSON-ready; steps, rejected, evaluations and factorisations are those of all.
    ``rollouts[k]`` is the Trajectory of run k, with its own parameters, counts and contact, or
    raises its error.
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
        """On at most six lines what they are, and which failed."""
        model, failed = self.source.model, [k for k, e in enumerate(self.errors) if e is not None]
        lines = [
            f"Rollouts of {model.name}, {tail_of(model)}: {len(self)} runs of "
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
        """Write the page of run k, or of several; return its path.  Failed runs show their begin.

        Raises as ``st.view``, or the error of a run that never began.
        """
        from ..viewer.view import view

        numbers = [k] if isinstance(k, int | np.integer) else k
        if not isinstance(numbers, Sequence) or any(n not in range(len(self)) for n in numbers):
            raise ViewError(f"k: value {k!r:.200}: needs a run, or runs, from 0 to {len(self) - 1}")
        motions = [self._begun(number) for number in numbers]
        return view(motions, path, names=[f"run {number}" for number in numbers])

    def _repr_html_(self) -> str:
        """For notebooks: the text, and the page of the first runs that began."""
        from ..viewer.notebook import in_notebook

        begun = [k for k, e in enumerate(self.errors) if e is None or e.trajectory is not None]
        begun = begun[:SHOWN]
        names = [f"run {k}" for k in begun]
        return in_notebook(self, lambda: [self._begun(k) for k in begun], names)

    def _begun(self, k: int) -> Trajectory:
        """Return the trajectory of run k, as far as it went."""
        error = self.errors[k]
        if error is None:
            return self[k]
        if error.trajectory is None:
            raise error
        return cast(Trajectory, error.trajectory)

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
