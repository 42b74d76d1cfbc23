"""Keeps the linear algebra of CasADi's solvers to one thread while a program is solved.

The blocks of a plan's matrices are small: threads that share one wait for each other, and on busy
cores for long.
"""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path


@cache
def _blas() -> ctypes.CDLL | None:
    """The BLAS that CasADi brings for its solvers; None where it brings another, or none."""
    import casadi as ca

    for path in sorted(Path(ca.__file__).parent.glob("libcasadi-tp-openblas.*")):
        try:
            return ctypes.CDLL(str(path))
        except OSError:
            continue
    return None


@contextmanager
def one_thread() -> Iterator[None]:
    """Have CasADi's BLAS use one thread, and as many as before afterwards."""
    blas = _blas()
    if blas is None:
        yield
        return
    before = blas.openblas_get_num_threads()
    blas.openblas_set_num_threads(1)
    try:
        yield
    finally:
        blas.openblas_set_num_threads(before)
