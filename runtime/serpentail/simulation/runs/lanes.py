"""Flights that the generated C makes several at once, one in each lane of its vectors."""

import ctypes
from collections.abc import Iterator
from threading import Event
from typing import Any

import numpy as np

from ...compiling.threads import threads as allowed
from ...model.library import PAUSED
from ...model.memory import address_of, aligned
from ...model.model import Model
from ...model.structures import structure
from .single import PAUSE, CompiledRun, RunSet, called

METHODS = ("rk4", "tsit5")
AT_ONCE = 64  # groups of runs that a thread takes up at once
# Time to compile, and time that lanes save in a step, for tails from (1, 3) to (8, 16): about the
# less favourable of measurements with AVX2 and with AVX-512
COMPILE_S_PER_BYTE = 25e-6  # of C
STEP_SAVES_S, OPERATION_SAVES_S = 4e-7, 2e-10  # each step; each operation of forward dynamics


def fit_lanes(runs: RunSet) -> bool:
    """Tell whether runs can be made in lanes: flights under damping and torques."""
    if runs.method.name not in METHODS or "flights" not in runs.model.manifest:
        return False
    motors = any(name.startswith("motor_") for name in runs.model.parameters)
    if motors or runs.ground.loads is not None:
        return False
    parts = [parts for each in runs.actuations.distinct for parts in each.parts]
    return all(each.pfl is each.native is each.user is each.tensions is None for each in parts)


def worth_lanes(model: Model, runs: int, steps: int) -> bool:
    """Tell whether it is worthwhile to make runs of about ``steps`` steps in lanes.

    The runs must fill the lanes. Their C must be compiled already, or its compilation must take
    less time than these runs and earlier ones would have saved.
    """
    source = model.batch_library.rollouts
    if runs < model.manifest["flights"]["states"]:
        return False
    if source.library is not None or source.at_hand:
        return True
    operations = model.manifest["functions"]["forward_dynamics"]["operations"]
    saved = runs * steps * (STEP_SAVES_S + OPERATION_SAVES_S * operations)
    source.missed += saved / allowed(model.batch_library.threads)
    return source.missed >= COMPILE_S_PER_BYTE * source.bytes


class LaneRuns:
    """Runs of a set, each with its own clock."""

    def __init__(self, all_runs: RunSet):
        self.all_runs, code = all_runs, all_runs.records.code
        entry = code.manifest["flights"]
        self.states, self.work = entry["states"], entry["work"]
        members = tuple(map(tuple, entry["rollouts"]))
        self.record = structure("side_by_side", members, all_runs.records.real)
        name = f"{all_runs.model.name}_side_by_side_rollouts"
        self.function = code.batches.rollouts.function(name)

    def parts(self, runs: range, threads: int) -> list[range]:
        """Return which of some runs a thread makes at once."""
        groups = -(-len(runs) // self.states)
        size = self.states * max(1, min(AT_ONCE, groups // (2 * threads)))
        return [runs[first : first + size] for first in range(0, len(runs), size)]

    def go(self, runs: range, ended: Event) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
        """Make runs; yield their numbers and records, None for those that must be made alone."""
        records = CompiledRun(self.all_runs).records_of(runs)
        statuses = np.full(len(runs), PAUSED, np.intc)
        lanes = np.full(self.states, -1, np.dtype(ctypes.c_long))
        work = aligned(self.work, self.all_runs.records.dtype)
        arrays = {"runs": records, "statuses": statuses, "lanes": lanes, "work": work}
        places = {name: address_of(array) for name, array in arrays.items()}
        record: Any = self.record(count=len(runs), pause=PAUSE, **places)
        on_their_way = len(runs)
        while on_their_way and not ended.is_set():
            on_their_way = called(self.function, record)
        numbers, sound = np.array(runs), statuses == 0
        yield numbers[sound], records[sound]
        failed = numbers[(statuses != 0) & (statuses != PAUSED)]
        if len(failed):
            yield failed, None
