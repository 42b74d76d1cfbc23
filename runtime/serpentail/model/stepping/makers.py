"""Steps of many runs by the generated C: one run after another, or several in lanes of vectors."""

import ctypes
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..library import BatchLibrary
from ..memory import address_of, aligned
from ..structures import REALS, rows_of, structure

MOST = 2**31 - 1  # that the C interface counts
SCRATCH = {"q_out": "q", "v_out": "v", "tau_out": "tau", "bristles_out": "bristles"}
ENTRIES = {"rk4": "flights", "implicit_euler": "ground"}  # in the manifest, by method
SYMBOLS = {"rk4": "steps", "implicit_euler": "ground"}  # in the name of the C function


@dataclass(frozen=True, eq=False)
class StepCall:
    """Runs of one call; arrays have the model's number type.

    q (k, nq), v (k, nv) and, on the ground, bristles (k, 2K) are advanced in place; tau (k, 2m) in
    N m is constant. legs (k, 4, 2): angles (rad) and rates (rad/s), with feet only. parameters (k,
    scalars). All rows of tau and legs may be the same. steps: their number; h: their length (s).
    """

    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    bristles: np.ndarray | None
    legs: np.ndarray | None
    parameters: np.ndarray
    h: float
    steps: int
    method: str
    statuses: np.ndarray

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.q)


class SingleSteps:
    """Makes steps of runs one by one; each thread has its own workspace."""

    def __init__(self, manifest: dict, library: ctypes.CDLL, dtype: np.dtype):
        self.manifest, self.dtype = manifest, dtype
        members = manifest["simulation"]["records"]
        self.types = {
            name: structure(name, tuple(map(tuple, each)), REALS[dtype])
            for name, each in members.items()
        }
        self.members = {name for name, _ in members["run"]}
        self.function: Any = getattr(library, f"{manifest['prefix']}_rollouts")
        self.function.argtypes = (ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
        self.own = threading.local()

    def make(self, call: StepCall, first: int, last: int) -> None:
        """Step runs [first, last), and write how each went to their statuses."""
        times = np.array([0, call.h * call.steps], self.dtype)
        # torques and legs, constant during the call, and actuation: a record for each run
        acting = {"torques": self._tables(call.tau[first:last], 0, times)}
        controllers = self._records("controller", torques=_places(acting["torques"]))
        drive: dict[str, Any] = {"phases": 1, "begins": address_of(times)}
        if call.legs is not None:
            acting["legs"] = self._tables(call.legs[first:last], 1, times)
            drive["legs"] = _places(acting["legs"])
        drives = self._records("drive", controllers=_places(controllers), **drive)
        # the runs themselves
        runs = self._records("run", drive=_places(drives), **self._settings(call, times))
        for name in ("parameters", "q", "v", "bristles"):
            if name in self.members:
                runs[name] = _places(getattr(call, name)[first:last])
        statuses = call.statuses[first:last]
        self.function(address_of(runs), len(runs), address_of(statuses))

    def _settings(self, call: StepCall, times: np.ndarray) -> dict[str, Any]:
        """Return members that all runs share."""
        scratch = self._workspace(call)
        return {
            "method": self.manifest["simulation"]["methods"][call.method],
            "step": call.h,
            "samples": 2,
            "times": address_of(times),
            "most_steps": MOST,
            "pause": MOST,
            **{name: address_of(array) for name, array in scratch.items()},
        }

    def _workspace(self, call: StepCall) -> dict[str, np.ndarray]:
        """Return this thread's memory: the C's workspace, and samples that are not used."""
        if not hasattr(self.own, "arrays"):
            work = aligned(self.manifest["work"]["rollout"], self.dtype)
            arrays = {"work": work}
            for name, of in SCRATCH.items():
                if name in self.members:
                    arrays[name] = np.zeros((2, getattr(call, of).shape[1]), self.dtype)
            self.own.arrays = arrays
        return self.own.arrays

    def _tables(self, rows: np.ndarray, degree: int, times: np.ndarray) -> np.ndarray:
        """Return tables of one piece, whose coefficients are a row of each run."""
        shared = {"pieces": 1, "channels": rows.shape[1], "degree": degree}
        places = _places(rows)
        return self._records("piecewise", coefficients=places, times=address_of(times), **shared)

    def _records(self, name: str, **members: Any) -> np.ndarray:
        """Return a record for each run, zero except for these members, shared or one for each."""
        count = max(np.size(value) for value in members.values())
        records = np.zeros(count, rows_of(self.types[name]))
        for member, value in members.items():
            records[member] = value
        return records


def _places(rows: np.ndarray) -> np.ndarray:
    """Return the addresses of the rows of an array."""
    return rows.ctypes.data + np.arange(len(rows)) * rows.strides[0]


class LaneSteps:
    """Makes steps of several runs at once; those among which one fails are made singly."""

    def __init__(self, manifest: dict, library: BatchLibrary, method: str, singly: SingleSteps):
        name, self.dtype, self.singly = ENTRIES[method], singly.dtype, singly
        entry = manifest[name]
        self.states, self.work = entry["states"], entry["work"]
        self.record = structure(name, tuple(map(tuple, entry["record"])), REALS[singly.dtype])
        symbol = f"{manifest['prefix']}_side_by_side_{SYMBOLS[method]}"
        self.function = library.sources[name].function(symbol)
        self.own = threading.local()

    def make(self, call: StepCall, first: int, last: int) -> None:
        """Step runs [first, last), and write how each went to their statuses."""
        if not hasattr(self.own, "work"):
            self.own.work = aligned(self.work, self.dtype)
        call.statuses[first:last] = 0
        members: dict[str, Any] = {"count": last - first, "steps": call.steps, "h": call.h}
        for name in ("parameters", "q", "v", "bristles"):
            array = getattr(call, name)
            if array is not None:
                members[name] = address_of(array[first:last])
        for name, rows in (("torques", call.tau), ("legs", call.legs)):
            if rows is not None:
                part = rows[first:last]
                members[name] = part.ctypes.data
                members[f"{name}_apart"] = part.strides[0] // part.itemsize
        record: Any = self.record(work=address_of(self.own.work), **members)
        while record.first < last - first and self.function(ctypes.addressof(record)):
            failed = first + record.first
            self.singly.make(call, failed, min(failed + self.states, last))
            record.first += self.states
