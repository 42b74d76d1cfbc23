"""Runs that the generated C makes one after another on arrays of NumPy."""

import ctypes
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from ...model.library import PAUSED, STOPPED_AT_EVENT
from ...model.memory import address_of, aligned
from ...model.parameters import RunParameters
from ...model.structures import rows_of
from ..controllers.actuation import RunActuations
from ..ground import LANDED_AT, MOST_EVENTS, GroundSettings
from ..methods import IntegrationMethod
from ..start import Start
from .outcomes import COUNTS, RunOutcome, Samples, failed, sampled

MOST_STEPS = 2**31 - 1  # that the C interface counts
PAUSE = 100  # steps before the first check for signals, such as Ctrl-C
PAUSE_S = 0.05  # s between checks: the time between pauses grows to this
MOST_AT_ONCE = 512  # runs of one call: more would not make the rest of a call cheaper


class RunSet:
    """k runs to make: what acts in them, their method, and their arrays.

    parameters; states (k, size) as they go; samples (k, times, size).
    """

    def __init__(
        self,
        actuations: RunActuations,
        start: Start,
        ground: GroundSettings,
        parameters: RunParameters,
        method: IntegrationMethod,
    ):
        self.actuations, self.start, self.ground = actuations, start, ground
        self.parameters, self.method = parameters, method
        self.records, self.model = actuations.records, start.model
        records, model, dtype = self.records, self.model, self.records.dtype
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

    def samples(self, k: int, outcome: RunOutcome) -> Samples:
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

    def __init__(self, runs: RunSet):
        records, start, ground, method = runs.records, runs.start, runs.ground, runs.method
        self.runs, self.model = runs, runs.model
        # shared by all runs
        members = dict(start_members(method), pause=PAUSE, samples=start.intervals + 1)
        members["times"] = records.array(start.times)
        if ground.points:
            self.event_times = np.empty(MOST_EVENTS, records.dtype)
            self.event_kinds = np.empty(MOST_EVENTS, np.intc)
            members |= {"event_times": self.event_times, "event_kinds": self.event_kinds}
            members |= {"most_events": MOST_EVENTS, "stop_at": ground.stop_at}
        members["work"] = aligned(records.code.manifest["work"]["rollout"], records.dtype)
        members["method"] = self.model.manifest["simulation"]["methods"].get(method.name, 0)
        self.record: Any = records.record("run", t=start.start, **members)
        self.blank = bytes(self.record)
        self.address, self.rollout = ctypes.addressof(self.record), self.function("rollout")
        self.begin(0)

    def begin(self, k: int) -> None:
        """Take up run k, at its start."""
        ctypes.memmove(self.address, self.blank, len(self.blank))
        for member, first, apart in self.runs.places:
            setattr(self.record, member, first + k * apart)
        self.k, self.actuation = k, self.runs.actuations.of(k)
        self.record.drive, self.actuation.error = int(self.runs.actuations.drives[k]), None

    def records_of(self, runs: Sequence[int]) -> np.ndarray:
        """Return records of runs at their starts, which share the workspace."""
        numbers = np.array(runs)
        records = np.repeat(np.frombuffer(self.blank, rows_of(self.record.__class__)), len(numbers))
        for member, first, apart in self.runs.places:
            records[member] = first + numbers * apart
        records["drive"] = self.runs.actuations.drives[numbers]
        return records

    @property
    def state(self) -> dict[str, np.ndarray]:
        """Where the run is: q, v and, with contacts, bristles."""
        return {name: array[self.k] for name, array in self.runs.state.items()}

    def function(self, name: str, *arguments: type) -> Callable[..., int]:
        """Return a function of the compiled model that takes a run."""
        function = getattr(self.runs.records.code.library, f"{self.model.name}_{name}")
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

    def outcome(self, status: int) -> RunOutcome:
        """Return the outcome of the run, with the meaning of a status."""
        record = self.record
        info = {name: getattr(record, name) for name in COUNTS} | self.actuation.info()
        if self.runs.ground.points:
            count = min(record.events, MOST_EVENTS)
            times, kinds = self.event_times[:count].tolist(), self.event_kinds[:count].tolist()
            info["events"] = self.runs.ground.events(times, kinds)
            info["unfelt"] = record.unfelt
            info["peaks"] = self._peaks()
            info |= self._landed()
            if record.near_error > 0:
                info["near"] = self.runs.ground.near(record)
        failure = self.actuation.error
        if failure is None and status not in (0, STOPPED_AT_EVENT):
            failure = failed(status, record.t, self._extremes())
        stop = self._stop() if status == STOPPED_AT_EVENT else None
        ledger = self.state["ledger"].copy()
        return RunOutcome(record.done, record.t, ledger, info, failure, stop)

    def part(self, first: int, done: int) -> Samples:
        """Return what the run has written so far, from a sample on."""
        arrays = {name: a[self.k, first:done] for name, a in self.runs.out.items()}
        outcome = RunOutcome(done - first, 0, np.zeros(0), self._landed())
        return sampled(self.runs.start.times[first:], arrays, outcome)

    def _landed(self) -> dict[str, float]:
        """Return the time (s) at which the legs' landing began, if it has."""
        legs, at = self.runs.ground.legs, getattr(self.record, LANDED_AT, np.inf)
        return {LANDED_AT: at} if legs and legs.landing and at <= self.record.t else {}

    def _peaks(self) -> dict[str, list[float]]:
        """Return the largest force (N) at steps, and its time (s), of parts that numbers hold."""
        found = zip(
            self.model.manifest["simulation"]["parts"], self.runs.peaks[self.k], strict=True
        )
        return {name: peak.tolist() for name, peak in found if np.isfinite(peak).all()}

    def samples(self, status: int) -> Samples:
        """Return the samples written, with the meaning of a status."""
        return self.runs.samples(self.k, self.outcome(status))

    def _extremes(self) -> tuple[float, float]:
        """Return the largest torque (N m) and rate of a tail coordinate (rad/s) so far."""
        tau, v = (self.runs.out[name][self.k, : self.record.done] for name in ("tau", "v"))
        rates = (v, self.state["v"])
        tail = self.model.layout.tail_v
        return float(np.abs(tau).max(initial=0)), max(
            float(np.abs(each[..., tail]).max(initial=0)) for each in rates
        )

    def _stop(self) -> dict[str, Any] | None:
        """Return the state at which the run stopped, if that is not a sample."""
        if self.runs.start.times[self.record.done - 1] >= self.record.t:
            return None
        state = self.state
        tau = np.zeros_like(self.runs.out["tau"][0, 0])
        y, y_dot = (np.concatenate([*state.values()]) for _ in range(2))
        pointer = ctypes.c_void_p
        state_rate = self.function("state_rate", self.runs.records.real, pointer, pointer, pointer)
        state_rate(self.address, self.record.t, *(a.ctypes.data for a in (y, y_dot, tau)))
        row = {name: array.copy() for name, array in state.items()}
        return row | {"t": self.record.t, "tau": tau}


def start_members(method: IntegrationMethod) -> dict[str, Any]:
    """Return a method's settings as members of the run's record."""
    members: dict[str, Any] = dict(method.settings)
    members.setdefault("step", members.pop("first_step", 0))
    members["most_steps"] = int(min(members.get("most_steps", np.inf), MOST_STEPS))
    return members


@dataclass(frozen=True, eq=False)
class Ended:
    """Runs that came to an end in C: their numbers, records and statuses."""

    runs: np.ndarray
    records: np.ndarray
    statuses: np.ndarray


class RunsInTurn:
    """Makes runs without Python between them, a few at a time, so that it can react then."""

    def __init__(self, run: CompiledRun):
        self.run, self.pause, self.at_once = run, PAUSE, 1
        self.function = run.function("rollouts", ctypes.c_int, ctypes.c_void_p)

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
