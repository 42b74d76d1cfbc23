"""Many runs with the same steps, of which the generated C makes several at once, in lanes."""

import ctypes
import time
from collections.abc import Iterator
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from ..model.cores import threads as allowed
from ..model.kernel import aligned
from ..model.layout import TAIL_V
from ..model.model import Model
from .actuation import Actuation
from .compiled_run import PAUSE, PAUSE_S, Memory
from .methods import IntegrationMethod, step_counts
from .piecewise import Piecewise
from .records import structure
from .start import Start

MAX_SHARED_STEPS = 1_000_000  # steps of one run: beyond, what all runs share fills the memory
AT_ONCE = 64  # groups of runs that a thread takes up at once
# What compiling takes, and what a step saves in lanes, for tails from (1, 3) to (8, 16): about the
# less favourable of what AVX2 and AVX-512 showed
COMPILE_S_PER_BYTE = 25e-6  # of C
STEP_SAVES_S, OPERATION_SAVES_S = 4e-7, 2e-10  # each step; each operation of forward dynamics


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps that all runs share.

    lengths (n,) in s; torques (n, 3, 2m) in N m at begin, middle and end, or None; due (n,): 1
    where a sample follows.
    """

    lengths: np.ndarray
    torques: np.ndarray | None
    due: np.ndarray

    @classmethod
    def planned(cls, start: Start, actuation: Actuation, step: float) -> "Steps":
        """Return the steps between samples and stops, equal in between and of about ``step`` s."""
        edges = _edges(start, actuation)
        spans, slack = _spans(edges)
        counts = step_counts(spans, slack, step)
        # of each step: between which edges it lies, and which one it is there
        span = np.repeat(np.arange(len(spans)), counts)
        within = np.arange(len(span)) - np.repeat(np.cumsum(counts) - counts, counts)
        last = within + 1 == counts[span]
        # where it begins and ends; steps that fit are exactly as long as asked for
        lengths = np.where(np.abs(counts * step - spans) <= slack, step, spans / counts)[span]
        begin = edges[span] + within * lengths
        end = np.where(last, edges[span + 1], begin + lengths)
        due = (last & np.isin(edges[span + 1], start.times)).astype(np.intc)
        curve = actuation.parts[0].torques
        if curve is None:
            return cls(lengths, None, due)
        middle = (begin + end) / 2
        torques = np.stack([at(curve, begin), at(curve, middle), before(curve, end)], axis=1)
        return cls(lengths, torques, due)


def _edges(start: Start, actuation: Actuation) -> np.ndarray:
    """Times (s) at which steps end: start, samples, stops."""
    stops = np.asarray(actuation.stops, float)
    return np.union1d(start.times, stops[(stops > start.start) & (stops < start.end)])


def _spans(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times between edges (s), and what of them is rounding, as for a single run in C."""
    spans = np.diff(edges)
    return spans, 100 * np.finfo(float).eps * (np.abs(edges[1:]) + spans)


def at(curve: Piecewise, t: np.ndarray) -> np.ndarray:
    """Values (n, channels) at times (n,), s; where two pieces meet, of the later."""
    return curve.at(t)[0]


def before(curve: Piecewise, t: np.ndarray) -> np.ndarray:
    """Values (n, channels) at times (n,), s; where two pieces meet, of the earlier."""
    return curve.at(np.nextafter(t, -np.inf))[0]


def shared_steps(memory: Memory, actuation: Actuation, method: IntegrationMethod) -> int:
    """Return how many steps all runs share, 0 where they cannot be made in batches."""
    start, parts = memory.start, actuation.parts[0]
    if method.name != "rk4" or "flights" not in memory.records.model.manifest:
        return 0
    # a single phase of damping and torques
    others = (parts.pfl, parts.native, parts.user)
    if len(actuation.parts) > 1 or any(part is not None for part in others):
        return 0
    spans, slack = _spans(_edges(start, actuation))
    steps = int(step_counts(spans, slack, method.settings["step"]).sum())
    return steps if steps <= MAX_SHARED_STEPS else 0


def worth_batching(model: Model, runs: int, steps: int) -> bool:
    """Tell whether runs of so many steps fill the lanes, and whether these need not be compiled, or
    compiling them has paid by what they save now and would have saved before.
    """
    source = model.batch_library.rollouts
    if not steps or runs < model.manifest["flights"]["states"]:
        return False
    if source.library is not None or source.at_hand:
        return True
    operations = model.manifest["functions"]["forward_dynamics"]["operations"]
    step = STEP_SAVES_S + OPERATION_SAVES_S * operations
    source.missed += runs * steps * step / allowed(model.batch_library.threads)
    return source.missed >= COMPILE_S_PER_BYTE * source.bytes


class BatchedRuns:
    """Runs of a memory, several of which the generated C makes at once."""

    def __init__(self, memory: Memory, actuation: Actuation, method: IntegrationMethod):
        self.memory, model = memory, memory.records.model
        # the C function, and its record
        entry, dtype = model.manifest["flights"], memory.records.dtype
        self.states, self.work, self.dtype = entry["states"], entry["work"], dtype
        self.record = structure("flights", tuple(map(tuple, entry["record"])), memory.records.real)
        self.function = model.batch_library.rollouts.function(f"{model.name}_side_by_side_flights")
        # steps and torques, which all runs share
        self.steps = Steps.planned(memory.start, actuation, method.settings["step"])
        damping, curve = actuation.parts[0].damping, actuation.parts[0].torques
        damping = np.zeros(actuation.nt) if damping is None else damping
        shared = {"lengths": self.steps.lengths, "damping": damping}
        self.torques: np.ndarray | float = 0.0
        if curve is not None and self.steps.torques is not None:
            times = memory.start.times
            sampled = np.vstack([at(curve, times[:1]), before(curve, times[1:])])
            self.torques = sampled.astype(dtype)
            shared["torques"] = self.steps.torques
        self.arrays = {name: np.ascontiguousarray(a, dtype) for name, a in shared.items()}
        self.arrays["due"] = self.steps.due

    def parts(self, threads: int) -> list[range]:
        """Return numbers of runs that a thread makes at once, whole groups where it can be."""
        runs = self.memory.start.runs
        groups = -(-runs // self.states)
        size = self.states * max(1, min(AT_ONCE, groups // (2 * threads)))
        return [range(runs)[first : first + size] for first in range(0, runs, size)]

    def go(self, runs: range, ended: Event) -> Iterator[tuple[range, bool]]:
        """Make runs; yield ranges of them, and whether all there could be made, until ``ended``."""
        out = self.memory.out
        record, held = self._record(slice(runs.start, runs.stop))
        while record.first < record.count and not ended.is_set():
            first, begun = record.first, time.perf_counter()
            failed = self.function(ctypes.addressof(record))
            if time.perf_counter() - begun < PAUSE_S:
                record.pause *= 2
            last = min(record.first, record.count)
            # of those that have ended, only the last ones may have failed
            sound = (last - 1) // self.states * self.states if failed else last
            if sound > first:
                made = runs[first:sound]
                rows = slice(made.start, made.stop)
                damped = self.arrays["damping"] * out["v"][rows, :, TAIL_V]
                out["tau"][rows] = self.torques - damped
                yield made, True
            if failed:
                yield runs[sound:last], False
        del held

    def _record(self, rows: slice) -> tuple[Any, dict[str, np.ndarray]]:
        """Return the C record of some runs, and the arrays that it points to."""
        state, out = self.memory.state, self.memory.out
        arrays = self.arrays | {
            "parameters": np.ascontiguousarray(self.memory.parameters.vectors[rows]),
            "q": state["q"][rows],
            "v": state["v"][rows],
            "q_out": out["q"][rows],
            "v_out": out["v"][rows],
            "ledger": state["ledger"][rows],
            "work": aligned(self.work, self.dtype),
        }
        record = self.record(
            count=rows.stop - rows.start,
            samples=out["q"].shape[1],
            steps=len(self.steps.lengths),
            pause=PAUSE,
            **{name: array.ctypes.data for name, array in arrays.items()},
        )
        return record, arrays
