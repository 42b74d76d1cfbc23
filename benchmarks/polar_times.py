"""Nanoseconds of one forward dynamics call of a continuum from C, in bend and in polar coordinates.

Rounds are interleaved; operations are those of one call.
"""

from pathlib import Path

import numpy as np

from benchmarks.models import timed_function
from benchmarks.polar_errors import COLOURS, form
from benchmarks.timing import random_states, time_rounds

ROUNDS, CALLS = 200, 256


def measured(folder: Path) -> list[dict]:
    """Return a row for each number of segments."""
    rows = []
    for m in (1, 3):
        pair = {name: timed_function(form(name, m), folder) for name in COLOURS}
        states = random_states(m)
        # polar: theta; bend: b, which does not affect its run time
        states.q[:, 8::2] = np.abs(states.q[:, 8::2]) + 0.5
        times = time_rounds([each.closure for each in pair.values()], states, ROUNDS, CALLS)
        row = {"segments": m} | dict(zip((f"{name}, ns" for name in pair), times, strict=True))
        row["ratio"] = times[1] / times[0]
        for name, each in pair.items():
            entry = each.model.manifest["functions"]["forward_dynamics"]
            row[f"operations, {name}"] = entry["operations"]
        rows.append(row)
    return rows
