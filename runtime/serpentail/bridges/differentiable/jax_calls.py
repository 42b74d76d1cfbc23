"""Calls of a model's C from XLA: compiles the code that XLA calls, and registers functions."""

import ctypes
import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jax.ffi
import numpy as np

from ...basics.errors import CompileFailed
from ...compiling.compiler import compile_library, opened
from ...compiling.threads import MIN_STATES_PER_THREAD, threads
from ...model.library import MIN_BATCH
from ...model.memory import address_of
from ...model.model import Model

SOURCE = Path(__file__).with_name("native") / "jax_calls.cc"
TARGET = "serpentail_call"
LIBRARIES = ("-Wl,--no-as-needed,-lstdc++", "-pthread")
alive: dict[str, Any] = {}  # what registered functions point to, by their names


class XlaFunction(ctypes.Structure):
    """A function of a model, as the C++ code knows it."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("single", "many", "parameters")),
        *((name, ctypes.c_size_t) for name in ("single_work", "many_work", "states")),
        *((name, ctypes.c_size_t) for name in ("bytes", "least", "threads")),
    )


@cache
def library() -> ctypes.CDLL:
    """Return the code that XLA calls, compiled once for a compiler and a version of JAX."""
    version = f'-DJAX_VERSION="{jax.__version__}"'
    flags = ("-std=c++17", "-I", jax.ffi.include_dir(), version, *LIBRARIES)
    try:
        code = opened(lambda: compile_library([SOURCE], SOURCE.parent, flags=flags))
    except CompileFailed as error:
        raise CompileFailed(
            f"jax_functions: a C++17 compiler is needed beside that of C, such as g++: {error}"
        ) from error
    code.serpentail_enter.argtypes = (ctypes.c_char_p, ctypes.c_void_p)
    code.serpentail_enter.restype = None
    capsule = jax.ffi.pycapsule(getattr(code, TARGET))
    jax.ffi.register_ffi_target(TARGET, capsule, platform="cpu")
    return code


def registered(model: Model, function: str) -> str:
    """Return the name under which XLA calls a function of a model; compiles its batches."""
    kernel, parameters = model.kernel(function), np.array(model.parameter_vector)
    digest = hashlib.sha256(parameters.tobytes()).hexdigest()[:16]
    name = f"{model.name}/{model.checked.manifest_hash}/{model.profile}/{digest}/{function}"
    if name in alive:
        return name
    batches, size = model.batch_library, parameters.itemsize
    many = batches.entry(function, MIN_BATCH)
    entry = XlaFunction(
        single=ctypes.cast(kernel.function, ctypes.c_void_p),
        many=many and ctypes.cast(many, ctypes.c_void_p),  # type: ignore[arg-type]
        parameters=address_of(parameters),
        single_work=kernel.work * size,
        many_work=batches.work.get(function, 0) * size,
        states=batches.states,
        bytes=size,
        least=MIN_STATES_PER_THREAD,
        threads=threads(batches.threads),
    )
    library().serpentail_enter(name.encode(), ctypes.byref(entry))
    alive[name] = model.library, many, parameters
    return name
