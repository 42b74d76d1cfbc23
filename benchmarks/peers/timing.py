"""Times closures of C functions in interleaved rounds, on the same random states."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .build import CACHE, build_library

TIMER_SOURCE = Path(__file__).resolve().parents[1] / "native" / "timer.c"


class Closure(NamedTuple):
    """Addresses of an `int f(void *context, q, v, tau, v_dot)` of doubles and of its context."""

    function: int
    context: int | None = None


class States(NamedTuple):
    """Rows of q (count, 7 + 2m), v (count, 6 + 2m) and tau (count, 2m)."""

    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray


def time_rounds(
    closures: Sequence[Closure], states: States, rounds: int, calls: int
) -> list[tuple[float, float]]:
    """(minimum, median) over the rounds of the ns per call of each closure, in rounds A B C, A B C,
    ...
    """
    arrays = States(*(np.ascontiguousarray(x, dtype=float) for x in states))
    count = len(arrays.q)
    if not closures or min(rounds, calls, count) < 1 or any(len(x) != count for x in arrays):
        raise ValueError(
            "closures, rounds, calls and states: one at least, and as many q as v and tau"
        )
    both = np.empty((2, len(closures)))
    failures = timer().time_rounds(
        len(closures),
        (_Closure * len(closures))(*(tuple(closure) for closure in closures)),
        ctypes.byref(_States(count, *(x.shape[1] for x in arrays), *map(pointer, arrays))),
        rounds,
        calls,
        *map(pointer, both),
    )
    if failures:
        raise RuntimeError(
            "out of memory" if failures < 0 else f"{failures} calls reported a failure"
        )
    return [(float(least), float(median)) for least, median in both.T]


def random_states(segments: int, count: int = 64, seed: int = 0) -> States:
    """Return tumbling torsos with moderately bent tails; the same arguments give the same
    states.
    """
    rng = np.random.default_rng([seed, segments])
    q = rng.uniform(-1, 1, (count, 7 + 2 * segments))
    q[:, 3:7] = rng.normal(size=(count, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    v = rng.uniform(-10, 10, (count, 6 + 2 * segments))
    return States(q, v, rng.uniform(-1e-3, 1e-3, (count, 2 * segments)))


class _Closure(ctypes.Structure):
    """`struct closure` of timer.c."""

    _fields_ = (("function", ctypes.c_void_p), ("context", ctypes.c_void_p))


class _States(ctypes.Structure):
    """`struct states` of timer.c."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("count", "nq", "nv", "n_tau")),
        *((name, ctypes.c_void_p) for name in States._fields),
    )


@functools.cache
def timer() -> ctypes.CDLL:
    """timer.c, compiled and declared."""
    library = ctypes.CDLL(str(build_library(TIMER_SOURCE, CACHE)))
    library.time_rounds.argtypes = [
        ctypes.c_int,
        ctypes.POINTER(_Closure),
        ctypes.POINTER(_States),
        *[ctypes.c_int] * 2,
        *[ctypes.c_void_p] * 2,
    ]
    return library


def pointer(array: np.ndarray) -> int:
    """Address of a contiguous array's first element; the caller keeps the array."""
    return array.ctypes.data
