"""Makes a single run, and reports its progress."""

from functools import partial

from ...basics.progress import Stage
from ..callback import Watch, Watched
from ..methods import SCIPY
from .outcomes import Samples
from .single import CompiledRun, RunSet


def integrate(runs: RunSet, watch: Watch | None = None) -> Samples:
    """Return the samples of a single run; a function may watch them."""
    run = CompiledRun(runs)
    watched = None if watch is None else Watched(watch, runs.model, runs.ground)
    with Stage("simulate", runs.model.name) as stage:
        if runs.method.name in SCIPY:
            from .scipy_methods import integrate_by_scipy

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
        watched.look(done, lambda first: run.runs.part(run.k, first, done))
