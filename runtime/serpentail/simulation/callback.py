"""Passes the samples of a run to a user's function while it is made."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..basics.checks import refusal
from ..basics.errors import SimulationError, StateError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from .energies import measured
from .ground import LANDED_AT, GroundSettings
from .runs.outcomes import Samples

EVERY = 0.1  # s from the end of one call to the next, at least

Watch = Callable[[Trajectory], object]


def checked_watch(watch: Any, many: bool) -> Watch | None:
    """Return the function to call; SimulationError if it is wrong."""
    if watch is not None and not callable(watch):
        raise refusal("watch", watch, "a function of a Trajectory, or None", SimulationError)
    if watch is not None and many:
        raise SimulationError("watch: many starts are not watched: leave it out, or give one start")
    return watch


class Watched:
    """A run that is watched: the number of samples passed on, and the time of the last call."""

    def __init__(self, watch: Watch, model: Model, ground: GroundSettings):
        self.watch, self.model, self.ground = watch, model, ground
        self.seen, self.last_call = 0, -np.inf

    def look(self, done: int, part: Callable[[int], Samples]) -> None:
        """Pass on the new samples, which ``part`` makes, if it is time."""
        if done > self.seen and time.perf_counter() - self.last_call >= EVERY:
            self._call(part(self.seen))

    def end(self, samples: Samples) -> None:
        """Pass on the remaining samples, unless the user ended the run."""
        if len(samples.t) > self.seen and isinstance(samples.failure, SimulationError | None):
            self._call(samples_from(samples, self.seen))

    def _call(self, samples: Samples) -> None:
        """Call the function."""
        self.seen += len(samples.t)
        try:
            motion = measured(self.model, samples, self.ground)
        except StateError:  # no number holds its energy: the run will say so itself
            return
        self.watch(motion)
        self.last_call = time.perf_counter()


def samples_from(samples: Samples, first: int) -> Samples:
    """Return samples from one on, as a part of a run, without its ledger and its failure."""
    arrays: dict[str, Any] = {
        name: getattr(samples, name)[first:] for name in ("t", "q", "v", "tau", "bristles")
    }
    info = {name: at for name, at in samples.info.items() if name == LANDED_AT}
    return replace(samples, **arrays, ledger=np.zeros(0), info=info, failure=None)
