"""Energies, momenta and books of many runs, most of them when somebody asks."""

from collections.abc import Callable, Iterable, Iterator
from threading import Event
from typing import Any

import numpy as np

from ...basics.errors import SimulationError, StateError
from ...compiling.threads import in_turn
from ...model.chains import of_all_coordinates
from ...model.kernel import RunKernel
from ...model.passive import stored_energy
from ...motion.trajectory import Trajectory
from ..audit import BALANCED, Audit, Between, allowance, audited, warnings_of
from ..energies import MEASURES, certain_runs
from ..rollouts import Source
from .single import RunSet


class EnergiesOfRuns:
    """Derived fields of runs' samples: called with a name, it returns the field and related ones.

    arrays: energies and momenta of all runs; ``late``: runs for which they are certainly finite, so
    that they can be derived when they are used.
    """

    def __init__(self, made: RunSet, source: Source, threads: int) -> None:
        self.runs, self.method, self.source, self.threads = made, made.method, source, threads
        self.model, self.outcomes = source.model, source.outcomes
        runs, samples = made.start.runs, made.start.intervals + 1
        self.arrays: dict[str, np.ndarray] = {}
        for kernel in map(self.model.kernel, MEASURES):
            for name, shape in zip(MEASURES[kernel.name], kernel.out_shapes, strict=True):
                self.arrays[name] = np.zeros((runs, samples, *shape), kernel.dtype)
        self.late = np.zeros(runs, bool)
        self.unmeasured: list[int] = []  # whose energy or momentum no number holds
        self.failed: list[int] = []

    def of_thread(self) -> Callable[[np.ndarray], None]:
        """Return a function that measures runs for which this cannot wait; for one thread."""
        kernels = self._kernels()

        def measure(runs: np.ndarray) -> None:
            if not len(runs):
                return
            whole = runs[-1] - runs[0] + 1 == len(runs)  # then nothing is copied
            of = slice(runs[0], runs[-1] + 1) if whole else runs
            arrays = [self.runs.out[name][of] for name in ("q", "v", "bristles")]
            numbers = (self.runs.parameters.vectors[of], *arrays)
            late = certain_runs(self.model, self.method.name, numbers)
            self.late[runs[late]] = True
            for k in runs[~late].tolist():
                try:
                    for kernel in kernels:
                        kernel(k, int(self.outcomes.done[k]))
                except StateError:
                    self.unmeasured.append(k)

        return measure

    def errors(self) -> list[SimulationError | None]:
        """Return the error of each run that failed, or whose measures no number holds."""
        errors: list[SimulationError | None] = [None] * len(self.outcomes)
        self.failed = sorted({*self.outcomes.failures, *self.unmeasured})
        for k in self.failed:
            errors[k] = self._judge(k)
        return errors

    def _judge(self, k: int) -> SimulationError | None:
        """Return the error that ended run k; measure it up to there."""
        outcome = self.outcomes[k]
        if not outcome.done and isinstance(outcome.failure, SimulationError):
            return outcome.failure  # it never began
        error: SimulationError | None = None
        trajectory: Trajectory | None
        try:
            trajectory = self.source.trajectory(k, self.runs.samples(k, outcome))
        except SimulationError as caught:
            trajectory, error = caught.trajectory, caught
        for name, array in self.arrays.items():
            measured = np.nan if trajectory is None else getattr(trajectory, name)[: outcome.done]
            array[k, : outcome.done] = measured
        return error

    def __call__(self, name: str) -> dict[str, Any]:
        """Return fields of rollouts by name, read-only arrays with nan after the end of a run."""
        if name in ("audit", "warnings"):
            books = self._audit()
            return {"audit": books, "warnings": self._warnings(books)}
        self._measure(lambda k: [(int(self.outcomes.done[k]), 0)])
        return {name: read_only(array) for name, array in self.arrays.items()}

    def _measure(self, spans: Callable[[int], list[tuple[int, int]]]) -> None:
        """Measure runs that wait for it: of each some rows from one on."""
        waiting = np.flatnonzero(self.late).tolist()

        def work(numbers: Iterator[int], _: Event) -> None:
            kernels = self._kernels()
            for k in (waiting[number] for number in numbers):
                for rows, begin in spans(k):
                    for kernel in kernels:
                        kernel(k, rows, begin)

        in_turn(len(waiting), min(self.threads, max(1, len(waiting))), work)

    def _kernels(self) -> list[RunKernel]:
        """Return the functions of the model that measure samples."""
        vectors, out = self.runs.parameters.vectors, self.runs.out
        inputs = [out["q"], out["v"]]
        return [
            RunKernel(self.model.kernel(name), vectors, inputs, [self.arrays[each] for each in of])
            for name, of in MEASURES.items()
        ]

    def _audit(self) -> Audit:
        """Return the audits of all runs, from start to end; nan for those that failed."""
        self._measure(lambda k: [(1, 0), (1, int(self.outcomes.done[k]) - 1)])
        last, each = np.maximum(self.outcomes.done, 1) - 1, np.arange(len(self.outcomes))
        ends = {}
        for name in BALANCED:
            array = self.arrays[name]
            ends[name] = np.stack([array[:, 0], array[each, last]], axis=1).astype(float)
        q, values = self.runs.out["q"], self.runs.parameters.values
        tail = self.model.layout.tail_q
        tails = (q[:, 0, tail], q[each, last, tail])
        ends["stored"] = self._stored(tails)
        ends["kinetic"][list(self.outcomes.failures)] = np.nan
        for k, stop in self.outcomes.stops.items():  # between samples
            if k not in self.outcomes.failures:
                model, state = self.source.model_of(k), (stop["q"], stop["v"])
                ends["kinetic"][k, 1], ends["potential"][k, 1] = model.energy(*state)
                ends["linear_momentum"][k, 1] = model.momentum(*state)[0]
        span = self.outcomes.ends - self.runs.start.start
        between = Between(allowance(self.method.info, self._eps), self._all)
        return audited(self.model, values, self.outcomes.ledger, span, ends, between)

    def _all(self, of: np.ndarray) -> dict[str, np.ndarray]:
        """Return what an audit needs of all samples of the runs that are marked."""
        done = self.outcomes.done
        self._measure(lambda k: [(int(done[k]), 0)] if of[k] else [])
        tails = self.runs.out["q"][:, :, self.model.layout.tail_q]
        seen = {name: self.arrays[name].astype(float) for name in BALANCED}
        return seen | {"stored": self._stored(tails.swapaxes(0, 1))}

    def _stored(self, tails: Iterable[np.ndarray]) -> np.ndarray:
        """Return the energy (runs, samples) that tails store, given as (runs, 2m) by sample."""
        values = of_all_coordinates(self.model.layout, self.runs.parameters.values)
        return np.stack([stored_energy(values, tail) for tail in tails], axis=1)

    @property
    def _eps(self) -> float:
        return float(np.finfo(self.runs.records.dtype).eps)

    def _warnings(self, books: Audit) -> list[list[str]]:
        """Return the warnings of each run that did not fail."""
        eps, failed = self._eps, set(self.failed)
        info, infos = self.method.info, self.outcomes.infos
        return [
            [] if k in failed else warnings_of(books.of(k), info | infos.get(k, {}), eps)
            for k in range(len(self.outcomes))
        ]


def read_only(array: np.ndarray) -> np.ndarray:
    """Return an array as doubles that nobody writes."""
    array = np.asarray(array, float).view()
    array.setflags(write=False)
    return array
