"""The controller's C for a type of numbers, compiled once, and its structures for ctypes."""

import ctypes
import re
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from ..basics.errors import CompilerNotFound, PlanningError
from ..compiling.compiler import library_of_texts, opened

NATIVE = Path(__file__).parent / "native"
HEADERS = ("mpc.h", "mpc_layout.h")
SOURCES = (
    *("plan.c", "motion.c", "least_squares.c", "quadratic.c", "gauss_newton.c"),
    "controller.c",
)
FLAGS = ("-O3",)  # loops along rows of matrices
REALS = {"double": ctypes.c_double, "float": ctypes.c_float}
LITERAL = re.compile(r"\b\d+(?:\.\d+(?:e[-+]?\d+)?|e[-+]?\d+)\b")
SINGLE = {"double": "float", "doubles": "floats", "DBL_EPSILON": "FLT_EPSILON"}
SINGLE |= {"sqrt": "sqrtf", "fabs": "fabsf"}
WORD = re.compile(rf"\b({'|'.join(SINGLE)})\b")
_pointer, _int = ctypes.c_void_p, ctypes.c_int
SIZES = (
    *("tail", "intervals", "steps", "late_steps", "iterations", "goal_rows"),
    *("pieces", "powers", "work"),
)
TIMES = ("period", "delay", "horizon", "end", "last", "damping")
FUNCTIONS = ("rates", "slopes", "momentum")


COUNTS = ("ticks", "failed", "steps", "trials", "set_changes")


class ControllerCode(NamedTuple):
    """The C of one type of numbers: its functions, and the structures of native/mpc.h."""

    code: ctypes.CDLL
    real: Any  # of ctypes
    task: type[ctypes.Structure]
    simulation: type[ctypes.Structure]


def text_of(name: str, real: str) -> str:
    """Return a file of the controller for numbers of this type ("double" or "float")."""
    text = (NATIVE / name).read_text(encoding="utf-8")
    if real == "double":
        return text
    return WORD.sub(lambda word: SINGLE[word[0]], LITERAL.sub(r"\g<0>f", text))


def task_fields(real: Any) -> list[tuple[str, Any]]:
    """Return the members of ``mpc_task`` with their types."""
    return [
        *((name, _int) for name in SIZES),
        *((name, real) for name in TIMES),
        *((name, _pointer) for name in (*FUNCTIONS, "parameters", "times", "plan")),
        *((name, _pointer) for name in ("most_torque", "most_tail")),
        *((name, real) for name in ("near", "miss")),
        *((name, _pointer) for name in ("torque_weight", "rate_weight")),
        ("attitude_weight", real),
        *((name, _pointer) for name in ("goal", "end_state", "end_weight", "track_weight")),
    ]


def state_fields(real: Any) -> list[tuple[str, Any]]:
    """Return the members of ``mpc_state`` with their types."""
    return [
        *((name, _pointer) for name in ("task", "memory")),
        *((name, ctypes.c_long) for name in ("tick", *COUNTS)),
        ("flags", _int),
        ("log", _pointer),
        ("room", ctypes.c_long),
        ("newest", _int),
        *((name, real * 2) for name in ("begin", "width")),
        ("off", real),
    ]


@cache
def kernel(real: str) -> ControllerCode:
    """The controller in C, compiled once; PlanningError if no compiler works."""
    texts = {name: text_of(name, real).encode() for name in (*HEADERS, *SOURCES)}
    try:
        code = opened(lambda: library_of_texts(texts, flags=FLAGS))
    except CompilerNotFound as error:
        raise PlanningError(f"Mpc: {error}") from error
    number = REALS[real]
    code.mpc_memory_size.restype = ctypes.c_size_t
    code.mpc_memory_size.argtypes = (_pointer,)
    code.mpc_begin.argtypes = (_pointer,) * 3
    code.mpc_tick.argtypes = (_pointer, number, _pointer, _pointer)
    code.mpc_torque.argtypes = (_pointer, number, number, _pointer)
    code.mpc_control.argtypes = (_pointer, number, number, *(_pointer,) * 3)
    code.mpc_quadratic.argtypes = (_pointer,)
    code.mpc_begin.restype = code.mpc_torque.restype = code.mpc_control.restype = None

    # its structures
    task = type("mpc_task", (ctypes.Structure,), {"_fields_": task_fields(number)})
    state = type("mpc_state", (ctypes.Structure,), {"_fields_": state_fields(number)})
    members = [("state", state), ("step_begin", _pointer), ("clock", number)]
    simulation = type("mpc_simulation", (ctypes.Structure,), {"_fields_": members})
    return ControllerCode(code, number, task, simulation)
