"""The C of gains, compiled once, and its structures for ctypes."""

import ctypes
from functools import cache
from pathlib import Path

import numpy as np

from ...basics.errors import CompilerNotFound, PlanningError
from ...compiling.compiler import compile_library, opened

NATIVE = Path(__file__).parent / "native"
_pointer, _int, _double, _long = ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_long
ARRAYS = ("most_torque", "times", "plan", "begins", "gains", "costs", "region")
COUNTS = ("ticks", "failed", "saturated", "beyond")


class GainsRecord(ctypes.Structure):
    """``gains_task`` of native/gains.h."""

    _fields_ = (
        *((name, _int) for name in ("tail", "knots", "pieces", "powers")),
        ("period", _double),
        *((name, _pointer) for name in ARRAYS),
    )


class GainsState(ctypes.Structure):
    """``gains_simulation`` of native/simulated.c, which begins with a ``gains_state``."""

    _fields_ = (
        ("task", _pointer),
        ("memory", _pointer),
        *((name, _long) for name in COUNTS),
        ("held", _pointer),
        ("step_begin", _pointer),
        ("clock", _double),
        ("tick", _long),
    )


@cache
def kernel() -> ctypes.CDLL:
    """The gains in C, compiled once; PlanningError if no compiler works."""
    try:
        sources = [NATIVE / name for name in ("gains.c", "simulated.c")]
        made = opened(lambda: compile_library(sources, NATIVE))
    except CompilerNotFound as error:
        raise PlanningError(f"Gains: {error}") from error
    made.gains_memory_size.argtypes = (_pointer,)
    made.gains_begin.argtypes, made.gains_begin.restype = (_pointer,) * 3, None
    made.gains_tick.argtypes = (_pointer, _double, *(_pointer,) * 3)
    return made


class GainsMemory:
    """The memory of one controller at work, and the C code that uses it."""

    def __init__(self, tables: dict[str, np.ndarray], period: float):
        self.code, self.tables = kernel(), tables
        self.record = record = GainsRecord(*sizes(tables), period)
        for name in ARRAYS:
            setattr(record, name, tables[name].ctypes.data)
        self.memory = np.zeros(self.code.gains_memory_size(ctypes.addressof(record)))
        self.tau = np.zeros(record.tail)
        self.run = GainsState(held=self.tau.ctypes.data)
        self.state = ctypes.addressof(self.run)
        self.begin()

    def begin(self) -> None:
        """Forget all ticks."""
        self.code.gains_begin(self.state, ctypes.addressof(self.record), self.memory.ctypes.data)
        self.run.tick = -1

    def tick(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the torques of a tick."""
        self.code.gains_tick(self.state, t, q.ctypes.data, v.ctypes.data, self.tau.ctypes.data)
        return self.tau.copy()

    def counts(self) -> dict[str, int]:
        """Return the numbers of ticks, and of those that told each flag."""
        return {name: int(getattr(self.run, name)) for name in COUNTS}


def sizes(tables: dict[str, np.ndarray]) -> tuple[int, int, int, int]:
    """Return tail coordinates, knots, pieces and powers of tables."""
    knots, tail, _ = tables["gains"].shape
    pieces, _, powers = tables["plan"].shape
    return tail, knots, pieces, powers
