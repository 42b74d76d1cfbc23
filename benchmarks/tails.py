"""Nanoseconds of forward dynamics of a continuum beside three links a segment."""

from pathlib import Path

from benchmarks.models import built, timed_function
from benchmarks.timing import random_states, time_rounds

ROUNDS, CALLS = 200, 256


def measured(folder: Path) -> list[dict]:
    """Return a row for each number of segments."""
    rows = []
    for m in (1, 3, 6):
        pair = [timed_function(built(m, links), folder) for links in (None, 3)]
        closures = [each.closure for each in pair]
        arcs, links = time_rounds(closures, random_states(m), ROUNDS, CALLS)
        row = {"segments": m, "continuum, ns": arcs, "articulated (m, 3), ns": links}
        rows.append(row | {"ratio": arcs / links})
    return rows
