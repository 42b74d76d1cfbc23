"""Calls of compiled functions through a small C extension.

By ctypes if Python's headers are missing.
"""

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from numpy import ndarray

from ..errors import SerpentailError
from .compiler import compile_library

SOURCE = Path(__file__).with_name("native") / "calls.c"
# for linkers that ask for every symbol of an extension
LINKING = ("-Wl,-undefined,dynamic_lookup",) if sys.platform == "darwin" else ()
Call = Callable[..., Any]  # takes arguments, returns outputs, or None where it does not serve


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


@cache
def extension() -> ctypes.PyDLL | None:
    """Return the extension, compiled once for a compiler and a Python; None if that fails."""
    import sysconfig

    headers = Path(sysconfig.get_path("include"))
    locked = sys.implementation.name == "cpython" and not sysconfig.get_config_var(
        "Py_GIL_DISABLED"
    )
    if not (locked and (headers / "Python.h").is_file()):
        return None
    flags = ("-I", str(headers), *LINKING)
    try:
        library = ctypes.PyDLL(str(compile_library([SOURCE], SOURCE.parent, flags=flags)))
    except (SerpentailError, OSError):  # ctypes serves, and needs nothing more
        return None
    made = library.serpentail_call
    made.restype = ctypes.py_object
    pointer, thing = ctypes.c_void_p, ctypes.py_object
    made.argtypes = (pointer, pointer, thing, ctypes.c_ssize_t, thing)
    return library
