"""Many runs with the same steps, of which the generated C makes several at once, in lanes."""

import ctypes
import time
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from ..model.kernel import aligned
from ..model.layout import TAIL_V
from .actuation import Actuation
from .compiled_run import PAUSE, PAUSE_S, Memory
from .methods import IntegrationMethod, step_counts
from .piecewise import Piecewise
from .records import structure
from .start import Start

# steps of all runs: from here on compiling the C of batched runs pays, which takes a second or two
MIN_BATCHED_STEPS = 1_000_000
MAX_SHARED_STEPS = 1_000_000  # steps of one run: beyond, what all runs share fills the memory


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


def worth_batching(memory: Memory, actuation: Actuation, method: IntegrationMethod) -> bool:
    """Tell whether runs can be made in batches, and are so many that it pays."""
    start, parts = memory.start, actuation.parts[0]
    if method.name != "rk4" or "flights" not in memory.records.model.manifest:
        return False
    # a single phase of damping and torques
    others = (parts.pfl, parts.native, parts.user)
    if len(actuation.parts) > 1 or any(part is not None for part in others):
        return False
    spans, slack = _spans(_edges(start, actuation))
    steps = int(step_counts(spans, slack, method.settings["step"]).sum())
    return start.runs > 1 and steps <= MAX_SHARED_STEPS and steps * start.runs >= MIN_BATCHED_STEPS


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

    @property
    def groups(self) -> int:
        """Number of groups of runs that are made at once."""
        return -(-self.memory.start.runs // self.states)

    def runs(self, group: int) -> range:
        """Return the numbers of a group's runs."""
        return range(self.memory.start.runs)[group * self.states : (group + 1) * self.states]

    def go(self, group: int, ended: Event) -> bool | None:
        """Make a group's runs; tell whether all could be made, None where they were given up."""
        rows = slice(self.runs(group).start, self.runs(group).stop)
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
        record: Any = self.record(
            count=len(self.runs(group)),
            samples=out["q"].shape[1],
            steps=len(self.steps.lengths),
            pause=PAUSE,
            **{name: array.ctypes.data for name, array in arrays.items()},
        )
        # in between a look whether the runs are to end
        while record.step < record.steps:
            if ended.is_set():
                return None
            begun = time.perf_counter()
            if self.function(ctypes.addressof(record)):
                return False
            if time.perf_counter() - begun < PAUSE_S:
                record.pause *= 2
        out["tau"][rows] = self.torques - self.arrays["damping"] * out["v"][rows, :, TAIL_V]
        return True
