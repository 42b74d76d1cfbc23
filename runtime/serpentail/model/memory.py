"""Memory of arrays that the C reads and writes.

The system gives fresh memory to a process page by page: for large results that takes longer than
computing them. So the memory of a result that nobody sees any more is kept for later ones.
"""

import ctypes
import math
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import DTypeLike

from ..basics.checks import refusal
from ..basics.errors import StateError

Out = ndarray | Sequence[ndarray] | None  # what receives the outputs of a function
CACHE_LINE = 64  # bytes, and the widest vector
# bytes of a result that is kept: smaller ones are quickly had, larger ones would fill the memory
LEAST_KEPT, MOST_KEPT = 2**16, 2**24
MOST_RESULTS = 8  # that are kept, of all models
_unseen: deque[ndarray] = deque(maxlen=MOST_RESULTS)  # the oldest first; its methods are atomic


class Seen:
    """Memory of a result: all arrays that show it hold this, and the last one gives it back."""

    def __init__(self, memory: ndarray):
        self.memory, self.__array_interface__ = memory, memory.__array_interface__

    def __del__(self, keep: Callable[[ndarray], None] = _unseen.append) -> None:
        keep(self.memory)  # a default, because at Python's end the module may be gone


def fresh(size: int) -> ndarray:
    """Return so many bytes, uninitialised: those of an earlier result that is gone, or new ones.

    Other threads may ask or give back meanwhile: what one has taken out no other one sees.
    """
    if not LEAST_KEPT <= size <= MOST_KEPT:
        return np.empty(size, np.uint8)
    with suppress(IndexError):  # other threads have taken the rest
        for _ in range(len(_unseen)):
            memory = _unseen.popleft()
            if len(memory) == size:
                return np.asarray(Seen(memory))
            _unseen.append(memory)
    return np.asarray(Seen(np.empty(size, np.uint8)))


def address_of(array: ndarray) -> int:
    """Return the address of an array's numbers; ``array.ctypes.data`` is three times as slow."""
    if array.flags.carray and array.size:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))  # type: ignore[arg-type]
    return array.ctypes.data


def aligned_rows(shape: tuple[int, ...], dtype: DTypeLike) -> ndarray:
    """Return an uninitialised array that begins at a cache line.

    Storing vectors takes half the time if none of them crosses a cache line.
    """
    size = math.prod(shape) * np.dtype(dtype).itemsize
    memory = fresh(size + CACHE_LINE)
    first = -address_of(memory) % CACHE_LINE
    return memory[first : first + size].view(dtype).reshape(shape)


def aligned(count: int, dtype: DTypeLike) -> ndarray:
    """Return a workspace of zeros that begins at a cache line; it is never empty."""
    workspace = aligned_rows((count + 1,), dtype)
    workspace.fill(0)
    return workspace


def writeable(field: str, value: Any, shape: tuple[int, ...], dtype: DTypeLike) -> ndarray:
    """Return an array of the caller's that the C can write to; StateError if it cannot."""
    alike = isinstance(value, ndarray) and (value.dtype, value.shape) == (dtype, shape)
    if alike and value.flags.carray:
        return value
    needs = f"a writeable C array of {np.dtype(dtype)} of shape {shape}"
    raise refusal(field, value, needs, StateError)


def received(
    field: str,
    out: Any,
    shapes: Sequence[tuple[int, ...]],
    dtype: DTypeLike,
    apart: Sequence[ndarray],
) -> list[ndarray]:
    """Return the arrays that receive outputs of these shapes; StateError if one cannot.

    out: an array for a single output, else a sequence of arrays, none of which may share memory
    with another one or with those of ``apart``, which are read meanwhile.
    """
    many = len(shapes) > 1
    if many and (not isinstance(out, Sequence) or len(out) != len(shapes)):
        raise refusal(field, out, f"a sequence of {len(shapes)} arrays", StateError)
    arrays: list[ndarray] = []
    for k, shape in enumerate(shapes):
        place = f"{field}[{k}]" if many else field
        array = writeable(place, out[k] if many else out, shape, dtype)
        if any(np.may_share_memory(array, other) for other in (*apart, *arrays)):
            needs = "memory that no argument and no other output has"
            raise refusal(place, array, needs, StateError)
        arrays.append(array)
    return arrays


def filled(field: str, out: Any, found: Any) -> Any:
    """Return the arrays of ``out``, filled with results that were found; these if it is none."""
    if out is None:
        return found
    results = found if isinstance(found, tuple) else (found,)
    arrays = received(field, out, [a.shape for a in results], results[0].dtype, ())
    for array, result in zip(arrays, results, strict=True):
        array[...] = result
    return tuple(arrays) if isinstance(found, tuple) else arrays[0]
