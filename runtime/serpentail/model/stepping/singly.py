"""Steps of runs one after another, by the rollout of the C: in flight and on the ground."""

import ctypes
import threading
from typing import Any

import numpy as np

from ..kernel import address_of, aligned
from ..structures import REALS, structure
from .held import Held

MOST = 2**31 - 1  # that the C interface counts
SCRATCH = {"q_out": "q", "v_out": "v", "tau_out": "tau", "bristles_out": "bristles"}


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

    def make(self, held: Held, first: int, last: int) -> None:
        """Step runs [first, last), and write how each went to their statuses."""
        times = np.array([0, held.h * held.steps], self.dtype)
        # torques and legs, constant during the call, and actuation: a record for each run
        acting = {"torques": self._tables(held.tau[first:last], 0, times)}
        controllers = self._records("controller", torques=_places(acting["torques"]))
        drive: dict[str, Any] = {"phases": 1, "begins": address_of(times)}
        if held.legs is not None:
            acting["legs"] = self._tables(held.legs[first:last], 1, times)
            drive["legs"] = _places(acting["legs"])
        drives = self._records("drive", controllers=_places(controllers), **drive)
        # the runs themselves
        runs = self._records("run", drive=_places(drives), **self._settings(held, times))
        for name in ("parameters", "q", "v", "bristles"):
            if name in self.members:
                runs[name] = _places(getattr(held, name)[first:last])
        statuses = held.statuses[first:last]
        self.function(address_of(runs), len(runs), address_of(statuses))

    def _settings(self, held: Held, times: np.ndarray) -> dict[str, Any]:
        """Return members that all runs share."""
        scratch = self._workspace(held)
        return {
            "method": self.manifest["simulation"]["methods"][held.method],
            "step": held.h,
            "samples": 2,
            "times": address_of(times),
            "most_steps": MOST,
            "pause": MOST,
            **{name: address_of(array) for name, array in scratch.items()},
        }

    def _workspace(self, held: Held) -> dict[str, np.ndarray]:
        """Return this thread's memory: the C's workspace, and samples that are not used."""
        if not hasattr(self.own, "arrays"):
            work = aligned(self.manifest["work"]["rollout"], self.dtype)
            arrays = {"work": work}
            for name, of in SCRATCH.items():
                if name in self.members:
                    arrays[name] = np.zeros((2, getattr(held, of).shape[1]), self.dtype)
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
        records = np.zeros(count, np.dtype(self.types[name]))
        for member, value in members.items():
            records[member] = value
        return records


def _places(rows: np.ndarray) -> np.ndarray:
    """Return the addresses of the rows of an array."""
    return rows.ctypes.data + np.arange(len(rows)) * rows.strides[0]
