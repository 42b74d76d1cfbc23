"""Batches: generated folders go in, nanoseconds a state of batched calls beside single ones come out."""

import ctypes
import time
from pathlib import Path

import numpy as np

import serpentail as st
from fixtures import generated, label
from serpentail.library import aligned, call_record
from serpentail.side_by_side import MANY

STATES, ROUNDS = 512, 300  # a batch that stays in the cache
SIZES = ((1, 3), (2, 3), (3, 4), (6, 6), (3, None))


def batch_times(folder: Path) -> list[dict]:
    """Nanoseconds a state of one core: forward dynamics one by one, and side by side; and from Python, all cores.

    Both check that arguments and results are finite. Target: side by side 6x faster (AVX-512).
    """
    rows = []
    for size in SIZES:
        model = st.load(generated(folder / "speed", *size))
        states = random_states(model, STATES)
        alone, together = c_times(model, states)
        many = random_states(model, 100 * STATES)
        whole = best(lambda model=model, many=many: model.forward_dynamics(*many), 7) / len(many[0])
        row = {"model": label(*size), "one by one, ns": alone, "side by side, ns": together}
        rows.append(row | {"ratio": alone / together, "from Python, all cores, ns": whole})
    return rows


def random_states(model, count: int) -> tuple[np.ndarray, ...]:
    """Return q, v and tau."""
    rng = np.random.default_rng(1)
    return tuple(0.5 * rng.normal(size=(count, size)) for size in (model.nq, model.nv, model.nv - 6))


def c_times(model, states) -> tuple[float, float]:
    """Return nanoseconds a state of both C functions, rounds interleaved."""
    kernel = model.kernels["forward_dynamics"]
    out, keep, calls = np.empty((STATES, model.nv)), [], []
    for function, size in ((kernel.function, kernel.work), (kernel.many.entry(kernel.name, MANY), None)):
        keep.append(aligned(size or kernel.many.work[kernel.name], float))
        record = call_record(kernel.parameters, STATES, keep[-1], (*states, out))
        calls.append(lambda function=function, record=record: function(ctypes.addressof(record)))
    times = [[best(call, 1) for call in calls] for _ in range(ROUNDS)]
    return tuple(np.min(times, axis=0) / STATES)


def best(call, repeats: int) -> float:
    """Return the least nanoseconds of one call."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter_ns()
        call()
        times.append(time.perf_counter_ns() - begun)
    return min(times)
