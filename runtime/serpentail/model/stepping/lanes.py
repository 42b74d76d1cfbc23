"""Steps of several runs at once in lanes of vectors, by the generated C for lanes."""

import ctypes
import threading
from typing import Any

import numpy as np

from ..kernel import address_of, aligned
from ..library import LazyLibrary
from ..structures import REALS, structure
from .held import Held
from .singly import SingleSteps


class LaneSteps:
    """Makes steps of several flights at once; those among which one fails are made singly."""

    entry, symbol = "flights", "steps"  # in the manifest, and in the name of the C function

    def __init__(self, manifest: dict, source: LazyLibrary, singly: SingleSteps):
        entry, self.dtype, self.singly = manifest[self.entry], singly.dtype, singly
        self.states, self.work = entry["states"], entry["work"]
        members = tuple(map(tuple, entry["record"]))
        self.record = structure(self.entry, members, REALS[singly.dtype])
        self.function = source.function(f"{manifest['prefix']}_side_by_side_{self.symbol}")
        self.still = np.zeros(manifest["dimensions"]["nv"], self.dtype)  # damping: none
        self.own = threading.local()

    def make(self, held: Held, first: int, last: int) -> None:
        """Step runs [first, last), and write how each went to their statuses."""
        if not hasattr(self.own, "work"):
            self.own.work, self.own.h = aligned(self.work, self.dtype), np.zeros(1, self.dtype)
        held.statuses[first:last] = 0
        tau, parameters = held.tau[first:last], held.parameters[first:last]
        record: Any = self.record(
            count=last - first,
            steps=held.steps,
            torques=tau.ctypes.data,
            torques_apart=tau.strides[0] // tau.itemsize,
            parameters=address_of(parameters),
            work=address_of(self.own.work),
            **self.state(held, first, last),
        )
        while record.first < last - first and self.function(ctypes.addressof(record)):
            failed = first + record.first
            self.singly.make(held, failed, min(failed + self.states, last))
            record.first += self.states

    def state(self, held: Held, first: int, last: int) -> dict[str, Any]:
        """Return members of the record: the states of runs, where they go, and the steps."""
        q, v = address_of(held.q[first:last]), address_of(held.v[first:last])
        self.own.h[0] = held.h
        steps = {"lengths": address_of(self.own.h), "damping": address_of(self.still)}
        return {"q": q, "q_out": q, "v": v, "v_out": v, **steps}


class GroundLaneSteps(LaneSteps):
    """The same on the ground, by implicit steps."""

    entry = symbol = "ground"

    def state(self, held: Held, first: int, last: int) -> dict[str, Any]:
        """Return members of the record: the states of runs, advanced in place, and the step."""
        arrays = {"q": held.q, "v": held.v, "bristles": held.bristles}
        members: dict[str, Any] = {
            name: address_of(array[first:last])
            for name, array in arrays.items()
            if array is not None
        }
        if held.legs is not None:
            legs = held.legs[first:last]
            members |= {
                "legs": legs.ctypes.data,
                "legs_apart": legs.strides[0] // legs.itemsize,
            }
        return members | {"h": held.h}
