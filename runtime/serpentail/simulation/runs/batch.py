"""Makes many runs at once, on all cores."""

from collections.abc import Callable, Iterator
from itertools import islice
from math import ceil
from threading import Event
from typing import Any

import numpy as np

from ...basics.errors import SimulationError
from ...basics.progress import Stage
from ...compiling.threads import in_turn
from ...compiling.threads import threads as allowed
from ...model.library import PAUSED
from ...motion.derived import made
from ..methods import SCIPY
from ..rollouts import Rollouts, Source
from .energies import EnergiesOfRuns, read_only
from .lanes import LaneRuns, fit_lanes, worth_lanes
from .outcomes import Outcomes, RunOutcome, failed
from .single import CompiledRun, RunSet, RunsInTurn

PILOTS = 64  # runs that are timed before code is compiled for the others


class BatchRuns:
    """Runs in progress: threads take them in turn, and write samples, measures and outcomes."""

    def __init__(self, runs: RunSet, threads: int | None):
        self.runs, self.model, self.method = runs, runs.model, runs.method
        self.of_python = runs.method.name in SCIPY or runs.actuations.of_python
        self.threads = 1 if self.of_python else min(allowed(threads), runs.start.runs)
        self.lanes: LaneRuns | None = None
        self.outcomes = Outcomes(runs)
        self.source = Source(
            self.model, runs.parameters, runs.ground, self.outcomes, runs.method.info
        )
        self.energies = EnergiesOfRuns(runs, self.source, self.threads)
        self.stop: KeyboardInterrupt | None = None  # what ended all runs early

    def make(self, stage: Stage) -> None:
        """Make all runs, those in lanes that can be and for which it pays."""
        runs, singly = range(self.runs.start.runs), 0
        if fit_lanes(self.runs):
            singly = self._pilots(runs, stage)
        rest = runs[singly:]
        if self.lanes is not None:
            parts, lanes = self.lanes.parts(rest, self.threads), self.lanes
            self._share(parts, lambda found, ended: self._run_lanes(lanes, found, ended), stage)
        elif self.of_python or self.runs.actuations.has_state or self.runs.ground.points:
            self._share(rest, self._run_singly, stage)
        else:
            self._share(rest, self._run_in_turn, stage)

    def _pilots(self, runs: range, stage: Stage) -> int:
        """Decide whether lanes pay; return the number of runs that were made to find out."""
        first, span = 0, self.runs.start.end - self.runs.start.start
        steps = ceil(span / self.method.settings["step"]) if self.method.name == "rk4" else 0
        pays = worth_lanes(self.model, len(runs), steps)
        if not pays and not steps:
            # the first runs show how long the others will take
            first = min(PILOTS, len(runs))
            self._share(runs[:first], self._run_in_turn, stage)
            steps = int(self.outcomes.counts["steps"][:first].sum()) // first
            pays = first < len(runs) and worth_lanes(self.model, len(runs) - first, steps)
        if pays:
            self.lanes = LaneRuns(self.runs)
        return first

    def _share(
        self,
        tasks: range | list[range],
        work: Callable[[Iterator[Any], Event], None],
        stage: Stage,
    ) -> None:
        """Let threads take tasks in turn."""

        def taken(numbers: Iterator[int], ended: Event) -> None:
            work((tasks[number] for number in numbers), ended)

        if tasks:
            done, runs = self.outcomes, len(self.outcomes)
            threads = min(self.threads, len(tasks))
            in_turn(len(tasks), threads, taken, lambda: stage.tell(done.count / runs))

    def _run_singly(self, runs: Iterator[int], ended: Event) -> None:
        """Make runs in one thread until none is left, or ``ended`` is set."""
        run = CompiledRun(self.runs)
        measure = self.energies.of_thread()
        for k in runs:
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

    def _run_in_turn(self, runs: Iterator[int], ended: Event) -> None:
        """The same for runs that need no Python until they end."""
        maker = RunsInTurn(CompiledRun(self.runs))
        ledger = self.runs.state["ledger"]
        measure, most = self.energies.of_thread(), len(self.outcomes) // (4 * self.threads) + 1
        while numbers := list(islice(runs, min(maker.at_once, most))):
            found = maker.make(numbers, ended)
            self.outcomes.keep_all(found.runs, found.records, ledger[found.runs])
            wrong = np.flatnonzero(found.statuses)
            for row in wrong.tolist():
                error = failed(int(found.statuses[row]), float(found.records["t"][row]))
                self.outcomes.failures[int(found.runs[row])] = error
            measure(np.delete(found.runs, wrong))

    def _run_lanes(self, lanes: LaneRuns, parts: Iterator[range], ended: Event) -> None:
        """Make runs in lanes, and those again, one after another, that fail there."""
        measure = self.energies.of_thread()
        for part in parts:
            for runs, records in lanes.go(part, ended):
                if records is None:
                    self._run_in_turn(iter(runs.tolist()), ended)
                else:
                    self.outcomes.keep_all(runs, records, self.runs.state["ledger"][runs])
                    measure(runs)

    def _by_scipy(self, run: CompiledRun) -> RunOutcome:
        """Return the outcome of a run by one of SciPy's methods; store its samples."""
        from .scipy_methods import integrate_by_scipy

        try:
            samples = integrate_by_scipy(run)
        except SimulationError as error:
            return RunOutcome(0, self.runs.start.start, run.state["ledger"], {}, error)
        done = len(samples.t)
        for name, array in self.runs.out.items():
            array[run.k, :done] = getattr(samples, name).reshape(done, array.shape[2])
        return RunOutcome(done, samples.t[-1], samples.ledger, samples.info, samples.failure)

    def rollouts(self, info: dict[str, Any]) -> Rollouts:
        """Return the rollouts, with more info; after Ctrl-C raise it with these as ``motion``."""
        errors = self.energies.errors()
        # counts of all runs together
        counts = {name: int(each.sum()) for name, each in self.outcomes.counts.items()}
        abreast = 1 if self.lanes is None else self.lanes.states
        shared = {"model": self.model.name, "threads": self.threads, "abreast": abreast}
        fields: dict[str, Any] = {"errors": errors, "source": self.source}
        fields |= self._arrays() | {"info": counts | self.method.info | shared | info}
        found = made(Rollouts, fields, self.energies)
        if self.stop is not None:
            vars(self.stop)["motion"] = found
            raise self.stop
        return found

    def _arrays(self) -> dict[str, np.ndarray]:
        """Return samples, nan after the end of a run as in the energies, read-only."""
        done, start = self.outcomes.done, self.runs.start
        for k in np.flatnonzero(done < len(start.times)).tolist():
            for array in (*self.runs.out.values(), *self.energies.arrays.values()):
                array[k, done[k] :] = np.nan
        arrays = {name: np.asarray(array, float) for name, array in self.runs.out.items()}
        shape = (*arrays["q"].shape[:2], self.runs.ground.points, 2)
        arrays["bristles"] = arrays["bristles"].reshape(shape)
        arrays["t"], arrays["ends"] = np.array(start.times), self.outcomes.ends
        return {name: read_only(array) for name, array in arrays.items()}


def in_c(run: CompiledRun, ended: Event) -> RunOutcome | None:
    """Return the outcome of a run; None if it was given up."""
    status = run.go(ended)
    return None if status == PAUSED and run.actuation.error is None else run.outcome(status)


def run_batch(set_of_runs: RunSet, threads: int | None) -> BatchRuns:
    """Make all runs, in several threads unless Python acts in them; Ctrl-C ends all."""
    runs = BatchRuns(set_of_runs, threads)
    try:
        with Stage("simulate", f"{len(runs.outcomes)} runs of {runs.model.name}") as stage:
            runs.make(stage)
    except KeyboardInterrupt as stop:
        runs.stop = stop
        runs.outcomes.fail_rest("Ctrl-C came before its end: simulate it again")
    return runs
