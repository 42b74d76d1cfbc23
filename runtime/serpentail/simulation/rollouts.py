"""Rollouts: compiled runs of many starts go in; their samples, measures and errors come out, made
on all cores.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from threading import Event

import numpy as np

from ..errors import SimulationError, StateError
from ..model.kernel import RunKernel
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
    """What rollouts are of: a model, the parameters of every run, the ground, what each run came
    to, and its method.
    """

    model: object
    parameters: RunParameters
    ground: Ground
    outcomes: list[Outcome]
    info: dict

    def model_of(self, k: int):
        """Return the model with the parameters of run k."""
        own = self.parameters.of(k)
        return self.model.with_parameters(**own) if own else self.model

    def trajectory(self, k: int, samples: Samples) -> Trajectory:
        """Return the trajectory of run k, or raise what ended it."""
        return trajectory_or_error(
            self.model_of(k), replace(samples, info=samples.info | self.info), self.ground
        )


@dataclass(frozen=True, eq=False)
class Rollouts:
    """k motions, sampled at the same s times; the arrays are read-only, rows after a motion's end
    NaN.

    t (s,) s; q (k, s, 7+2m), v (k, s, 6+2m); tau (k, s, 2m) N m; kinetic, potential (k, s) J;
    linear_momentum,
    angular_momentum (k, s, 3); bristles (k, s, points, 2) m: as Trajectory has them.
    ends (k,) s: when each run ended: at the last time, at an event of ``stop_at``, or where it
    failed.
    errors: None or the SimulationError of each run, which keeps the trajectory up to there.
    info: what all have in common, JSON-ready; steps, rejected, evaluations and factorisations are
    those of all.
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
    info: dict
    source: "Source" = field(repr=False)

    def __len__(self) -> int:
        return len(self.q)

    def __getitem__(self, k: int) -> Trajectory:
        """Return the trajectory of run k, or raise its error."""
        k = range(len(self))[k]
        if self.errors[k] is not None:
            raise self.errors[k]
        arrays = {name: getattr(self, name)[k] for name in ("q", "v", "tau", "bristles")}
        return self.source.trajectory(k, sampled(self.t, arrays, self.source.outcomes[k]))


class ParallelRuns:
    """Runs on their way: threads take them up in turn, and write samples, measures and outcomes."""

    def __init__(self, memory: Memory, actuation: Actuation, method: IntegrationMethod):
        runs, samples = memory.start.runs, memory.start.intervals + 1
        self.memory, self.actuation, self.method = memory, actuation, method
        self.batched = (
            BatchedRuns(memory, actuation, method)
            if worth_batching(memory, actuation, method)
            else None
        )
        self.tasks = self.batched.groups if self.batched else runs
        of_python = method.name in SCIPY or any(parts.user is not None for parts in actuation.parts)
        self.threads = 1 if of_python else min(cores(), self.tasks)
        self.model = memory.records.model
        self.outcomes: list[Outcome] = [None] * runs
        self.source = Source(
            self.model, memory.parameters, memory.ground, self.outcomes, method.info
        )
        self.measures = {}
        for kernel in map(self.model.kernel, MEASURES):
            shapes = zip(MEASURES[kernel.name], kernel.out_shapes, strict=True)
            self.measures |= {
                name: np.zeros((runs, samples, *shape), kernel.dtype) for name, shape in shapes
            }
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

    def run_batches(self, groups: Iterator[int], ended: Event) -> None:
        """Take up groups of runs; those among which one cannot go on are made again, one by one."""
        batched, start, measures = (
            self.batched,
            self.memory.start,
            [self._rows(name) for name in MEASURES],
        )
        steps = len(batched.steps.lengths)
        info = dict.fromkeys(COUNTS, 0) | {"steps": steps, "evaluations": 4 * steps}
        for group in groups:
            completed = batched.go(group, ended)
            if completed is None:
                return
            if not completed:
                self.run_singly(iter(batched.runs(group)), ended)
            for k in batched.runs(group) if completed else ():
                self._keep(k, Outcome(start.intervals + 1, start.end, dict(info)), measures)

    def _keep(self, k: int, outcome: Outcome, measures: list[RunKernel]) -> None:
        """Keep and measure what run k came to; an error that is not its own ends all runs."""
        if not isinstance(outcome.failure, SimulationError | None):
            raise outcome.failure
        self.outcomes[k] = outcome
        try:
            for measure in measures if outcome.failure is None else ():
                measure(k, outcome.done)
        except StateError:
            self.unmeasured.append(k)

    def _by_scipy(self, run: CompiledRun) -> Outcome:
        """Return what a run came to by one of SciPy's methods, its samples kept."""
        from .scipy_methods import integrate_by_scipy

        try:
            found = integrate_by_scipy(run, self.method)
        except SimulationError as error:
            return Outcome(0, self.memory.start.start, {}, error)
        done = len(found.t)
        for name, array in self.memory.out.items():
            array[run.k, :done] = getattr(found, name).reshape(done, array.shape[2])
        return Outcome(done, found.t[-1], found.info, found.failure)

    def rollouts(self, info: dict) -> Rollouts:
        """Return what all runs came to."""
        errors = [None] * len(self.outcomes)
        for k in sorted(
            {*self.unmeasured, *(k for k, each in enumerate(self.outcomes) if each.failure)}
        ):
            errors[k] = self._judge(k)
        arrays = {
            name: np.asarray(a, float) for name, a in (self.memory.out | self.measures).items()
        }
        for k, outcome in enumerate(self.outcomes):
            if outcome.done < len(self.memory.start.times):
                for array in arrays.values():
                    array[k, outcome.done :] = np.nan
        shape = (*arrays["q"].shape[:2], self.memory.ground.points, 2)
        arrays["bristles"] = arrays["bristles"].reshape(shape)
        arrays |= {
            "t": np.array(self.memory.start.times),
            "ends": np.array([each.end for each in self.outcomes]),
        }
        for array in arrays.values():
            array.setflags(write=False)
        counts = {name: sum(each.info.get(name, 0) for each in self.outcomes) for name in COUNTS}
        shared = {"threads": self.threads, "abreast": self.batched.states if self.batched else 1}
        info = counts | self.method.info | {"model": self.model.name} | shared | info
        return Rollouts(**arrays, errors=errors, info=info, source=self.source)

    def _judge(self, k: int) -> SimulationError | None:
        """Return the error that ended run k; measure it up to there."""
        outcome, error = self.outcomes[k], None
        try:
            trajectory = self.source.trajectory(k, self.memory.samples(k, outcome))
        except SimulationError as caught:
            trajectory, error = caught.trajectory, caught
        for name, array in self.measures.items():
            array[k, : outcome.done] = (
                np.nan if trajectory is None else getattr(trajectory, name)[: outcome.done]
            )
        return error

    def _rows(self, name: str) -> RunKernel:
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
    in_turn(runs.tasks, runs.threads, runs.run_batches if runs.batched else runs.run_singly)
    return runs
