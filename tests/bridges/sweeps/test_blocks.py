"""The size of blocks: a simulated scheduler keeps a thousand workers busy with them."""

import heapq

import numpy as np
import pytest

from serpentail.bridges.sweeps.blocks import Gate, Pace
from serpentail.bridges.sweeps.driver import AHEAD
from tests.support.rows import row

SCHEDULER = 220  # tasks/s that one scheduler of Dask bears
LATENCY = 0.05  # s of each message


def simulated(workers, points, pace, spread):
    """Return the busy part of the workers, and the sizes and times (s) of the blocks.

    The speeds of workers are log-normal, as are the times of points; a point takes pace seconds.
    """
    rng = np.random.default_rng(1)
    slowness = rng.lognormal(0, spread, workers)
    free_at = [(0.0, k) for k in range(workers)]  # of workers
    events = [(0.0, 0, 0.0)]  # when, points, seconds of a block that came back
    gate, sent_at, rule = Gate(0.0), 0.0, Pace()
    left, waiting, blocks = points, 0, []
    while events:
        now, size, seconds = heapq.heappop(events)
        if size:
            waiting -= 1
            rule.learn(size, seconds)
        while left and waiting < AHEAD * workers and gate.passes(now):
            size = rule.block(left, workers)
            left, waiting, sent_at = left - size, waiting + 1, max(sent_at, now) + 1 / SCHEDULER
            ready, worker = heapq.heappop(free_at)
            seconds = pace * size * slowness[worker] * rng.lognormal(0, 0.3 / size**0.5)
            end = max(ready, sent_at + LATENCY) + seconds
            heapq.heappush(free_at, (end, worker))
            heapq.heappush(events, (end + LATENCY, size, seconds))
            blocks.append((now, size, seconds))
        if left and not size:
            heapq.heappush(events, (now + 0.02, 0, 0.0))
    when, sizes, busy = np.array(blocks).T
    assert sizes.sum() == points
    return busy.sum() / workers / max(free_at)[0], when, busy


@pytest.mark.parametrize("spread", [0.3, 0.5])
def test_a_thousand_workers_are_busy_and_one_scheduler_bears_their_tasks(spread):
    for points, pace in ((3_000_000, 0.1), (200_000, 5.0), (30_000_000, 0.01)):
        busy, when, seconds = simulated(1000, points, pace, spread)
        with row(pace):
            assert busy > 0.9
            assert np.bincount(when.astype(int)).max() < SCHEDULER
            assert len(when) / when[-1] < 150 and seconds.max() < 150


def test_blocks_of_few_workers_have_a_second_and_no_block_is_too_long():
    for (pace, largest, left, workers), wanted in {
        (0.01, 0, 9999, 4): 1,
        (0.01, 1, 9999, 4): 8,  # grows
        (0.01, 1000, 9999, 4): 100,  # a second
        (0.01, 1000, 9999, 400): 100,  # of the end: a quarter of 4 s
        (0.01, 1000, 10**6, 400): 400,  # 4 s
        (0.01, 10**5, 10**10, 10**5): 6000,  # a minute
        (1e-9, 10**5, 10**9, 4): 50_000,
        (300.0, 1, 9, 4): 1,
    }.items():
        with row((pace, largest, left, workers)):
            assert Pace(pace * largest, largest, largest).block(left, workers) == wanted
