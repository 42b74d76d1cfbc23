"""Nanoseconds a state on one core in C: one by one, and in batches as users get them.

Batches have 1000 states or more. Last column: for the caller in Python, on all cores. All check
that arguments and results are finite. A function without batches is evaluated one by one.
"""

import ctypes
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import serpentail as st
from benchmarks.models import DFD, FD, HESSIAN, built, label
from benchmarks.timing import best, best_of
from serpentail.model.kernel import argument_record
from serpentail.model.library import MIN_BATCH
from serpentail.model.memory import aligned
from serpentail_scene.signatures.table import AIRBORNE

PER_PROCESSOR = True
PROCESSES = 3
STATES, ROUNDS = 512, 100  # a batch that stays in the cache
MANY = 20  # factor: that many more in a call from Python
SIZES = {
    FD: ((1, 3), (2, 3), (3, 4), (6, 6), (8, 16), (3, None)),
    DFD: ((1, 3), (3, 4)),
    HESSIAN: ((1, 3), (3, 4)),
    **dict.fromkeys(AIRBORNE, ((1, 3), (3, 2), (6, 2), (2, None))),
}


def measured(folder: Path) -> list[dict]:
    """Return a row for each function and tail."""
    return [row(name, size) for name, sizes in SIZES.items() for size in sizes]


def row(name: str, size: tuple) -> dict:
    """Return the times of one function of one tail."""
    model = built(*size, functions=[name])
    single, batch = ns_a_state(model, name, random_inputs(model, name, STATES))
    many = random_inputs(model, name, MANY * STATES)
    kernel = model.kernels[name]
    kernel(*many)  # compiles, starts threads
    whole = best(lambda: kernel(*many), 5) / len(many[0])
    found = {"function": name, "model": label(*size), "one by one, ns": single}
    found |= {"side by side, ns": batch, "ratio": single / batch}
    return found | {"for the caller, all cores, ns": whole}


def random_inputs(model: st.Model, name: str, count: int) -> tuple[np.ndarray, ...]:
    """Return all inputs of a function, for a number of states."""
    rng, shapes = np.random.default_rng(1), model.kernels[name].shapes
    return tuple(0.5 * rng.normal(size=(count, *shape)) for shape in shapes)


def ns_a_state(model: st.Model, name: str, inputs: Sequence[np.ndarray]) -> tuple[float, float]:
    """Return nanoseconds a state of both C functions of one function, in interleaved rounds;
    without batches, the same time twice.
    """
    kernel, alive, calls, count = model.kernels[name], [], [], len(inputs[0])
    states = [x.astype(kernel.dtype) for x in inputs]
    out = [np.empty((count, *shape), kernel.dtype) for shape in kernel.out_shapes]
    ways = [(kernel.function, kernel.work)]
    if (batch := kernel.batch_library.entry(name, MIN_BATCH)) is not None:
        ways.append((batch, kernel.batch_library.work[name]))
    for function, size in ways:
        alive.append(aligned(size, kernel.dtype))
        record = argument_record(kernel.parameters, count, alive[-1], (*states, *out))
        calls.append(lambda function=function, record=record: function(ctypes.addressof(record)))
    if failed := [call() for call in calls if call()]:
        raise RuntimeError(f"{name}: status {failed[0]} at a random state")
    times = [ns / count for ns in best_of(calls, ROUNDS)]
    return times[0], times[-1]
