"""Makes many runs at once, on all cores, and measures them."""

from collections.abc import Iterator
from functools import partial
from threading import Event
from typing import Any

import numpy as np

from ..errors import SimulationError, StateError
from ..model.cores import threads as allowed
from ..model.kernel import RunKernel
from ..model.workers import in_turn
from ..motion.derived import made
from ..motion.trajectory import Trajectory
from ..stages import Stage
from .actuation import Actuation
from .audit import BALANCED, Audit, audited, warnings_of
from .batched_runs import BatchedRuns, worth_batching
from .compiled_run import COUNTS, PAUSED, CompiledRun, Memory, Outcome
from .measured import MEASURES, certain
from .methods import SCIPY, IntegrationMethod
from .rollouts import Rollouts, Source


class ParallelRuns:
    """Runs on their way: threads take them up in turn, and write samples, measures and outcomes."""

    def __init__(
        self, memory: Memory, actuation: Actuation, method: IntegrationMethod, threads: int | None
    ):
        runs, samples = memory.start.runs, memory.start.intervals + 1
        self.memory, self.actuation, self.method = memory, actuation, method
        # tasks of the threads: runs, or groups of them
        self.batched: BatchedRuns | None = None
        self.tasks = runs
        if worth_batching(memory, actuation, method):
            self.batched = BatchedRuns(memory, actuation, method)
            self.tasks = self.batched.groups
        of_python = method.name in SCIPY or actuation.of_python
        self.threads = 1 if of_python else min(allowed(threads), self.tasks)
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
        self.late: list[int] = []  # measured at both ends so far
        self.unmeasured: list[int] = []  # whose energy or momentum no number holds
        self.stop: KeyboardInterrupt | None = None  # what ended all before their end

    @property
    def part_done(self) -> float:
        """Which part of the runs has ended."""
        return len(self.outcomes) / self.memory.start.runs

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
                ledger = self.memory.state["ledger"][k]
                self._keep(k, Outcome(start.intervals + 1, start.end, ledger, dict(info)), measures)

    def _keep(self, k: int, outcome: Outcome, measures: list[RunKernel]) -> None:
        """Keep and measure what run k came to; an error that is not its own ends all runs."""
        if not isinstance(outcome.failure, SimulationError | None):
            raise outcome.failure
        self.outcomes[k] = outcome
        if outcome.failure is not None:
            return  # measured with its error
        arrays = [self.memory.out[name][k, : outcome.done] for name in ("q", "v", "bristles")]
        late = certain(self.model, self.method.name, (self.memory.parameters.vectors[k], *arrays))
        try:
            for measure in measures:
                measure(k, 1 if late else outcome.done)
                if late:
                    measure(k, 1, outcome.done - 1)
            if late:
                self.late.append(k)
        except StateError:
            self.unmeasured.append(k)

    def _by_scipy(self, run: CompiledRun) -> Outcome:
        """Return what a run came to by one of SciPy's methods, its samples kept."""
        from .scipy_methods import integrate_by_scipy

        try:
            samples = integrate_by_scipy(run, self.method)
        except SimulationError as error:
            return Outcome(0, self.memory.start.start, run.state["ledger"], {}, error)
        done = len(samples.t)
        for name, array in self.memory.out.items():
            array[run.k, :done] = getattr(samples, name).reshape(done, array.shape[2])
        return Outcome(done, samples.t[-1], samples.ledger, samples.info, samples.failure)

    def rollouts(self, info: dict[str, Any]) -> Rollouts:
        """Return what all runs came to, or raise Ctrl-C, which keeps it as ``motion``.

        info: what else is to be told of them.
        """
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
        arrays = self._arrays(outcomes)
        books = self._audit(arrays["ends"], outcomes)
        eps = float(np.finfo(self.memory.records.dtype).eps)
        warnings = [
            [] if errors[k] else warnings_of(books.of(k), self.method.info | outcome.info, eps)
            for k, outcome in enumerate(outcomes)
        ]
        told = {"errors": errors, "audit": books, "warnings": warnings, "info": info}
        found = made(Rollouts, arrays | told | {"source": self.source}, self.measured)
        if self.stop is not None:
            vars(self.stop)["motion"] = found
            raise self.stop
        return found

    def measured(self, _: str) -> dict[str, np.ndarray]:
        """Return energies and momenta of all runs, nan after the end of a run, read-only."""

        def work(numbers: Iterator[int], _: Event) -> None:
            measures = [self._rows(name) for name in MEASURES]
            for number in numbers:
                k = self.late[number]
                for measure in measures:
                    measure(k, self.outcomes[k].done)

        in_turn(len(self.late), self.threads, work)
        return {name: read_only(array) for name, array in self.measures.items()}

    def _audit(self, times: np.ndarray, outcomes: list[Outcome]) -> Audit:
        """Return the books of all runs, from start to end; nan of those that failed."""
        last = np.array([max(outcome.done, 1) - 1 for outcome in outcomes])
        each, ends = np.arange(len(outcomes)), {}
        for name in BALANCED:
            array = self.measures[name]
            ends[name] = np.stack([array[:, 0], array[each, last]], axis=1).astype(float)
        for k, outcome in enumerate(outcomes):
            if outcome.failure is not None:
                ends["kinetic"][k] = np.nan
            elif outcome.stop is not None:  # between samples
                model, state = self.source.model_of(k), (outcome.stop["q"], outcome.stop["v"])
                ends["kinetic"][k, 1], ends["potential"][k, 1] = model.energy(*state)
                ends["linear_momentum"][k, 1] = model.momentum(*state)[0]
        span = times - self.memory.start.start
        ledger = np.array([outcome.ledger for outcome in outcomes])
        return audited(self.model, self.memory.parameters.values, ledger, span, ends)

    def _arrays(self, outcomes: list[Outcome]) -> dict[str, np.ndarray]:
        """Return samples, nan after the end of a run as in the measures, read-only."""
        for k, outcome in enumerate(outcomes):
            if outcome.done < len(self.memory.start.times):
                for array in (*self.memory.out.values(), *self.measures.values()):
                    array[k, outcome.done :] = np.nan
        arrays = {name: np.asarray(array, float) for name, array in self.memory.out.items()}
        shape = (*arrays["q"].shape[:2], self.memory.ground.points, 2)
        arrays["bristles"] = arrays["bristles"].reshape(shape)
        arrays["t"] = np.array(self.memory.start.times)
        arrays["ends"] = np.array([outcome.end for outcome in outcomes])
        return {name: read_only(array) for name, array in arrays.items()}

    def _judge(self, k: int) -> SimulationError | None:
        """Return the error that ended run k; measure it up to there."""
        outcome = self.outcomes[k]
        if not outcome.done and isinstance(outcome.failure, SimulationError):
            return outcome.failure  # it never began
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


def read_only(array: np.ndarray) -> np.ndarray:
    """Return an array as doubles that nobody writes."""
    array = np.asarray(array, float).view()
    array.setflags(write=False)
    return array


def in_c(run: CompiledRun, ended: Event) -> Outcome | None:
    """Return what a run came to, None where it was given up."""
    status = run.go(ended)
    return None if status == PAUSED and run.actuation.error is None else run.outcome(status)


def run_parallel(
    memory: Memory, actuation: Actuation, method: IntegrationMethod, threads: int | None
) -> ParallelRuns:
    """Make all runs, in so many threads unless Python acts in them; Ctrl-C ends all."""
    runs = ParallelRuns(memory, actuation, method, threads)
    work = partial(runs.run_batches, runs.batched) if runs.batched else runs.run_singly
    try:
        with Stage("simulate", f"{memory.start.runs} runs of {runs.model.name}") as stage:
            in_turn(runs.tasks, runs.threads, work, lambda: stage.tell(runs.part_done))
    except KeyboardInterrupt as stop:
        runs.stop = stop
        for k in set(range(memory.start.runs)) - runs.outcomes.keys():
            error = SimulationError("Ctrl-C came before its end: simulate it again")
            runs.outcomes[k] = Outcome(0, memory.start.start, memory.state["ledger"][k], {}, error)
    return runs
