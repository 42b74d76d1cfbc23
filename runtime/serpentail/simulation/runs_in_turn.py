"""Runs that the generated C makes one after another: Python acts between many of them only."""

import ctypes
import time
from dataclasses import dataclass
from threading import Event

import numpy as np

from ..model.kernel import address_of
from .acting import Acting
from .runs.single import PAUSE, PAUSE_S, CompiledRun, Memory
from .methods import IntegrationMethod

MOST_AT_ONCE = 512  # runs of one call: more would not make the rest of a call cheaper


@dataclass(frozen=True, eq=False)
class Ended:
    """Runs that came to an end in C: their numbers, records and statuses."""

    runs: np.ndarray
    records: np.ndarray
    statuses: np.ndarray


class RunsInTurn:
    """Makes runs, a few at a time, so that Python can react in between; for one thread."""

    def __init__(self, memory: Memory, acting: Acting, method: IntegrationMethod):
        self.run = CompiledRun(memory, acting, method)
        self.function = self.run.function("rollouts", ctypes.c_int, ctypes.c_void_p)
        self.pause, self.at_once = PAUSE, 1

    def make(self, runs: list[int], ended: Event) -> Ended:
        """Make runs; return those that ended, fewer if ``ended`` is set."""
        numbers, records = np.array(runs), self.run.records_of(runs)
        statuses, done = np.zeros(len(runs), np.intc), 0
        while done < len(runs) and not ended.is_set():
            records["pause"][done:], begun = self.pause, time.perf_counter()
            rest = len(runs) - done
            done += self.function(address_of(records[done:]), rest, address_of(statuses[done:]))
            quick = time.perf_counter() - begun < PAUSE_S
            if done == len(runs):
                self.at_once = min(2 * self.at_once, MOST_AT_ONCE) if quick else 1
            elif quick:
                self.pause *= 2
        return Ended(numbers[:done], records[:done], statuses[:done])
