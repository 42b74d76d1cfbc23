"""Steps of flights in lanes of vectors, by the batch rollout of the generated C."""

import ctypes
import threading
from typing import Any

import numpy as np

from ..batch import LazyLibrary
from ..kernel import address_of, aligned
from ..structures import REALS, structure
from .held import Held
from .singly import SingleSteps


class LaneSteps:
    """Makes steps of several flights at once; those among which one fails are made singly."""

    def __init__(self, manifest: dict, source: LazyLibrary, singly: SingleSteps):
        entry, self.dtype, self.singly = manifest["flights"], singly.dtype, singly
        self.states, self.work = entry["states"], entry["work"]
        self.record = structure("flights", tuple(map(tuple, entry["record"])), REALS[singly.dtype])
        self.function = source.function(f"{manifest['prefix']}_side_by_side_steps")
        self.still = np.zeros(manifest["dimensions"]["nv"], self.dtype)  # damping: none
        self.own = threading.local()

    def make(self, held: Held, first: int, last: int) -> None:
        """Step runs [first, last), and write how each went to their statuses."""
        if not hasattr(self.own, "work"):
            self.own.work = aligned(self.work, self.dtype)
        held.statuses[first:last] = 0
        q, v, tau = (array[first:last] for array in (held.q, held.v, held.tau))
        h, parameters = np.array([held.h], self.dtype), held.parameters[first:last]
        record: Any = self.record(
            count=last - first,
            steps=held.steps,
            lengths=address_of(h),
            torques=tau.ctypes.data,
            torques_apart=tau.strides[0] // tau.itemsize,
            damping=address_of(self.still),
            parameters=address_of(parameters),
            **{name: address_of(q) for name in ("q", "q_out")},
            **{name: address_of(v) for name in ("v", "v_out")},
            work=address_of(self.own.work),
        )
        while record.first < last - first and self.function(ctypes.addressof(record)):
            failed = first + record.first
            self.singly.make(held, failed, min(failed + self.states, last))
            record.first += self.states
