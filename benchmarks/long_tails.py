"""Times dynamics and their Jacobians of long tails: many links, many segments."""

if __name__ == "__main__":
    from benchmarks import alone

    alone.main("long_tails", __doc__)

from pathlib import Path

from benchmarks.batches import DFD, FD
from benchmarks.fixtures import built, fixture, label
from benchmarks.peers import timing

SIZES = ((1, 512), (16, 4))
ROUNDS, CALLS = 30, 8


def long_times(folder: Path) -> list[dict]:
    """Nanoseconds of one call from C of v_dot and of its Jacobians."""
    rows = []
    for size in SIZES:
        model, states = built(*size, functions=[FD, DFD]), timing.random_states(size[0])
        ours = {name: fixture(model, folder, name) for name in (FD, DFD)}
        times = timing.time_rounds([o.closure for o in ours.values()], states, ROUNDS, CALLS)
        row = {"model": label(*size), "v_dot_ns": times[0][0], "jacobians_ns": times[1][0]}
        rows.append(row | {"emission": model.manifest["functions"][DFD]["emission"]})
    return rows
