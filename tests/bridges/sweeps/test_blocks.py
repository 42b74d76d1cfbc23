"""The size of blocks: long enough for one scheduler, short enough that all workers end together."""

from serpentail.bridges.sweeps.driver import block_size
from tests.support.rows import row


def test_blocks_have_a_second_or_more_and_share_what_is_left():
    for (pace, largest, left, workers), wanted in {
        (0.0, 0, 9999, 4): 1,
        (0.01, 1, 9999, 4): 8,  # grows
        (0.01, 1000, 9999, 4): 100,  # a second
        (0.01, 1000, 30, 4): 25,  # of the end: a quarter of a second, and not all for one worker
        (0.01, 1000, 10**6, 300): 1000,  # 10 s
        (0.01, 10**5, 10**10, 10**5): 6000,  # a minute
        (1e-9, 10**5, 10**9, 4): 50_000,
        (300.0, 1, 9, 4): 1,
    }.items():
        with row((pace, largest, left, workers)):
            assert block_size(pace, largest, left, workers) == wanted


def test_a_thousand_workers_need_few_blocks():
    """Of a million points of 0.1 s: one scheduler of Dask does about 220 a second."""
    left, blocks = 10**6, 0
    while left:
        left -= block_size(0.1, 10**5, left, 1000)
        blocks += 1
    assert blocks < 100 * 10**6 * 0.1 / 1000
