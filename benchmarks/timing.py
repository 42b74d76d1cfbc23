"""Times C functions in interleaved rounds, on the same random states."""

import ctypes
import functools
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from benchmarks.peers.build import build_library

TIMER = Path(__file__).with_name("timer.c")


class Closure(NamedTuple):
    """Addresses of an `int f(void *context, q, v, rest, out)` of doubles and of its context."""

    function: int
    context: int | None = None


class States(NamedTuple):
    """Rows of q (count, nq), v (count, nv), and of all other inputs one after the other."""

    q: np.ndarray
    v: np.ndarray
    rest: np.ndarray


class Timed(Protocol):
    """What the timer can call; it keeps the memory of its closure alive."""

    @property
    def closure(self) -> Closure:
        """What the timer calls."""


def compared(
    ours: Timed,
    peers: Mapping[str, Mapping[str, Timed]],
    states: States,
    rounds: int = 200,
    calls: int = 128,
) -> dict:
    """Return a row: least ns of a call of ours and of each peer, all in the same rounds; how many
    times as long each peer takes; and by which compiler, of which the faster one counts.

    peers: by name and compiler.
    """
    there = [(name, by, each) for name, made in peers.items() for by, each in made.items()]
    closures = [ours.closure, *(each.closure for *_, each in there)]
    least, *others = time_rounds(closures, states, rounds, calls)
    row: dict = {"ns": least}
    for peer in peers:
        times = sorted(
            (ns, by) for (name, by, _), ns in zip(there, others, strict=True) if name == peer
        )
        if times:
            ns, by = times[0]
            row |= {f"{peer}, ns": ns, f"{peer}, ratio": ns / least, f"{peer}, by": by}
    return row


def time_rounds(
    closures: Sequence[Closure], states: States, rounds: int, calls: int
) -> list[float]:
    """Return the least ns a call of each closure, over rounds A B C, A B C, ..."""
    arrays = States(*(np.ascontiguousarray(x, dtype=float) for x in states))
    times = np.empty(len(closures))
    failures = timer().time_rounds(
        len(closures),
        (_Closure * len(closures))(*(tuple(closure) for closure in closures)),
        ctypes.byref(_States(len(arrays.q), *(x.shape[1] for x in arrays), *map(pointer, arrays))),
        rounds,
        calls,
        pointer(times),
    )
    if failures:
        raise RuntimeError(f"{failures} calls reported a failure")
    return times.tolist()


def random_states(segments: int, count: int = 64, seed: int = 0) -> States:
    """Return q, v, tau of tumbling torsos with moderately bent tails, the same ones each time."""
    rng = np.random.default_rng([seed, segments])
    q = rng.uniform(-1, 1, (count, 7 + 2 * segments))
    q[:, 3:7] = rng.normal(size=(count, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    v = rng.uniform(-10, 10, (count, 6 + 2 * segments))
    return States(q, v, rng.uniform(-1e-3, 1e-3, (count, 2 * segments)))


def best(call: Callable[[], object], repeats: int) -> float:
    """Return the least nanoseconds of one call."""
    return best_of([call], repeats)[0]


def best_of(calls: Sequence[Callable[[], object]], repeats: int) -> list[float]:
    """Return the least nanoseconds of each call, all of them in each round."""
    times = np.empty((repeats, len(calls)))
    for row in times:
        for k, call in enumerate(calls):
            begun = time.perf_counter_ns()
            call()
            row[k] = time.perf_counter_ns() - begun
    return times.min(axis=0).tolist()


class _Closure(ctypes.Structure):
    """`struct closure` of timer.c."""

    _fields_ = (("function", ctypes.c_void_p), ("context", ctypes.c_void_p))


class _States(ctypes.Structure):
    """`struct states` of timer.c."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("count", "nq", "nv", "n_rest")),
        *((name, ctypes.c_void_p) for name in States._fields),
    )


@functools.cache
def timer() -> ctypes.CDLL:
    """Return timer.c, compiled and declared."""
    library = ctypes.CDLL(str(build_library(TIMER)))
    library.time_rounds.argtypes = [
        *(ctypes.c_int, ctypes.POINTER(_Closure), ctypes.POINTER(_States)),
        *(ctypes.c_int, ctypes.c_int, ctypes.c_void_p),
    ]
    return library


def pointer(array: np.ndarray) -> int:
    """Return the address of a contiguous array's first element; the caller keeps the array."""
    return array.ctypes.data
