"""The controller's C, compiled once, and its structures for ctypes."""

import ctypes
from functools import cache
from pathlib import Path

from ..basics.errors import CompilerNotFound, PlanningError
from ..compiling.compiler import compile_library, opened

NATIVE = Path(__file__).parent / "native"
SOURCES = ("plan.c", "motion.c", "least_squares.c", "box_qp.c", "controller.c")
FLAGS = ("-O3",)  # loops along rows of matrices
_pointer, _int, _double = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
INTEGERS = ("tail", "intervals", "steps", "late_steps", "iterations", "goal_rows")
SIZES = (*INTEGERS, "pieces", "powers", "work")
TIMES = ("period", "delay", "horizon", "end", "last", "damping")
FUNCTIONS = ("rates", "slopes", "momentum")


class TaskRecord(ctypes.Structure):
    """``mpc_task`` of native/mpc.h."""

    _fields_ = (
        *((name, _int) for name in SIZES),
        *((name, _double) for name in TIMES),
        *((name, _pointer) for name in (*FUNCTIONS, "parameters", "times", "plan")),
        *((name, _pointer) for name in ("most_torque", "most_angle")),
        *((name, _pointer) for name in ("torque_weight", "rate_weight")),
        *((name, _double) for name in ("angle_weight", "attitude_weight")),
        *((name, _pointer) for name in ("goal", "end_state", "end_weight", "track_weight")),
    )


class StateRecord(ctypes.Structure):
    """``mpc_state``."""

    _fields_ = (
        ("task", _pointer),
        ("memory", _pointer),
        *((name, ctypes.c_long) for name in ("tick", "ticks", "failed", "set_changes")),
        ("newest", _int),
        ("begin", _double * 2),
        ("width", _double * 2),
        ("cost", _double),
    )


class Simulation(ctypes.Structure):
    """``mpc_simulation``."""

    _fields_ = (("state", StateRecord), ("step_begin", _pointer), ("clock", _double))


@cache
def kernel() -> ctypes.CDLL:
    """The controller in C, compiled once; PlanningError if no compiler works."""
    try:
        sources = [NATIVE / name for name in SOURCES]
        made = opened(lambda: compile_library(sources, NATIVE, flags=FLAGS))
    except CompilerNotFound as error:
        raise PlanningError(f"Mpc: {error}") from error
    made.mpc_memory_size.restype = ctypes.c_size_t
    made.mpc_memory_size.argtypes = (_pointer,)
    made.mpc_begin.argtypes = (_pointer,) * 3
    made.mpc_tick.argtypes = (_pointer, _double, _pointer, _pointer)
    made.mpc_torque.argtypes = (_pointer, _double, _double, _pointer)
    made.mpc_control.argtypes = (_pointer, _double, _double, *(_pointer,) * 3)
    made.mpc_quadratic.argtypes = (_int, *(_pointer,) * 7)
    made.mpc_begin.restype = made.mpc_torque.restype = made.mpc_control.restype = None
    return made
