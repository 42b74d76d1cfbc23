"""Runs with adaptive steps; the generated C makes several at once, one in each lane."""

import ctypes
from collections.abc import Iterator
from threading import Event
from typing import Any

import numpy as np

from ...model.kernel import address_of, aligned
from ...model.library import PAUSED
from ...model.structures import structure
from ..acting import Acting
from ..batched_runs import shared_out
from .single import PAUSE, CompiledRun, Memory, called
from ..methods import IntegrationMethod
from .outcomes import told_by


def adaptive_in_lanes(memory: Memory, acting: Acting, method: IntegrationMethod) -> bool:
    """Tell whether runs can be made in lanes: flights by tsit5 under damping and torques."""
    if method.name != "tsit5" or "flights" not in memory.records.model.manifest:
        return False
    parts = [parts for each in acting.distinct for parts in each.parts]
    return all(each.pfl is each.native is each.user is None for each in parts)


class AdaptiveRuns:
    """Runs of a memory, each with its own clock."""

    def __init__(self, memory: Memory, acting: Acting, method: IntegrationMethod):
        self.memory, self.acting, self.method = memory, acting, method
        model, entry = memory.records.model, memory.records.model.manifest["flights"]
        self.states, self.work = entry["states"], entry["work"]
        members = tuple(map(tuple, entry["rollouts"]))
        self.record = structure("side_by_side", members, memory.records.real)
        name = f"{model.name}_side_by_side_rollouts"
        self.function = model.batch_library.rollouts.function(name)

    def parts(self, runs: range, threads: int) -> list[range]:
        """Return which of some runs a thread makes at once."""
        return shared_out(runs, self.states, threads)

    def go(self, runs: range, ended: Event) -> Iterator[tuple[np.ndarray, dict[str, Any] | None]]:
        """Make runs; yield their numbers and outcomes, None for those that must be made alone."""
        records = CompiledRun(self.memory, self.acting, self.method).records_of(runs)
        statuses = np.full(len(runs), PAUSED, np.intc)
        lanes = np.full(self.states, -1, np.dtype(ctypes.c_long))
        work = aligned(self.work, self.memory.records.dtype)
        arrays = {"runs": records, "statuses": statuses, "lanes": lanes, "work": work}
        places = {name: address_of(array) for name, array in arrays.items()}
        record: Any = self.record(count=len(runs), pause=PAUSE, **places)
        on_their_way = len(runs)
        while on_their_way and not ended.is_set():
            on_their_way = called(self.function, record)
        numbers, sound = np.array(runs), statuses == 0
        yield numbers[sound], told_by(records[sound], self.memory, numbers[sound])
        yield numbers[(statuses != 0) & (statuses != PAUSED)], None
