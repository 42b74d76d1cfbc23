"""What many runs came to, by their numbers: arrays, from which that of a single run is told."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import SimulationError
from .compiled_run import COUNTS, Memory, Outcome


def told_by(records: np.ndarray, memory: Memory, runs: np.ndarray) -> dict[str, Any]:
    """Return what the C records of some runs tell, as ``keep_all`` takes it."""
    told = {name: records[name] for name in (*COUNTS, "done")}
    return told | {"ends": records["t"], "ledger": memory.state["ledger"][runs]}


class Outcomes:
    """What runs came to: samples written ``done``, ``ends`` (s), ledgers and counts by run.

    failures and stops are those of some runs, by their numbers; ``told`` what single runs have to
    tell where that is not counts alone.  Several threads may keep theirs.
    """

    def __init__(self, memory: Memory):
        runs = memory.start.runs
        self.ended = np.zeros(runs, bool)
        self.count = 0  # of those that ended, for who looks how far they are
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
        """Return what run k came to."""
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
        """Keep what run k came to."""
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
        """Keep what some runs came to that neither failed nor stopped: done, ends, ledger, counts,
        each a number or one a run.
        """
        self.done[runs], self.ends[runs] = numbers["done"], numbers["ends"]
        self.ledger[runs] = numbers["ledger"]
        for name, each in self.counts.items():
            each[runs] = numbers.get(name, 0)
        self.ended[runs] = True
        self.count += np.size(self.done[runs])

    def fail_rest(self, words: str) -> None:
        """Give an error of their own to all runs that have not ended."""
        for k in np.flatnonzero(~self.ended).tolist():
            self.failures[k], self.told[k] = SimulationError(words), {}
        self.ended[:] = True
