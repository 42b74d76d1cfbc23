"""Makes many runs at once, on all cores."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from threading import Event
from typing import Any

import numpy as np

from ...basics.errors import SimulationError
from ...basics.progress import Stage
from ...compiling.cores import threads as allowed
from ...compiling.threads import in_turn
from ...model.library import PAUSED
from ...motion.derived import made
from ..acting import Acting
from .lanes import AdaptiveRuns, adaptive_in_lanes
from ..batched_runs import BatchedRuns, shared_steps, worth_batching
from .single import CompiledRun, Memory, Outcome, failed
from ..measured_runs import MeasuredRuns, read_only
from ..methods import SCIPY, IntegrationMethod
from .outcomes import Outcomes, told_by
from ..rollouts import Rollouts, Source
from ..runs_in_turn import RunsInTurn

PILOTS = 64  # runs that are timed before code is compiled for the others


class ParallelRuns:
    """Runs in progress: threads take them in turn, and write samples, measures and outcomes."""

    def __init__(
        self, memory: Memory, acting: Acting, method: IntegrationMethod, threads: int | None
    ):
        self.memory, self.acting, self.method = memory, acting, method
        model, runs = memory.records.model, memory.start.runs
        self.batched: BatchedRuns | AdaptiveRuns | None = None
        of_python = method.name in SCIPY or acting.of_python
        self.threads = 1 if of_python else min(allowed(threads), runs)
        # their outcomes
        self.outcomes = Outcomes(memory)
        self.source = Source(model, memory.parameters, memory.ground, self.outcomes, method.info)
        self.measures = MeasuredRuns(memory, method, self.source, self.threads)
        self.stop: KeyboardInterrupt | None = None  # what ended all runs early

    @property
    def part_done(self) -> float:
        """Which part of the runs has ended."""
        return self.outcomes.count / len(self.outcomes)

    def make(self, stage: Stage) -> None:
        """Make all runs, those abreast that can be and for which it pays."""
        first, runs = 0, self.memory.start.runs
        told = self.memory, self.acting, self.method
        if (steps := shared_steps(*told)) and self._pays(runs, steps):
            self.batched = BatchedRuns(*told)
        elif adaptive_in_lanes(*told):
            if not self._pays(runs, 0):
                # the first runs show how long the others will take
                first = min(PILOTS, runs)
                self._share(first, self._run_in_turn, stage)
            steps = int(self.outcomes.counts["steps"][:first].sum()) // max(first, 1)
            if first == 0 or (first < runs and self._pays(runs - first, steps)):
                self.batched = AdaptiveRuns(*told)
        if self.batched is not None:
            self.parts = self.batched.parts(range(first, runs), self.threads)
            self._share(len(self.parts), self._run_batches, stage)
        elif self._looked_after():
            self._share(runs, self._run_singly, stage)
        else:
            rest = partial(self._run_in_turn, first=first)
            self._share(runs - first, rest, stage)

    def _looked_after(self) -> bool:
        """Tell whether Python has something to do for each run."""
        of_python = self.method.name in SCIPY or self.acting.of_python or self.acting.keeps
        return of_python or bool(self.memory.ground.points)

    def _pays(self, runs: int, steps: int) -> bool:
        """Tell whether it is worthwhile to make runs of about ``steps`` steps in lanes."""
        return worth_batching(self.source.model, runs, steps)

    def _share(self, count: int, work: Callable[..., None], stage: Stage) -> None:
        """Let threads take tasks in turn."""
        if count:
            in_turn(count, min(self.threads, count), work, lambda: stage.tell(self.part_done))

    def _run_singly(self, numbers: Iterator[int], ended: Event) -> None:
        """Take up runs in one thread until none is left, or ``ended`` is set."""
        run = CompiledRun(self.memory, self.acting, self.method)
        measure = self.measures.of_thread()
        for k in numbers:
            run.begin(k)
            outcome = self._by_scipy(run) if self.method.name in SCIPY else in_c(run, ended)
            if outcome is None:
                return
            # an error that is not its own ends all runs
            if not isinstance(outcome.failure, SimulationError | None):
                raise outcome.failure
            self.outcomes.keep(k, outcome)
            if outcome.failure is None:
                measure(np.array([k]))

    def _run_in_turn(self, numbers: Iterator[int], ended: Event, first: int = 0) -> None:
        """The same for runs that need no Python until they end; numbers count from the first."""
        runs = RunsInTurn(self.memory, self.acting, self.method)
        measure, most = self.measures.of_thread(), len(self.outcomes) // (4 * self.threads) + 1
        while taken := list(islice(numbers, min(runs.at_once, most))):
            found = runs.make([first + number for number in taken], ended)
            told = told_by(found.records, self.memory, found.runs)
            self.outcomes.keep_all(found.runs, told)
            wrong = np.flatnonzero(found.statuses)
            for row in wrong.tolist():
                error = failed(int(found.statuses[row]), float(found.records["t"][row]))
                self.outcomes.failures[int(found.runs[row])] = error
            measure(np.delete(found.runs, wrong))

    def _run_batches(self, parts: Iterator[int], ended: Event) -> None:
        """Make runs in lanes.

        A group in which one run fails is made again, one run after another.
        """
        batched, measure = self.batched, self.measures.of_thread()
        assert batched is not None
        for part in parts:
            for runs, told in batched.go(self.parts[part], ended):
                if told is None:
                    self._run_in_turn(iter(runs.tolist()), ended)
                else:
                    self.outcomes.keep_all(runs, told)
                    measure(runs)

    def _by_scipy(self, run: CompiledRun) -> Outcome:
        """Return the outcome of a run by one of SciPy's methods; store its samples."""
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
        """Return the rollouts; after Ctrl-C raise it with these as ``motion``.

        info: further entries of their info.
        """
        errors = self.measures.errors()
        # counts of all runs together
        counts = {name: int(each.sum()) for name, each in self.outcomes.counts.items()}
        abreast = 1 if self.batched is None else self.batched.states
        shared = {"model": self.source.model.name, "threads": self.threads, "abreast": abreast}
        told = {"errors": errors, "info": counts | self.method.info | shared | info}
        found = made(Rollouts, self._arrays() | told | {"source": self.source}, self.measures)
        if self.stop is not None:
            vars(self.stop)["motion"] = found
            raise self.stop
        return found

    def _arrays(self) -> dict[str, np.ndarray]:
        """Return samples, nan after the end of a run as in the measures, read-only."""
        done, start = self.outcomes.done, self.memory.start
        for k in np.flatnonzero(done < len(start.times)).tolist():
            for array in (*self.memory.out.values(), *self.measures.arrays.values()):
                array[k, done[k] :] = np.nan
        arrays = {name: np.asarray(array, float) for name, array in self.memory.out.items()}
        shape = (*arrays["q"].shape[:2], self.memory.ground.points, 2)
        arrays["bristles"] = arrays["bristles"].reshape(shape)
        arrays["t"], arrays["ends"] = np.array(start.times), self.outcomes.ends
        return {name: read_only(array) for name, array in arrays.items()}


def in_c(run: CompiledRun, ended: Event) -> Outcome | None:
    """Return the outcome of a run; None if it was given up."""
    status = run.go(ended)
    return None if status == PAUSED and run.actuation.error is None else run.outcome(status)


def run_parallel(
    memory: Memory, acting: Acting, method: IntegrationMethod, threads: int | None
) -> ParallelRuns:
    """Make all runs, in several threads unless Python acts in them; Ctrl-C ends all."""
    runs = ParallelRuns(memory, acting, method, threads)
    try:
        with Stage("simulate", f"{memory.start.runs} runs of {runs.source.model.name}") as stage:
            runs.make(stage)
    except KeyboardInterrupt as stop:
        runs.stop = stop
        runs.outcomes.fail_rest("Ctrl-C came before its end: simulate it again")
    return runs
