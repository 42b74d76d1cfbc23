"""Calls of compiled functions through a small C extension.

By ctypes if Python's headers are missing.
"""

import ctypes
import math
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from numpy import ndarray

from ..basics.errors import SerpentailError
from ..compiling.compiler import compile_library, opened

SOURCE = Path(__file__).with_name("native") / "calls.c"
# for linkers that ask for every symbol of an extension
LINKING = ("-Wl,-undefined,dynamic_lookup",) if sys.platform == "darwin" else ()
Call = Callable[..., Any]  # takes arguments, returns outputs, or None where it does not serve


class Tries:
    """When the extension may be compiled, after failures: room on a disk may come back."""

    def __init__(self) -> None:
        self.waits = iter((1.0, 10.0, 100.0))  # s from a failure to the next try
        self.next = -math.inf


_tries = Tries()


class Memory(Protocol):
    """What a function works on, and the address of a record that points to it."""

    inputs: list[ndarray]
    outputs: list[ndarray]
    address: int


def call_of(function: Any, own: Memory) -> Call:
    """Return a fast call of a generated C function on one state."""
    library = extension()
    if library is None:
        return declined
    code, arrays = ctypes.cast(function, ctypes.c_void_p), (*own.inputs, *own.outputs)
    return library.serpentail_call(code, own.address, arrays, len(own.inputs), own)


def declined(*_: Any) -> None:
    """Stand in for such a call if ctypes makes all calls."""


def waiting() -> bool:
    """Tell whether the extension could not be compiled, and is to be tried again later."""
    return time.monotonic() < _tries.next < math.inf


def extension() -> ctypes.PyDLL | None:
    """Return the extension, or None if it cannot be had now."""
    if time.monotonic() < _tries.next:
        return None
    try:
        return _compiled()
    except (SerpentailError, OSError):  # ctypes serves, and needs nothing more
        _tries.next = time.monotonic() + next(_tries.waits, math.inf)
        return None


@cache
def _compiled() -> ctypes.PyDLL | None:
    """Return it, compiled once for a compiler and a Python; None if this Python takes none."""
    import sysconfig

    headers = Path(sysconfig.get_path("include"))
    locked = sys.implementation.name == "cpython" and not sysconfig.get_config_var(
        "Py_GIL_DISABLED"
    )
    if not (locked and (headers / "Python.h").is_file()):
        return None
    flags = ("-I", str(headers), *LINKING)
    library = opened(lambda: compile_library([SOURCE], SOURCE.parent, flags=flags), ctypes.PyDLL)
    made = library.serpentail_call
    made.restype = ctypes.py_object
    pointer, thing = ctypes.c_void_p, ctypes.py_object
    made.argtypes = (pointer, pointer, thing, ctypes.c_ssize_t, thing)
    return library
