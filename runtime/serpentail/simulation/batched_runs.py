"""Flights abreast: many starts and steps that all share go in; the generated C makes several
flights at once.
"""

import ctypes
from dataclasses import dataclass
from threading import Event

import numpy as np

from ..model.kernel import aligned
from ..model.layout import TAIL_V
from .actuation import Actuation
from .compiled_run import PAUSE, Memory
from .methods import IntegrationMethod
from .piecewise import Piecewise
from .records import structure
from .start import Start

# steps of all runs: from here on compiling the C of batched runs pays, which takes a second or two
MIN_BATCHED_STEPS = 1_000_000
MAX_SHARED_STEPS = 1_000_000  # steps of one run: beyond, what all runs share fills the memory


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps that all runs share: lengths (n,) in s, torques (n, 3, 2m) in N m or None, where
    samples follow (n,).
    """

    lengths: np.ndarray
    torques: np.ndarray | None
    due: np.ndarray

    @classmethod
    def planned(cls, start: Start, actuation: Actuation, step: float) -> "Steps":
        """Return the steps between samples and stops, all as long in between and about ``step``
        (s).
        """
        edges = _edges(start, actuation)
        left, slack = _parts(edges)
        counts = _counts(edges, step)
        part = np.repeat(np.arange(len(left)), counts)
        within = np.arange(len(part)) - np.repeat(np.cumsum(counts) - counts, counts)
        lengths = np.where(np.abs(counts * step - left) <= slack, step, left / counts)[part]
        begin = edges[part] + within * lengths
        end = np.where(within + 1 == counts[part], edges[part + 1], begin + lengths)
        due = (within + 1 == counts[part]) & np.isin(edges[part + 1], start.times)
        curve = actuation.parts[0].torques
        if curve is None:
            return cls(lengths, None, due.astype(np.intc))
        torques = np.stack(
            [at(curve, begin), at(curve, (begin + end) / 2), before(curve, end)], axis=1
        )
        return cls(lengths, torques, due.astype(np.intc))


def _edges(start: Start, actuation: Actuation) -> np.ndarray:
    """Times (s) at which steps end: start, samples, stops."""
    stops = np.asarray(actuation.stops, float)
    return np.union1d(start.times, stops[(stops > start.start) & (stops < start.end)])


def _parts(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times between edges (s), and what of them is rounding, as for a single run in C."""
    left = np.diff(edges)
    return left, 100 * np.finfo(float).eps * (np.abs(edges[1:]) + left)


def _counts(edges: np.ndarray, step: float) -> np.ndarray:
    """Numbers of steps between edges."""
    left, slack = _parts(edges)
    return np.maximum(1, np.ceil((left - slack) / step)).astype(int)


def at(curve: Piecewise, t: np.ndarray) -> np.ndarray:
    """Values (n, channels) at times (n,), s; where two pieces meet, of the later."""
    return curve.at(t)[0]


def before(curve: Piecewise, t: np.ndarray) -> np.ndarray:
    """Values (n, channels) at times (n,), s; where two pieces meet, of the earlier."""
    return curve.at(np.nextafter(t, -np.inf))[0]


def worth_batching(memory: Memory, actuation: Actuation, method: IntegrationMethod) -> bool:
    """Tell whether runs can be made in batches, and are so many that it pays."""
    start, parts = memory.start, actuation.parts[0]
    if (
        method.name != "rk4"
        or "flights" not in memory.records.model.manifest
        or len(actuation.parts) > 1
    ):
        return False
    if any(part is not None for part in (parts.pfl, parts.native, parts.user)):
        return False
    steps = int(_counts(_edges(start, actuation), method.settings["step"]).sum())
    return start.runs > 1 and steps <= MAX_SHARED_STEPS and steps * start.runs >= MIN_BATCHED_STEPS


class BatchedRuns:
    """Runs of a memory, several of which the C of flights makes at once."""

    def __init__(self, memory: Memory, actuation: Actuation, method: IntegrationMethod):
        self.memory, model = memory, memory.records.model
        entry, dtype = model.manifest["flights"], memory.records.dtype
        self.states, self.work, self.dtype = entry["states"], entry["work"], dtype
        self.record = structure("flights", tuple(map(tuple, entry["record"])), memory.records.real)
        self.function = model.batch_library.rollouts.function(f"{model.name}_side_by_side_flights")
        self.steps = Steps.planned(memory.start, actuation, method.settings["step"])
        damping, curve, times = (
            actuation.parts[0].damping,
            actuation.parts[0].torques,
            memory.start.times,
        )
        sampled = (
            0.0 if curve is None else np.vstack([at(curve, times[:1]), before(curve, times[1:])])
        )
        self.torques = np.asarray(sampled, dtype)
        shared = {
            "lengths": self.steps.lengths,
            "damping": np.zeros(actuation.nt) if damping is None else damping,
        }
        shared |= {} if self.steps.torques is None else {"torques": self.steps.torques}
        self.arrays = {name: np.ascontiguousarray(a, dtype) for name, a in shared.items()} | {
            "due": self.steps.due
        }

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
        arrays = {"parameters": np.ascontiguousarray(self.memory.parameters.vectors[rows])}
        arrays |= {
            "q": state["q"][rows],
            "v": state["v"][rows],
            "q_out": out["q"][rows],
            "v_out": out["v"][rows],
        }
        arrays |= self.arrays | {"work": aligned(self.work, self.dtype)}
        numbers = {
            "count": len(self.runs(group)),
            "samples": out["q"].shape[1],
            "steps": len(self.steps.lengths),
        }
        record = self.record(
            **numbers, pause=PAUSE, **{name: a.ctypes.data for name, a in arrays.items()}
        )
        while record.step < record.steps:
            if ended.is_set():
                return None
            if self.function(ctypes.addressof(record)):
                return False
        out["tau"][rows] = self.torques - self.arrays["damping"] * out["v"][rows, :, TAIL_V]
        return True
