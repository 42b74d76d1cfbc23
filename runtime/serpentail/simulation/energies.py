"""Energies, momenta and books of runs, most of them when somebody asks; and a run's trajectory.

A run's state is certainly finite, but its energy need not be. Where that is not certain, they are
computed at once, so that the run fails with an error of its own.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np

from ..basics.errors import SimulationError, StateError
from ..compiling.threads import in_turn
from ..model.kernel import RunKernel
from ..model.model import Model
from ..model.passive import behind_stops, stored_energy
from ..motion.origin import origin
from ..motion.trajectory import Trajectory
from .audit import BALANCED, Audit, Between, allowance, audited, warnings_of
from .ground import Ground
from .methods import ADAPTIVE, FIXED, IntegrationMethod
from .runs.outcomes import Samples

if TYPE_CHECKING:
    from .rollouts import Source
    from .runs.single import Memory

# numbers whose eighth power a real can hold
MODEST = {np.dtype(real): float(np.finfo(real).max) ** 0.125 for real in (np.float32, np.float64)}
INTERRUPTED = "interrupted"  # the failure of a run that Ctrl-C ended, whose error has no words
MEASURES = {"energy": ("kinetic", "potential"), "momentum": ("linear_momentum", "angular_momentum")}


def trajectory_or_error(model: Model, samples: Samples, ground: Ground) -> Trajectory:
    """Return the trajectory of samples; raise the error that ended the run, with its motion."""
    t, failure = samples.t, samples.failure
    if failure is not None and not len(t):
        raise failure
    try:
        trajectory = measured(model, samples, ground)
    except StateError as error:
        if failure is not None:
            raise failure from None
        words = f"from t = {t[0]:.6g} s to {t[-1]:.6g} s, by sample: {error}"
        raise SimulationError(words) from error
    if failure is None:
        return trajectory
    if isinstance(failure, SimulationError):
        failure.trajectory = trajectory
    if isinstance(failure, KeyboardInterrupt):
        vars(failure)["motion"] = trajectory
    raise failure


def measured(model: Model, samples: Samples, ground: Ground) -> Trajectory:
    """Return samples whose energies, momenta, forces and info are derived when asked for.

    Where it is not certain that numbers hold them they are derived now; StateError if not.
    """
    arrays = {"t": samples.t, "q": samples.q, "v": samples.v, "tau": samples.tau}
    motion = Trajectory.of_run(arrays, model, Energies(model, samples, ground))
    whole = samples.failure is None and samples.ledger.size > 0
    method = samples.info.get("method") if whole else None
    numbers = model.parameter_vector, samples.q, samples.v, samples.bristles
    return motion if certain(model, method, numbers) else replace(motion)


def certain(model: Model, method: str | None, numbers: Iterable[np.ndarray]) -> bool:
    """Tell whether the energies, momenta and forces of a run are certainly finite.

    They are sums of products of at most five parameters, coordinates and rates; a continuum may be
    bent too far between steps.
    """
    if method not in (*FIXED, *ADAPTIVE) or model.kind != "articulated":
        return False
    most = MODEST[model.parameter_vector.dtype] ** 2
    return all(np.vdot(array, array) < most for array in numbers)


def certain_runs(model: Model, method: str, numbers: Iterable[np.ndarray]) -> np.ndarray:
    """Return ``certain`` for each of some runs, whose numbers are (runs, ...)."""
    sound = []
    for array in numbers:
        rows = array.reshape(len(array), -1)
        sound.append(np.einsum("ki,ki->k", rows, rows) < MODEST[rows.dtype] ** 2)
    return np.all(sound, axis=0) & certain(model, method, ())


class Energies:
    """Derived fields of a run's samples: called with a name, it returns the field and related ones.

    StateError if a result is too large for a number.
    """

    def __init__(self, model: Model, samples: Samples, ground: Ground):
        self.model, self.samples, self.ground = model, samples, ground

    def __call__(self, name: str) -> dict[str, Any]:
        """Return fields of a trajectory by name."""
        samples = self.samples
        state = samples.q, samples.v
        if name == "info":
            return {"info": json.loads(json.dumps(self._info()))}
        if name == "contact":
            given = *state, samples.tau, samples.bristles
            return {"contact": self.ground.contact(self.model, samples.t, given)}
        function, names = next(row for row in MEASURES.items() if name in row[1])
        found = getattr(self.model, function)(*state)
        measures = {k: np.asarray(array, float) for k, array in zip(names, found, strict=True)}
        for array in measures.values():
            array.setflags(write=False)
        return measures

    def _info(self) -> dict[str, Any]:
        """Return the info of the run, with its audit."""
        samples = self.samples
        info = samples.info | origin(self.model)
        if samples.failure is not None:
            return info | {"failure": str(samples.failure) or INTERRUPTED}
        if not samples.ledger.size:  # a part of a run
            return info
        eps = float(np.finfo(self.model.parameter_vector.dtype).eps)
        books = audited(
            self.model,
            self.model.parameters,
            samples.ledger,
            samples.t[-1] - samples.t[0],
            self._ends(),
            Between(allowance(info, eps), self._all),
        )
        warnings = warnings_of(books, info, eps)
        behind = behind_stops(self.model.parameters, samples.q[:, self.model.layout.tail_q])
        if behind:
            warnings.append(f"{behind}: make the stop stiffer, or its width larger")
        return info | books.info() | {"warnings": warnings}

    def _ends(self) -> dict[str, np.ndarray]:
        """Return energies (2,), linear momentum (2, 3), stored energy at start and end."""
        rows = []
        for q, v in zip(self.samples.q[[0, -1]], self.samples.v[[0, -1]], strict=True):
            rows.append((*self.model.energy(q, v), self.model.momentum(q, v)[0]))
        columns = zip(*rows, strict=True)
        ends = {name: np.array(each, float) for name, each in zip(BALANCED, columns, strict=True)}
        return ends | {"stored": self._stored(self.samples.q[[0, -1]])}

    def _all(self, _: np.ndarray) -> dict[str, np.ndarray]:
        """Return the same at all samples."""
        measures = self("kinetic") | self("linear_momentum")
        return measures | {"stored": self._stored(self.samples.q)}

    def _stored(self, q: np.ndarray) -> np.ndarray:
        """Return the energy (K,) that the tail stores."""
        return np.asarray(stored_energy(self.model.parameters, q[:, self.model.layout.tail_q]))


class EnergiesOfRuns:
    """Derived fields of runs' samples: called with a name, it returns the field and related ones.

    arrays: energies and momenta of all runs; ``late``: runs for which they are certainly finite, so
    that they can be derived when they are used.
    """

    def __init__(
        self, memory: "Memory", method: IntegrationMethod, source: "Source", threads: int
    ) -> None:
        self.memory, self.method, self.source, self.threads = memory, method, source, threads
        self.model, self.outcomes = source.model, source.outcomes
        runs, samples = memory.start.runs, memory.start.intervals + 1
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
            arrays = [self.memory.out[name][runs] for name in ("q", "v", "bristles")]
            numbers = (self.memory.parameters.vectors[runs], *arrays)
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
            trajectory = self.source.trajectory(k, self.memory.samples(k, outcome))
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
        vectors, out = self.memory.parameters.vectors, self.memory.out
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
        q, values = self.memory.out["q"], self.memory.parameters.values
        tail = self.model.layout.tail_q
        tails = (q[:, 0, tail], q[each, last, tail])
        ends["stored"] = self._stored(tails)
        ends["kinetic"][list(self.outcomes.failures)] = np.nan
        for k, stop in self.outcomes.stops.items():  # between samples
            if k not in self.outcomes.failures:
                model, state = self.source.model_of(k), (stop["q"], stop["v"])
                ends["kinetic"][k, 1], ends["potential"][k, 1] = model.energy(*state)
                ends["linear_momentum"][k, 1] = model.momentum(*state)[0]
        span = self.outcomes.ends - self.memory.start.start
        between = Between(allowance(self.method.info, self._eps), self._all)
        return audited(self.model, values, self.outcomes.ledger, span, ends, between)

    def _all(self, of: np.ndarray) -> dict[str, np.ndarray]:
        """Return what an audit needs of all samples of the runs that are marked."""
        done = self.outcomes.done
        self._measure(lambda k: [(int(done[k]), 0)] if of[k] else [])
        tails = self.memory.out["q"][:, :, self.model.layout.tail_q]
        seen = {name: self.arrays[name].astype(float) for name in BALANCED}
        return seen | {"stored": self._stored(tails.swapaxes(0, 1))}

    def _stored(self, tails: Iterable[np.ndarray]) -> np.ndarray:
        """Return the energy (runs, samples) that tails store, given as (runs, 2m) by sample."""
        values = self.memory.parameters.values
        return np.stack([stored_energy(values, tail) for tail in tails], axis=1)

    @property
    def _eps(self) -> float:
        return float(np.finfo(self.memory.records.dtype).eps)

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
