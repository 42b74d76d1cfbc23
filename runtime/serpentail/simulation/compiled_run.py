"""Runs of the generated C on arrays of NumPy, and the outcome of each."""

import ctypes
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from ..basics.errors import SimulationError
from ..basics.plausible_values import LARGEST
from ..model.kernel import address_of, aligned
from ..model.lazy import lazy_property
from ..model.library import PAUSED, STEP_TOO_SMALL, STOPPED_AT_EVENT, TOO_MANY_STEPS, WHY
from ..model.model import Model
from ..model.parameters import RunParameters
from .acting import Acting
from .decay import FastestDecay
from .ground import MOST_EVENTS, Ground
from .methods import IntegrationMethod
from .records import Records
from .start import Start

MOST_STEPS = 2**31 - 1  # that the C interface counts
PAUSE = 100  # steps before the first check for signals, such as Ctrl-C
PAUSE_S = 0.05  # s between checks: the time between pauses grows to this
STEPS = (STEP_TOO_SMALL, TOO_MANY_STEPS)  # statuses: the steps became too short
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
class Outcome:
    """Outcome of a run: samples written, end (s), ledger, counts and events, failure, stop."""

    done: int
    end: float
    ledger: np.ndarray
    info: dict[str, Any]
    failure: BaseException | None = None
    stop: dict[str, Any] | None = None  # between samples: t (s) and a row of every array


class Memory:
    """Arrays of k runs: parameters; states (k, size) as they go; samples (k, times, size)."""

    def __init__(self, records: Records, start: Start, ground: Ground, parameters: RunParameters):
        model, dtype = records.model, records.dtype
        self.records, self.start, self.ground, self.parameters = records, start, ground, parameters
        self.state = {
            "q": np.array(start.q0, dtype, order="C"),
            "v": np.array(start.v0, dtype, order="C"),
        }
        sizes = {
            "q": model.nq,
            "v": model.nv,
            "tau": model.layout.nt,
            "bristles": 2 * ground.points,
        }
        if ground.points:
            self.state["bristles"] = np.array(ground.bristles.reshape(start.runs, -1), dtype)
        entries = model.manifest["simulation"]["ledger"]
        self.state["ledger"] = np.zeros((start.runs, sum(size for _, size in entries)), dtype)
        parts = model.manifest["simulation"].get("parts", [])
        self.peaks = np.zeros((start.runs, len(parts), 2), dtype)
        self.out = {
            name: np.zeros((start.runs, start.intervals + 1, size), dtype)
            for name, size in sizes.items()
        }
        # addresses of the first run's arrays, and the distances between those of two runs
        arrays = {"parameters": parameters.vectors, "peaks": self.peaks} | self.state
        arrays |= {f"{name}_out": array for name, array in self.out.items()}
        self.places = []
        for member, array in arrays.items():
            if records.has("run", member):
                self.places.append((member, address_of(array), array.strides[0]))

    def restart(self, q0: np.ndarray, v0: np.ndarray) -> None:
        """Take other starts q0 (k, nq), v0 (k, nv)."""
        self.state["q"][...], self.state["v"][...], self.state["ledger"][...] = q0, v0, 0
        self.peaks[...] = 0
        if self.ground.points:
            self.state["bristles"][...] = self.ground.bristles.reshape(self.start.runs, -1)

    def part(self, k: int, first: int, done: int) -> Samples:
        """Return what run k has written so far, from a sample on."""
        arrays = {name: a[k, first:done] for name, a in self.out.items()}
        return sampled(self.start.times[first:], arrays, Outcome(done - first, 0, np.zeros(0), {}))

    def samples(self, k: int, outcome: Outcome) -> Samples:
        """Return what run k wrote."""
        return sampled(self.start.times, {name: a[k] for name, a in self.out.items()}, outcome)


def called(function: Callable[[int], int], record: Any) -> int:
    """Call a C function that works until it pauses; lengthen the pauses if they come too often."""
    begun = time.perf_counter()
    answer = function(ctypes.addressof(record))
    if time.perf_counter() - begun < PAUSE_S:
        record.pause *= 2
    return answer


class CompiledRun:
    """A record of the generated C that takes up runs one after another; for one thread."""

    def __init__(self, memory: Memory, acting: Acting, method: IntegrationMethod):
        records, start, ground = memory.records, memory.start, memory.ground
        self.memory, self.records, self.acting = memory, records, acting
        self.method, self.start, self.ground = method, start, ground
        # shared by all runs
        members = dict(start_members(method), pause=PAUSE, samples=start.intervals + 1)
        members["times"] = records.array(start.times)
        if ground.points:
            self.event_times = np.empty(MOST_EVENTS, records.dtype)
            self.event_kinds = np.empty(MOST_EVENTS, np.intc)
            members |= {"event_times": self.event_times, "event_kinds": self.event_kinds}
            members |= {"most_events": MOST_EVENTS, "stop_at": ground.stop_at}
        members["work"] = aligned(self.model.manifest["work"]["rollout"], records.dtype)
        members["method"] = self.model.manifest["simulation"]["methods"].get(method.name, 0)
        self.record: Any = records.record("run", t=start.start, **members)
        self.blank = bytes(self.record)
        self.address, self.rollout = ctypes.addressof(self.record), self.function("rollout")
        self.begin(0)

    def begin(self, k: int) -> None:
        """Take up run k, at its start."""
        ctypes.memmove(self.address, self.blank, len(self.blank))
        for member, first, apart in self.memory.places:
            setattr(self.record, member, first + k * apart)
        self.k, self.actuation = k, self.acting.of(k)
        self.record.drive, self.actuation.error = int(self.acting.drives[k]), None

    def records_of(self, runs: Sequence[int]) -> np.ndarray:
        """Return records of runs at their starts, which share the workspace."""
        numbers = np.array(runs)
        records = np.repeat(np.frombuffer(self.blank, np.dtype(type(self.record))), len(numbers))
        for member, first, apart in self.memory.places:
            records[member] = first + numbers * apart
        records["drive"] = self.acting.drives[numbers]
        return records

    def again(self, q0: np.ndarray, v0: np.ndarray) -> None:
        """Prepare the first run again, from another start."""
        self.memory.restart(q0, v0)
        self.begin(0)

    @lazy_property
    def decay(self) -> FastestDecay:
        """How fast its joint damping is, for other starts."""
        return FastestDecay(self.acting, self.start.runs, self.memory.parameters)

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.records.model

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Where the run is: q, v and, with contacts, bristles."""
        return {name: array[self.k] for name, array in self.memory.state.items()}

    def function(self, name: str, *arguments: type) -> Callable[..., int]:
        """Return a function of the compiled model that takes a run."""
        function = getattr(self.model.library, f"{self.model.name}_{name}")
        function.argtypes = (ctypes.c_void_p, *arguments)
        return function

    def go(self, ended: Event | None = None, look: Callable[[], None] | None = None) -> int:
        """Advance until the run ends, something ends it, or ``ended`` is set; return the status.

        look: called at each pause.
        """
        status = PAUSED
        self.actuation.begin(self.record)
        try:
            with self.actuation.ctrl_c.waits(self.actuation.of_python):
                while status == PAUSED and not (ended and ended.is_set()):
                    status = called(self.rollout, self.record)
                    if look is not None:
                        look()
        except KeyboardInterrupt as stop:  # ends the run, whose motion until then is kept
            self.actuation.error = stop
        return status

    def outcome(self, status: int) -> Outcome:
        """Return the outcome of the run, with the meaning of a status."""
        record = self.record
        info = {name: getattr(record, name) for name in COUNTS} | self.actuation.told()
        if self.ground.points:
            count = min(record.events, MOST_EVENTS)
            times, kinds = self.event_times[:count].tolist(), self.event_kinds[:count].tolist()
            info["events"] = self.ground.events(times, kinds)
            info["unfelt"] = record.unfelt
            info["peaks"] = self._peaks()
            if record.near_error > 0:
                info["near"] = self.ground.near(record)
        failure = self.actuation.error
        if failure is None and status not in (0, STOPPED_AT_EVENT):
            failure = failed(status, record.t, self._extremes())
        stop = self._stop() if status == STOPPED_AT_EVENT else None
        ledger = self.state["ledger"].copy()
        return Outcome(record.done, record.t, ledger, info, failure, stop)

    def _peaks(self) -> dict[str, list[float]]:
        """Return the largest force (N) at steps, and its time (s), of parts that numbers hold."""
        found = zip(
            self.model.manifest["simulation"]["parts"], self.memory.peaks[self.k], strict=True
        )
        return {name: peak.tolist() for name, peak in found if np.isfinite(peak).all()}

    def samples(self, status: int) -> Samples:
        """Return the samples written, with the meaning of a status."""
        return self.memory.samples(self.k, self.outcome(status))

    def _extremes(self) -> tuple[float, float]:
        """Return the largest torque (N m) and rate of a tail coordinate (rad/s) so far."""
        tau, v = (self.memory.out[name][self.k, : self.record.done] for name in ("tau", "v"))
        rates = (v, self.state["v"])
        tail = self.model.layout.tail_v
        return float(np.abs(tau).max(initial=0)), max(
            float(np.abs(each[..., tail]).max(initial=0)) for each in rates
        )

    def _stop(self) -> dict[str, Any] | None:
        """Return the state at which the run stopped, if that is not a sample."""
        if self.start.times[self.record.done - 1] >= self.record.t:
            return None
        state = self.state
        tau = np.zeros_like(self.memory.out["tau"][0, 0])
        y, y_dot = (np.concatenate([*state.values()]) for _ in range(2))
        pointer = ctypes.c_void_p
        state_rate = self.function("state_rate", self.records.real, pointer, pointer, pointer)
        state_rate(self.address, self.record.t, *(a.ctypes.data for a in (y, y_dot, tau)))
        row = {name: array.copy() for name, array in state.items()}
        return row | {"t": self.record.t, "tau": tau}


def sampled(times: np.ndarray, arrays: dict[str, np.ndarray], outcome: Outcome) -> Samples:
    """Return what a run wrote to q, v, tau, bristles, with the state of its stop as last sample."""
    t, done, stop = times[: outcome.done].copy(), outcome.done, outcome.stop
    rows = {name: a[:done].astype(float).reshape(done, a[0].size) for name, a in arrays.items()}
    if stop is not None:
        t = np.append(t, stop["t"])
        rows = {name: np.vstack([a, stop[name]]).astype(float) for name, a in rows.items()}
    bristles = rows["bristles"].reshape(len(t), rows["bristles"].shape[1] // 2, 2)
    return Samples(
        t,
        rows["q"],
        rows["v"],
        rows["tau"],
        bristles,
        outcome.ledger,
        outcome.info,
        outcome.failure,
    )


def start_members(method: IntegrationMethod) -> dict[str, Any]:
    """Return a method's settings as members of the run's record."""
    members: dict[str, Any] = dict(method.settings)
    members.setdefault("step", members.pop("first_step", 0))
    members["most_steps"] = int(min(members.get("most_steps", np.inf), MOST_STEPS))
    return members


def failed(status: int, t: float, extremes: tuple[float, float] = (0, 0)) -> SimulationError:
    """Return the error that a status of the C interface means.

    extremes: largest torque (N m) and rate of a tail coordinate (rad/s) so far.
    """
    torque, rate = extremes
    words = f"at t = {t:.6g} s {WHY[status]}"
    if status in STEPS and torque and rate > LARGEST["rad/s"][0]:
        words += f" Torques reach {torque:.3g} N m, and a joint {rate:.3g} rad/s: is a torque far"
        words += " too large?"
    return SimulationError(words)
