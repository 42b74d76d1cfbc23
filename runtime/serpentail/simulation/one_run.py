"""Makes one run, and makes it again: less exactly, or with samples at other times."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..basics.errors import SimulationError
from ..basics.progress import Stage
from ..model.lazy import lazy_property
from ..motion.trajectory import Trajectory
from .callback import Watch, Watched
from .controllers.actuation import RunActuations
from .controllers.controller import Controller
from .energies import trajectory_or_error
from .gradients.gradient import Change, Gradient, jvp, refuse, vjp
from .gradients.tape import Tape
from .ground import GroundSettings
from .methods import SCIPY, IntegrationMethod
from .records import Records
from .runs.outcomes import Samples
from .runs.single import CompiledRun, RunSet
from .start import Start


def integrate(runs: RunSet, watch: Watch | None = None) -> Samples:
    """Return the samples of a single run; a function may watch them."""
    run = CompiledRun(runs)
    watched = None if watch is None else Watched(watch, runs.model, runs.ground)
    with Stage("simulate", runs.model.name) as stage:
        if runs.method.name in SCIPY:
            from .runs.scipy_methods import integrate_by_scipy

            samples = integrate_by_scipy(run, watched)
        else:
            samples = run.samples(run.go(look=partial(_look, run, stage, watched)))
    if watched is not None:
        watched.end(samples)
    return samples


def _look(run: CompiledRun, stage: Stage, watched: Watched | None) -> None:
    """Report the progress of a run in C, and its new samples."""
    done = run.record.done
    stage.tell(done / len(run.runs.start.times))
    if watched is not None:
        watched.look(done, lambda first: run.part(first, done))


@dataclass(frozen=True, eq=False)
class RunAgain:
    """All that a run was made of."""

    start: Start
    ground: GroundSettings
    controller: Controller
    method: IntegrationMethod

    def coarser(self, coarse: int, last: Trajectory | None = None) -> Trajectory:
        """Return the run made again, less exactly; of a sequence from the end of the last part.

        SimulationError if it fails, or the last part ends too late.
        """
        start, ground = self.start, self.ground
        if last is not None:
            start = replace(start, q0=last.q[-1:], v0=last.v[-1:], start=float(last.t[-1]))
            if last.contact is not None:
                ground = replace(ground, bristles=last.contact.bristles[-1:])
            if start.start >= start.end:
                raise SimulationError(f"at t = {start.start:.6g} s a phase ends after the next one")
        method = self.method.coarser(coarse, start.interval)
        samples = integrate(self.runs(start, ground, method))
        info = samples.info | method.info
        return trajectory_or_error(start.model, replace(samples, info=info), ground)

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q (n, nq) and v (n, nv) at times (n,) of the run, by the polynomials of its steps.

        Its own samples are made, too: adaptive steps do not depend on samples, and others are cut
        at each.
        """
        real = self.start.model.parameter_vector.dtype
        wanted = times.astype(real).astype(float)
        sampled = np.concatenate([self.start.times.astype(real), wanted])
        start = self.start.sampled_at(np.unique(sampled))
        samples = integrate(self.runs(start, self.ground, self.method))
        if samples.failure is not None:
            raise samples.failure
        rows = np.minimum(np.searchsorted(samples.t, wanted), len(samples.t) - 1)
        return samples.q[rows], samples.v[rows]

    @lazy_property
    def tape(self) -> Tape:
        """The run made again with a tape, along which derivatives are taken."""
        refuse(self)
        return Tape(self)

    def vjp(self, *parts: Any) -> Gradient:
        """Return a gradient; see ``Trajectory.vjp``."""
        return vjp(self, parts)

    def jvp(self, *parts: Any) -> Change:
        """Return a change; see ``Trajectory.jvp``."""
        return jvp(self, *parts)

    def runs(self, start: Start, ground: GroundSettings, method: IntegrationMethod) -> RunSet:
        """Return a run to make, with the same controller."""
        model = start.model
        actuations = RunActuations(Records(model), self.controller, start, ground)
        return RunSet(actuations, start, ground, model.parameters_of_runs(None, 1), method)
