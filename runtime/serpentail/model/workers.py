"""Threads that share the states of a batch, or take up runs one after another."""

import os
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise

POLL_S = 0.1  # s between looks at signals, such as Ctrl-C
MIN_STATES_PER_THREAD = 256  # states: the least that is worth a thread


@cache
def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def pool() -> ThreadPoolExecutor:
    """Return the threads that share batches; C runs in them without Python's lock."""
    return ThreadPoolExecutor(cores(), thread_name_prefix="serpentail")


def shared(count: int, run: Callable[[int, int], None]) -> None:
    """Call ``run(first, last)`` for shares of a batch, on all cores where it is large."""
    shares = max(1, min(cores(), count // MIN_STATES_PER_THREAD))
    ends = [count * k // shares for k in range(shares + 1)]
    if shares == 1:
        run(0, count)
        return
    waiting = [pool().submit(run, first, last) for first, last in pairwise(ends)]
    for future in waiting:
        future.result()


def in_turn(
    count: int, threads: int, work: Callable[[Iterator[int], threading.Event], None]
) -> None:
    """Call ``work(numbers, ended)`` in threads, which take the numbers below ``count`` in turn.

    The first error, Ctrl-C among them, sets ``ended`` and is raised when all threads have returned.
    """
    numbers, ended = deque(range(count)), threading.Event()
    if threads == 1:
        work(_taken(numbers), ended)
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="serpentail") as crew:
        try:
            waiting = {crew.submit(work, _taken(numbers), ended) for _ in range(threads)}
            while waiting:  # looks at signals now and then
                done, waiting = wait(waiting, POLL_S, FIRST_EXCEPTION)
                for future in done:
                    future.result()
        finally:
            numbers.clear()
            ended.set()


def _taken(numbers: deque[int]) -> Iterator[int]:
    """Numbers that no other thread has taken."""
    while True:
        try:
            yield numbers.popleft()
        except IndexError:
            return
