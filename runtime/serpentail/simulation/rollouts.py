"""Many runs at once, on all cores: their samples, measures and errors as one set of arrays."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from os import PathLike
from pathlib import Path
from threading import Event
from typing import Any, cast

import numpy as np

from ..errors import SimulationError, StateError, ViewError
from ..model.kernel import RunKernel
from ..model.model import Model
from ..model.parameters import RunParameters
from ..model.workers import cores, in_turn
from ..motion.trajectory import Trajectory
from .actuation import Actuation
from .batched_runs import BatchedRuns, worth_batching
from .compiled_run import COUNTS, PAUSED, CompiledRun, Memory, Outcome, Samples, sampled
from .ground import Ground
from .measured import trajectory_or_error
from .methods import SCIPY, IntegrationMethod

MEASURES = {"energy": ("kinetic", "potential"), "momentum": ("linear_momentum", "angular_momentum")}


@dataclass(frozen=True, eq=False)
class Source:
    """What a single run of rollouts is made of anew; outcomes by the numbers of the runs."""

    model: Model
    parameters: RunParameters
    ground: Ground
    outcomes: dict[int, Outcome]
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
class Rollouts:
    """k motions, sampled at the same s times, in read-only arrays; NaN after a motion's end.

    t (s,) s; q (k, s, 7+2m), v (k, s, 6+2m); tau (k, s, 2m) N m; kinetic, potential (k, s) J;
    linear_momentum, angular_momentum (k, s, 3); bristles (k, s, points, 2) m: as Trajectory has
    them.  ends (k,) s: when each run ended: at the last time, at an event of ``stop_at``, or where
    it failed.  errors: None or the SimulationError of each run, which keeps the trajectory up to
    there.  info: what all have in common, JSON-ready; steps, rejected, evaluations and
    factorisations are those of all.  ``rollouts[k]`` is the Trajectory of run k, with its own
    parameters, counts and contact, or raises its error.
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
    info: dict[str, Any]
    source: "Source" = field(repr=False)

    def __len__(self) -> int:
        return len(self.q)

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


class ParallelRuns:
    """Runs on their way: threads take them up in turn, and write samples, measures and outcomes."""

    def __init__(self, memory: Memory, actuation: Actuation, method: IntegrationMethod):
        runs, samples = memory.start.runs, memory.start.intervals + 1
        self.memory, self.actuation, self.method = memory, actuation, method
        # tasks of the threads: runs, or groups of them
        self.batched: BatchedRuns | None = None
        self.tasks = runs
        if worth_batching(memory, actuation, method):
            self.batched = BatchedRuns(memory, actuation, method)
            self.tasks = self.batched.groups
        of_python = method.name in SCIPY or any(parts.user is not None for parts in actuation.parts)
        self.threads = 1 if of_python else min(cores(), self.tasks)
        # what they come to
        self.model = memory.records.model
        self.outcomes: dict[int, Outcome] = {}
        self.source = Source(
            self.model, memory.parameters, memory.ground, self.outcomes, method.info
        )
        self.measures: dict[str, np.ndarray] = {}
        for kernel in map(self.model.kernel, MEASURES):
            for name, shape in zip(MEASURES[kernel.name], kernel.out_shapes, strict=True):
                self.measures[name] = np.zeros((runs, samples, *shape), kernel.dtype)
        self.unmeasured: list[int] = []  # whose energy or momentum no number holds

    def run_singly(self, numbers: Iterator[int], ended: Event) -> None:
        """Take up runs in one thread until none is left, or ``ended`` is set."""
        run = CompiledRun(self.memory, self.actuation, self.method)
        measures = [self._rows(name) for name in MEASURES]
        for k in numbers:
            run.begin(k)
            outcome = self._by_scipy(run) if self.method.name in SCIPY else in_c(run, ended)
            if outcome is None:
                return
            self._keep(k, outcome, measures)

    def run_batches(self, batched: BatchedRuns, groups: Iterator[int], ended: Event) -> None:
        """Take up groups of runs; those among which one cannot go on are made again, one by one."""
        start, measures = self.memory.start, [self._rows(name) for name in MEASURES]
        steps = len(batched.steps.lengths)
        info = dict.fromkeys(COUNTS, 0) | {"steps": steps, "evaluations": 4 * steps}
        for group in groups:
            completed, runs = batched.go(group, ended), batched.runs(group)
            if completed is None:
                return
            if not completed:
                self.run_singly(iter(runs), ended)
                continue
            for k in runs:
                self._keep(k, Outcome(start.intervals + 1, start.end, dict(info)), measures)

    def _keep(self, k: int, outcome: Outcome, measures: list[RunKernel]) -> None:
        """Keep and measure what run k came to; an error that is not its own ends all runs."""
        if not isinstance(outcome.failure, SimulationError | None):
            raise outcome.failure
        self.outcomes[k] = outcome
        if outcome.failure is not None:
            return  # measured with its error
        try:
            for measure in measures:
                measure(k, outcome.done)
        except StateError:
            self.unmeasured.append(k)

    def _by_scipy(self, run: CompiledRun) -> Outcome:
        """Return what a run came to by one of SciPy's methods, its samples kept."""
        from .scipy_methods import integrate_by_scipy

        try:
            samples = integrate_by_scipy(run, self.method)
        except SimulationError as error:
            return Outcome(0, self.memory.start.start, {}, error)
        done = len(samples.t)
        for name, array in self.memory.out.items():
            array[run.k, :done] = getattr(samples, name).reshape(done, array.shape[2])
        return Outcome(done, samples.t[-1], samples.info, samples.failure)

    def rollouts(self, info: dict[str, Any]) -> Rollouts:
        """Return what all runs came to; info: what else is to be told of them."""
        outcomes = [self.outcomes[k] for k in range(len(self.outcomes))]
        # the error of each run that failed, or whose measures no number holds
        failed = {k for k, outcome in self.outcomes.items() if outcome.failure is not None}
        errors: list[SimulationError | None] = [None] * len(outcomes)
        for k in sorted(failed.union(self.unmeasured)):
            errors[k] = self._judge(k)
        # counts of all runs together
        counts = {name: sum(each.info.get(name, 0) for each in outcomes) for name in COUNTS}
        abreast = 1 if self.batched is None else self.batched.states
        shared = {"model": self.model.name, "threads": self.threads, "abreast": abreast}
        info = counts | self.method.info | shared | info
        return Rollouts(**self._arrays(outcomes), errors=errors, info=info, source=self.source)

    def _arrays(self, outcomes: list[Outcome]) -> dict[str, np.ndarray]:
        """Return samples and measures, nan after the end of a run, read-only."""
        arrays = self.memory.out | self.measures
        arrays = {name: np.asarray(array, float) for name, array in arrays.items()}
        for k, outcome in enumerate(outcomes):
            if outcome.done < len(self.memory.start.times):
                for array in arrays.values():
                    array[k, outcome.done :] = np.nan
        shape = (*arrays["q"].shape[:2], self.memory.ground.points, 2)
        arrays["bristles"] = arrays["bristles"].reshape(shape)
        arrays["t"] = np.array(self.memory.start.times)
        arrays["ends"] = np.array([outcome.end for outcome in outcomes])
        for array in arrays.values():
            array.setflags(write=False)
        return arrays

    def _judge(self, k: int) -> SimulationError | None:
        """Return the error that ended run k; measure it up to there."""
        outcome = self.outcomes[k]
        error: SimulationError | None = None
        trajectory: Trajectory | None
        try:
            trajectory = self.source.trajectory(k, self.memory.samples(k, outcome))
        except SimulationError as caught:
            trajectory, error = caught.trajectory, caught
        for name, array in self.measures.items():
            measured = np.nan if trajectory is None else getattr(trajectory, name)[: outcome.done]
            array[k, : outcome.done] = measured
        return error

    def _rows(self, name: str) -> RunKernel:
        """Return a function of the model as it measures samples."""
        inputs = [self.memory.out[argument] for argument in ("q", "v")]
        outputs = [self.measures[measure] for measure in MEASURES[name]]
        return RunKernel(self.model.kernel(name), self.memory.parameters.vectors, inputs, outputs)


def in_c(run: CompiledRun, ended: Event) -> Outcome | None:
    """Return what a run came to, None where it was given up."""
    status = run.go(ended)
    return None if status == PAUSED else run.outcome(status)


def run_parallel(memory: Memory, actuation: Actuation, method: IntegrationMethod) -> ParallelRuns:
    """Make all runs, on all cores unless Python acts in them."""
    runs = ParallelRuns(memory, actuation, method)
    work = partial(runs.run_batches, runs.batched) if runs.batched else runs.run_singly
    in_turn(runs.tasks, runs.threads, work)
    return runs
