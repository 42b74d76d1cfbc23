"""Times one function of a model beside peers, each compiled by every compiler; the faster one
counts.
"""

from collections.abc import Mapping
from types import MappingProxyType

from benchmarks.fixtures import Fixture
from benchmarks.peers import timing

By = Mapping[str, timing.Closure]  # one peer's closures, by the compiler that made them


def compared(
    ours: Fixture,
    peers: Mapping[str, By],
    states: timing.States,
    rounds: int = 200,
    calls: int = 128,
    again: Mapping[str, Fixture] = MappingProxyType({}),
) -> dict:
    """Time all closures together, in interleaved rounds; the last is ours compiled by clang."""
    peers = {**peers, "clang": {by: each.closure for by, each in again.items()}}
    there = [(name, by, closure) for name, made in peers.items() for by, closure in made.items()]
    closures = [ours.closure, *(closure for *_, closure in there)]
    times = timing.time_rounds(closures, states, rounds, calls)
    return faster(times[0], [(*key[:2], *time) for key, time in zip(there, times[1:], strict=True)])


def faster(own: tuple[float, float], found: list[tuple[str, str, float, float]]) -> dict:
    """Return a row: our (minimum, median), and for each peer the faster compiler's result and its
    name.

    found: peer, compiler, minimum, median. Ratios by minima (by medians in brackets).
    """
    row: dict = {"ns": own[0], "median_ns": own[1]}
    for name in dict.fromkeys(name for name, *_ in found):
        times = sorted((least, median, by) for n, by, least, median in found if n == name)
        (least, median, by), others = times[0], times[1:]
        row[f"{name}_ns"] = least
        row[f"{name}_ratio"] = f"{least / own[0]:.2f}x ({median / own[1]:.2f}x)"
        row[f"{name}_by"] = ", ".join(
            [by, *(f"{o} {ns / least:.2f}x of it" for ns, _, o in others)]
        )
    return row
