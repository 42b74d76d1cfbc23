"""Microseconds of one call: in C, for the caller in Python, and the part of that outside C."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.hessians import multiplied
from benchmarks.models import DFD, FD, HESSIAN, built, label, timed_function
from benchmarks.timing import best, random_states, time_rounds

PER_PROCESSOR = True
SIZES = ((1, 3), (3, 4))
ROUNDS, CALLS = 100, 64


def measured(folder: Path) -> list[dict]:
    """Return a row for each function and tail."""
    rows = []
    for size in SIZES:
        model, states = built(*size, functions=[FD, DFD, HESSIAN]), random_states(size[0])
        for name in (FD, DFD, HESSIAN):
            given = multiplied(states) if name == HESSIAN else states
            ours = timed_function(model, folder, name)
            inside = time_rounds([ours.closure], given, ROUNDS, CALLS)[0] / 1e3
            q, v, rest = (x[0] for x in given)
            arguments = (q, v, *(np.split(rest, 2) if name == HESSIAN else (rest,)))
            whole = call_us(getattr(model, name), arguments)
            row = {"function": name, "model": label(*size), "in C, us": inside}
            rows.append(row | {"for the caller, us": whole, "outside C, us": whole - inside})
    return rows


def call_us(call: Callable, arguments: tuple, count: int = 100, repeats: int = 300) -> float:
    """Return the least microseconds of a call; repeats are short, so that some are undisturbed."""

    def calls() -> None:
        for _ in range(count):
            call(*arguments)

    return best(calls, repeats) / count / 1e3
