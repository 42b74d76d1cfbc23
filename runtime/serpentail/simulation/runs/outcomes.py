"""Outcomes of many runs, as arrays from which that of a single run is made."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...basics.errors import SimulationError
from .single import COUNTS, Memory, Outcome


def told_by(records: np.ndarray, memory: Memory, runs: np.ndarray) -> dict[str, Any]:
    """Return the content of the C records of some runs, as ``keep_all`` takes it."""
    told = {name: records[name] for name in (*COUNTS, "done")}
    return told | {"ends": records["t"], "ledger": memory.state["ledger"][runs]}


class Outcomes:
    """Outcomes of runs: samples written (``done``), ``ends`` (s), ledgers and counts by run.

    failures and stops: of some runs, by their numbers; ``told``: further info of single runs.
    Several threads may store outcomes at once.
    """

    def __init__(self, memory: Memory):
        runs = memory.start.runs
        self.ended = np.zeros(runs, bool)
        self.count = 0  # number of runs that ended, for progress
        self.done = np.zeros(runs, int)
        self.ends = np.full(runs, memory.start.start)
        self.ledger = np.zeros_like(memory.state["ledger"])
        self.counts = {name: np.zeros(runs, int) for name in COUNTS}
        self.failures: dict[int, BaseException] = {}
        self.stops: dict[int, dict[str, Any]] = {}
        self.told: dict[int, dict[str, Any]] = {}

    def __len__(self) -> int:
        return len(self.done)

    def __getitem__(self, k: int) -> Outcome:
        """Return the outcome of run k."""
        counts = {name: int(each[k]) for name, each in self.counts.items()}
        return Outcome(
            int(self.done[k]),
            float(self.ends[k]),
            self.ledger[k],
            self.told.get(k, counts),
            self.failures.get(k),
            self.stops.get(k),
        )

    def keep(self, k: int, outcome: Outcome) -> None:
        """Store the outcome of run k."""
        self.done[k], self.ends[k], self.ledger[k] = outcome.done, outcome.end, outcome.ledger
        for name, each in self.counts.items():
            each[k] = outcome.info.get(name, 0)
        self.told[k] = outcome.info
        if outcome.failure is not None:
            self.failures[k] = outcome.failure
        if outcome.stop is not None:
            self.stops[k] = outcome.stop
        self.ended[k] = True
        self.count += 1

    def keep_all(self, runs: np.ndarray | slice, numbers: Mapping[str, Any]) -> None:
        """Store the outcomes of runs that neither failed nor stopped.

        done, ends, ledger and counts: a number each, or one for each run.
        """
        self.done[runs], self.ends[runs] = numbers["done"], numbers["ends"]
        self.ledger[runs] = numbers["ledger"]
        for name, each in self.counts.items():
            each[runs] = numbers.get(name, 0)
        self.ended[runs] = True
        self.count += np.size(self.done[runs])

    def fail_rest(self, words: str) -> None:
        """Give each run that has not ended its own error."""
        for k in np.flatnonzero(~self.ended).tolist():
            self.failures[k], self.told[k] = SimulationError(words), {}
        self.ended[:] = True
