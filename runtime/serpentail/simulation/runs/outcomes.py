"""What became of runs: the samples of a single one, and the outcomes of many as arrays."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...basics.errors import SimulationError
from ...basics.plausible_values import LARGEST
from ...model.library import STEP_TOO_SMALL, TOO_MANY_STEPS, WHY

if TYPE_CHECKING:
    from .single import RunSet

SHORT_STEPS = (STEP_TOO_SMALL, TOO_MANY_STEPS)  # statuses: the steps became too short
FAILED = "at t = {t:.6g} s {why}"
COUNTS = ("steps", "rejected", "evaluations", "factorisations")


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a motion up to its end, its ledger, and the error that ended it, if any."""

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    bristles: np.ndarray
    ledger: np.ndarray
    info: dict[str, Any]
    failure: BaseException | None = None


@dataclass(frozen=True, eq=False)
class RunOutcome:
    """RunOutcome of a run: samples written, end (s), ledger, counts and events, failure, stop."""

    done: int
    end: float
    ledger: np.ndarray
    info: dict[str, Any]
    failure: BaseException | None = None
    stop: dict[str, Any] | None = None  # between samples: t (s) and a row of every array


def sampled(times: np.ndarray, arrays: dict[str, np.ndarray], outcome: RunOutcome) -> Samples:
    """Return what a run wrote to q, v, tau, bristles, with the state of its stop as last sample."""
    t, done, stop = times[: outcome.done].copy(), outcome.done, outcome.stop
    rows = {name: a[:done].astype(float).reshape(done, a[0].size) for name, a in arrays.items()}
    if stop is not None:
        t = np.append(t, stop["t"])
        rows = {name: np.vstack([a, stop[name]]).astype(float) for name, a in rows.items()}
    stretch = rows.pop("bristles")
    bristles = stretch.reshape(len(t), stretch.shape[1] // 2, 2)
    ledger, info, failure = outcome.ledger, outcome.info, outcome.failure
    return Samples(t, **rows, bristles=bristles, ledger=ledger, info=info, failure=failure)


def failed(status: int, t: float, extremes: tuple[float, float] = (0, 0)) -> SimulationError:
    """Return the error that a status of the C interface means.

    extremes: largest torque (N m) and rate of a tail coordinate (rad/s) so far.
    """
    torque, rate = extremes
    words = FAILED.format(t=t, why=WHY[status])
    if status in SHORT_STEPS and torque and rate > LARGEST["rad/s"][0]:
        words += f" Torques reach {torque:.3g} N m, and a joint {rate:.3g} rad/s: is a torque far"
        words += " too large?"
    return SimulationError(words)


class Outcomes:
    """Outcomes of runs: samples written (``done``), ``ends`` (s), ledgers and counts by run.

    failures, stops and infos: of some runs, by their numbers. Several threads may store outcomes at
    once.
    """

    def __init__(self, made: "RunSet"):
        runs = made.start.runs
        self.ended = np.zeros(runs, bool)
        self.count = 0  # number of runs that ended, for progress
        self.done = np.zeros(runs, int)
        self.ends = np.full(runs, made.start.start)
        self.ledger = np.zeros_like(made.state["ledger"])
        self.counts = {name: np.zeros(runs, int) for name in COUNTS}
        self.failures: dict[int, BaseException] = {}
        self.stops: dict[int, dict[str, Any]] = {}
        self.infos: dict[int, dict[str, Any]] = {}

    def __len__(self) -> int:
        return len(self.done)

    def __getitem__(self, k: int) -> RunOutcome:
        """Return the outcome of run k."""
        counts = {name: int(each[k]) for name, each in self.counts.items()}
        return RunOutcome(
            int(self.done[k]),
            float(self.ends[k]),
            self.ledger[k],
            self.infos.get(k, counts),
            self.failures.get(k),
            self.stops.get(k),
        )

    def keep(self, k: int, outcome: RunOutcome) -> None:
        """Store the outcome of run k."""
        self.done[k], self.ends[k], self.ledger[k] = outcome.done, outcome.end, outcome.ledger
        for name, each in self.counts.items():
            each[k] = outcome.info.get(name, 0)
        self.infos[k] = outcome.info
        if outcome.failure is not None:
            self.failures[k] = outcome.failure
        if outcome.stop is not None:
            self.stops[k] = outcome.stop
        self.ended[k] = True
        self.count += 1

    def keep_all(self, runs: np.ndarray, records: np.ndarray, ledger: np.ndarray) -> None:
        """Store the outcomes of runs that the C made by these records, with their ledgers."""
        self.done[runs], self.ends[runs] = records["done"], records["t"]
        self.ledger[runs] = ledger
        for name, each in self.counts.items():
            each[runs] = records[name]
        self.ended[runs] = True
        self.count += len(runs)

    def fail_rest(self, words: str) -> None:
        """Give each run that has not ended its own error."""
        for k in np.flatnonzero(~self.ended).tolist():
            self.failures[k], self.infos[k] = SimulationError(words), {}
        self.ended[:] = True
