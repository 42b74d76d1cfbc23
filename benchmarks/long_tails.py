"""Nanoseconds of one call from C of v_dot and of its Jacobians: long tails, and arcs."""

from pathlib import Path

from benchmarks.models import DFD, FD, built, label, timed_function
from benchmarks.timing import random_states, time_rounds

PER_PROCESSOR = True
SIZES = ((1, 512), (16, 4), (64, 8), (3, None), (64, None))
ROUNDS, CALLS = 30, 8


def measured(folder: Path) -> list[dict]:
    """Return a row for each tail."""
    rows = []
    for size in SIZES:
        model = built(*size, functions=[FD, DFD])
        ours = [timed_function(model, folder, name) for name in (FD, DFD)]
        states = random_states(size[0])
        v_dot, jacobians = time_rounds([each.closure for each in ours], states, ROUNDS, CALLS)
        row = {"model": label(*size), "v_dot, ns": v_dot, "Jacobians, ns": jacobians}
        rows.append(row | {"emission": model.manifest["functions"][DFD]["emission"]})
    return rows
