"""The stages in C, compiled once."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from ..basics.errors import CompilerNotFound, PlanningError
from ..compiling.compiler import compile_library, opened
from .problem import OcpInC, OcpRecord

NATIVE = Path(__file__).parent / "native"
FLAGS = ("-O3", "-ftree-vectorize", "-pthread")  # loops along rows of matrices; threads


@cache
def kernel() -> ctypes.CDLL:
    """Return the library; PlanningError if no compiler works."""
    import casadi as ca

    headers = Path(ca.__file__).parent / "include"
    version = f"-DCASADI_{''.join(c if c.isalnum() else '_' for c in ca.CasadiMeta.version())}"
    sources, flags = sorted(NATIVE.glob("*.c")), (*FLAGS, version, "-I", str(headers))
    try:
        made = opened(lambda: compile_library(sources, NATIVE, flags=flags))
    except CompilerNotFound as error:
        raise PlanningError(f"solver: {error}") from error
    pointer = ctypes.c_void_p
    made.program_new.restype = pointer
    made.program_new.argtypes = (ctypes.POINTER(OcpRecord),)
    for name in ("free", "variables", "rows", "help", "dismiss"):
        getattr(made, f"program_{name}").argtypes = (pointer,)
    for name in ("sizes", "guess", "nodes"):
        getattr(made, f"program_{name}").argtypes = (pointer, pointer)
    made.sparse_cost.restype = ctypes.c_double
    made.sparse_cost.argtypes = made.sparse_stages.argtypes = (pointer,)
    made.sparse_values.argtypes = made.sparse_slopes.argtypes = (pointer,) * 4
    made.sparse_limits.argtypes = made.sparse_multipliers.argtypes = (pointer,) * 3
    made.sparse_curve.argtypes = (pointer, pointer, ctypes.c_double, pointer, pointer)
    made.program_helpers.argtypes = (pointer, ctypes.c_int)
    made.fatrop_run.argtypes = (pointer, pointer, pointer, ctypes.c_int, *(pointer,) * 4)
    made.fatrop_run.restype = None
    return made


@contextmanager
def in_c(ocp: OcpInC) -> Iterator[int]:
    """Yield the address of a program of C."""
    code = kernel()
    program = code.program_new(ctypes.byref(ocp.record))
    if program is None:
        raise MemoryError("stages of a plan")
    try:
        yield program
    finally:
        code.program_free(program)
