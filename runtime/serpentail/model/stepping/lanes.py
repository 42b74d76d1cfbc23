"""Steps of several runs at once in lanes of vectors, by the generated C for lanes."""

import ctypes
import threading
from typing import Any

from ..batch import BatchLibrary
from ..kernel import address_of, aligned
from ..structures import REALS, structure
from .held import Held
from .singly import SingleSteps

ENTRIES = {"rk4": "flights", "implicit_euler": "ground"}  # in the manifest, by method
SYMBOLS = {"rk4": "steps", "implicit_euler": "ground"}  # in the name of the C function


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

    def make(self, held: Held, first: int, last: int) -> None:
        """Step runs [first, last), and write how each went to their statuses."""
        if not hasattr(self.own, "work"):
            self.own.work = aligned(self.work, self.dtype)
        held.statuses[first:last] = 0
        members: dict[str, Any] = {"count": last - first, "steps": held.steps, "h": held.h}
        for name in ("parameters", "q", "v", "bristles"):
            array = getattr(held, name)
            if array is not None:
                members[name] = address_of(array[first:last])
        for name, rows in (("torques", held.tau), ("legs", held.legs)):
            if rows is not None:
                part = rows[first:last]
                members[name] = part.ctypes.data
                members[f"{name}_apart"] = part.strides[0] // part.itemsize
        record: Any = self.record(work=address_of(self.own.work), **members)
        while record.first < last - first and self.function(ctypes.addressof(record)):
            failed = first + record.first
            self.singly.make(held, failed, min(failed + self.states, last))
            record.first += self.states
