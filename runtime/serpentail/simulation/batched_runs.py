"""Many runs with the same steps; the generated C makes several at once, in lanes."""

from collections.abc import Iterator
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from serpentail_scene.layout import TAIL_V

from ..compiling.cores import threads as allowed
from ..model.kernel import aligned
from ..model.model import Model
from ..model.structures import structure
from .acting import Acting
from .controllers.actuation import Actuation
from .runs.single import PAUSE, Memory, called
from .methods import IntegrationMethod, step_counts
from .controllers.piecewise import Piecewise, constant
from .start import Start

MAX_SHARED_STEPS = 1_000_000  # steps of one run: with more, shared arrays would fill the memory
AT_ONCE = 64  # groups of runs that a thread takes up at once
# Time to compile, and time that lanes save in a step, for tails from (1, 3) to (8, 16): about the
# less favourable of measurements with AVX2 and with AVX-512
COMPILE_S_PER_BYTE = 25e-6  # of C
STEP_SAVES_S, OPERATION_SAVES_S = 4e-7, 2e-10  # each step; each operation of forward dynamics


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps that all runs share.

    lengths (n,) in s; begins, ends (n,) in s; due (n,): 1 where a sample follows.
    """

    lengths: np.ndarray
    begins: np.ndarray
    ends: np.ndarray
    due: np.ndarray

    @classmethod
    def planned(cls, start: Start, actuation: Actuation, step: float) -> "Steps":
        """Return the steps between samples and stops, equal in between and of about ``step`` s."""
        edges = _edges(start, actuation)
        spans, slack = _spans(edges)
        counts = step_counts(spans, slack, step)
        # for each step: the edges that enclose it, and its number between them
        span = np.repeat(np.arange(len(spans)), counts)
        within = np.arange(len(span)) - np.repeat(np.cumsum(counts) - counts, counts)
        last = within + 1 == counts[span]
        # where it begins and ends; steps that fit are exactly as long as asked for
        lengths = np.where(np.abs(counts * step - spans) <= slack, step, spans / counts)[span]
        begins = edges[span] + within * lengths
        ends = np.where(last, edges[span + 1], begins + lengths)
        due = (last & np.isin(edges[span + 1], start.times)).astype(np.intc)
        return cls(lengths, begins, ends, due)

    def torques(self, curve: Piecewise) -> np.ndarray:
        """Return torques (n, 3, 2m), N m, at begin, middle and end of each step."""
        middles = (self.begins + self.ends) / 2
        values = at(curve, self.begins), at(curve, middles), before(curve, self.ends)
        return np.stack(values, axis=1)


def _edges(start: Start, actuation: Actuation) -> np.ndarray:
    """Times (s) at which steps end: start, samples, stops."""
    stops = np.asarray(actuation.stops, float)
    return np.union1d(start.times, stops[(stops > start.start) & (stops < start.end)])


def _spans(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times between edges (s), and their rounding, as for a single run in C."""
    spans = np.diff(edges)
    return spans, 100 * np.finfo(float).eps * (np.abs(edges[1:]) + spans)


def at(curve: Piecewise, t: np.ndarray) -> np.ndarray:
    """Values (n, channels) at times (n,), s; where two pieces meet, of the later."""
    if curve.never_changes:
        return np.broadcast_to(curve.coefficients[0, :, 0], (len(t), curve.channels))
    return curve.at(t)[0]


def before(curve: Piecewise, t: np.ndarray) -> np.ndarray:
    """Values (n, channels) at times (n,), s; where two pieces meet, of the earlier."""
    return at(curve, np.nextafter(t, -np.inf))


def shared_steps(memory: Memory, acting: Acting, method: IntegrationMethod) -> int:
    """Return the number of steps that all runs share; 0 if they cannot be made in batches."""
    start, first = memory.start, acting.distinct[0]
    if method.name != "rk4" or "flights" not in memory.records.model.manifest:
        return 0
    for each in acting.distinct:
        # a single phase of damping and torques, with kinks at the same times as in other runs
        parts = each.parts[0]
        others = (parts.pfl, parts.native, parts.user)
        if len(each.parts) > 1 or any(part is not None for part in others):
            return 0
        if not np.array_equal(each.stops, first.stops):
            return 0
    spans, slack = _spans(_edges(start, first))
    steps = int(step_counts(spans, slack, method.settings["step"]).sum())
    runs = 1 if acting.alike else memory.records.model.manifest["flights"]["states"]
    return steps if runs * steps <= MAX_SHARED_STEPS else 0


def worth_batching(model: Model, runs: int, steps: int) -> bool:
    """Tell whether it is worthwhile to make runs in lanes.

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


def shared_out(runs: range, states: int, threads: int, most: int = AT_ONCE) -> list[range]:
    """Return the groups of runs that a thread makes at once, with at most ``most`` runs each."""
    groups = -(-len(runs) // states)
    size = states * max(1, min(most, groups // (2 * threads)))
    return [runs[first : first + size] for first in range(0, len(runs), size)]


@dataclass(frozen=True, eq=False)
class Laws:
    """Torques of runs; a single row is shared by all runs.

    damping (k, 2m), N m s; torques (k, n, 3, 2m), N m, at begin, middle and end of each step, or
    None; sampled (k, samples, 2m), N m.
    """

    damping: np.ndarray
    torques: np.ndarray | None
    sampled: np.ndarray


class BatchedRuns:
    """Runs of a memory; the generated C makes several of them at once."""

    def __init__(self, memory: Memory, acting: Acting, method: IntegrationMethod):
        self.memory, self.acting, model = memory, acting, memory.records.model
        # the C function, and its record
        entry, dtype = model.manifest["flights"], memory.records.dtype
        self.states, self.work, self.dtype = entry["states"], entry["work"], dtype
        self.record = structure("flights", tuple(map(tuple, entry["record"])), memory.records.real)
        self.function = model.batch_library.rollouts.function(f"{model.name}_side_by_side_flights")
        self.steps = Steps.planned(memory.start, acting.distinct[0], method.settings["step"])
        self.lengths = np.ascontiguousarray(self.steps.lengths, dtype)
        self.shared = self._laws(acting.distinct) if acting.alike else None

    def _laws(self, actuations: list[Actuation]) -> "Laws":
        """Return the torques of runs, as the C takes them."""
        parts = [each.parts[0] for each in actuations]
        nt, times = actuations[0].nt, self.memory.start.times
        still = constant(0.0, np.zeros(nt))
        damping = [np.zeros(nt) if each.damping is None else each.damping for each in parts]
        curves = [still if each.torques is None else each.torques for each in parts]
        sampled = [np.vstack([at(c, times[:1]), before(c, times[1:])]) for c in curves]
        torques = None
        if any(each.torques is not None for each in parts):
            torques = np.array([self.steps.torques(curve) for curve in curves], self.dtype)
        return Laws(np.array(damping, self.dtype), torques, np.array(sampled, self.dtype))

    def parts(self, runs: range, threads: int) -> list[range]:
        """Return the groups of runs that a thread makes at once, whole groups if possible."""
        if self.acting.alike:
            return shared_out(runs, self.states, threads)
        # torques at each step of each run are to be held
        most = MAX_SHARED_STEPS // (self.states * len(self.lengths))
        return shared_out(runs, self.states, threads, min(AT_ONCE, most))

    def go(self, runs: range, ended: Event) -> Iterator[tuple[np.ndarray, dict[str, Any] | None]]:
        """Make runs; yield their numbers and outcomes, None for those that must be made alone."""
        laws = self.shared or self._laws([self.acting.of(k) for k in runs])
        record, held = self._record(slice(runs.start, runs.stop), laws)
        steps, start = len(self.lengths), self.memory.start
        told: dict[str, Any] = {"steps": steps, "evaluations": 4 * steps}
        told |= {"done": start.intervals + 1, "ends": start.end}
        while record.first < record.count and not ended.is_set():
            first = record.first
            failed = called(self.function, record)
            last = min(record.first, record.count)
            # of those that have ended, only the last ones may have failed
            sound = (last - 1) // self.states * self.states if failed else last
            if sound > first:
                self._write_torques(runs[first:sound], laws, first)
                numbers = np.array(runs[first:sound])
                yield numbers, told | {"ledger": self.memory.state["ledger"][numbers]}
            if failed:
                yield np.array(runs[sound:last]), None
        del held

    def _write_torques(self, runs: range, laws: Laws, first: int) -> None:
        """Write the torques of the samples of runs; their laws begin at the first of some."""
        rows = slice(runs.start, runs.stop)
        own = slice(None) if self.acting.alike else slice(first, first + len(runs))
        rates = self.memory.out["v"][rows, :, TAIL_V]
        self.memory.out["tau"][rows] = laws.sampled[own] - laws.damping[own, None] * rates

    def _record(self, rows: slice, laws: Laws) -> tuple[Any, dict[str, np.ndarray]]:
        """Return the C record of some runs, and the arrays that it points to."""
        state, out = self.memory.state, self.memory.out
        arrays = {
            "lengths": self.lengths,
            "due": self.steps.due,
            "damping": laws.damping,
            "parameters": np.ascontiguousarray(self.memory.parameters.vectors[rows]),
            "q": state["q"][rows],
            "v": state["v"][rows],
            "q_out": out["q"][rows],
            "v_out": out["v"][rows],
            "ledger": state["ledger"][rows],
            "work": aligned(self.work, self.dtype),
        }
        if laws.torques is not None:
            arrays["torques"] = laws.torques
        own = {n: arrays[n][0].size for n in ("damping", "torques") if n in arrays}
        record = self.record(
            count=rows.stop - rows.start,
            samples=out["q"].shape[1],
            steps=len(self.lengths),
            pause=PAUSE,
            **{f"{n}_apart": 0 if self.acting.alike else size for n, size in own.items()},
            **{name: array.ctypes.data for name, array in arrays.items()},
        )
        return record, arrays
