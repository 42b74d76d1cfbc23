"""Calls of compiled functions through a small C extension, where this Python takes one."""

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numpy import ndarray

from ..basics.errors import SerpentailError
from ..compiling.compiler import compile_library, opened

SOURCE = Path(__file__).with_name("native") / "calls.c"
# for linkers that ask for every symbol of an extension
LINKING = ("-Wl,-undefined,dynamic_lookup",) if sys.platform == "darwin" else ()
Call = Callable[..., Any]  # takes arguments, returns outputs, or None where it does not serve


def fast_call(
    function: Any, record: int, inputs: list[ndarray], outputs: list[ndarray], owner: object
) -> Call:
    """Return a fast call of a generated C function on one state; without the extension, none.

    record: the address of one that points to the arrays. The call keeps its owner alive.
    """
    library = extension()
    if library is None:
        return no_call
    code, arrays = ctypes.cast(function, ctypes.c_void_p), (*inputs, *outputs)
    return library.serpentail_call(code, record, arrays, len(inputs), owner)


def no_call(*_: Any) -> None:
    """Serve no arguments: ctypes makes all calls."""


@cache
def extension() -> ctypes.PyDLL | None:
    """Return the extension, compiled once for a compiler and a Python.

    None if Python is another one than CPython with its lock, its headers are missing, or nothing
    can be compiled: ctypes needs none of that.
    """
    import sysconfig

    headers = Path(sysconfig.get_path("include"))
    has_lock = not sysconfig.get_config_var("Py_GIL_DISABLED")
    if sys.implementation.name != "cpython" or not has_lock or not (headers / "Python.h").is_file():
        return None
    flags = ("-I", str(headers), *LINKING)
    try:
        library = opened(
            lambda: compile_library([SOURCE], SOURCE.parent, flags=flags), ctypes.PyDLL
        )
    except (SerpentailError, OSError):
        return None
    make = library.serpentail_call
    make.restype = ctypes.py_object
    pointer, thing = ctypes.c_void_p, ctypes.py_object
    make.argtypes = (pointer, pointer, thing, ctypes.c_ssize_t, thing)
    return library
