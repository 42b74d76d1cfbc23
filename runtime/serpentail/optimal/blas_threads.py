"""Keeps the linear algebra of CasADi's solvers to one thread while programs are solved.

The blocks of a plan's matrices are small: threads that share one wait for each other, and on busy
cores for long.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from ..compiling.threads import after_fork


@cache
def _blas() -> ctypes.CDLL | None:
    """Return the BLAS that CasADi's solvers use; None if it is an unknown one."""
    import casadi as ca

    for path in sorted(Path(ca.__file__).parent.glob("libcasadi-tp-openblas.*")):
        try:
            return ctypes.CDLL(str(path))
        except OSError:
            continue
    return None


class _Solves:
    """Number of programs being solved in all threads, and the BLAS threads before the first.

    A forked child solves none: it begins at zero.
    """

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        self.lock, self.count, self.before = threading.Lock(), 0, 0

    def begin(self, blas: ctypes.CDLL) -> None:
        with self.lock:
            if self.count == 0:
                self.before = blas.openblas_get_num_threads()
                blas.openblas_set_num_threads(1)
            self.count += 1

    def end(self, blas: ctypes.CDLL) -> None:
        with self.lock:
            self.count -= 1
            if self.count == 0:
                blas.openblas_set_num_threads(self.before)


_solves = _Solves()
after_fork(_solves.begin_anew)


@contextmanager
def one_thread() -> Iterator[None]:
    """Have CasADi's BLAS use one thread, and as many as before after the last one's end."""
    blas = _blas()
    if blas is None:
        yield
        return
    _solves.begin(blas)
    try:
        yield
    finally:
        _solves.end(blas)
