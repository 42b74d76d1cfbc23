"""Threads that share the states of a batch, or take up runs one after another.

A forked child has none of its parent's threads: it starts its own, and its locks are open.
"""

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise

from .cores import threads as allowed

POLL_S = 0.1  # s between checks for signals, such as Ctrl-C
MIN_STATES_PER_THREAD = 256  # states: the least that is worth a thread
# states between checks for signals, at first and at least, relative to those worth a thread
FIRST_PIECE, LEAST_PIECE = 8, 1 / 4
PIECE_S = 0.05  # s between checks: pieces grow or shrink to this


def after_fork(renew: Callable[[], object]) -> None:
    """Have every forked child call a function first."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=renew)


@cache
def pool(size: int) -> ThreadPoolExecutor:
    """Return the threads that share batches; C runs in them without Python's lock."""
    return ThreadPoolExecutor(size, thread_name_prefix="serpentail")


after_fork(pool.cache_clear)


def shared(
    count: int,
    threads: int | None,
    run: Callable[[int, int], None],
    least: int = MIN_STATES_PER_THREAD,
) -> None:
    """Call ``run(first, last)`` for pieces of a batch, in several threads if it is large.

    threads: their largest number, None for as many as this process may use. least: states that are
    worth a thread. If states fail, the first one raises the error. Ctrl-C ends the work after the
    pieces that are running.
    """
    if count < 2 * least:
        run(0, count)
        return
    most, ended = allowed(threads), threading.Event()
    shares = min(most, count // least)
    if shares == 1:
        _in_pieces(run, (0, count), least, ended)
        return
    ends = [count * k // shares for k in range(shares + 1)]
    waiting = [pool(most).submit(_in_pieces, run, part, least, ended) for part in pairwise(ends)]
    try:
        for future in waiting:
            future.result()
    finally:
        ended.set()
        wait(waiting)


def _in_pieces(
    run: Callable[[int, int], None], part: tuple[int, int], least: int, ended: threading.Event
) -> None:
    """Call ``run`` for pieces that take a moment each, until ``ended`` is set."""
    first, last, size = *part, FIRST_PIECE * least
    while first < last and not ended.is_set():
        begun, after = time.perf_counter(), min(first + size, last)
        run(first, after)
        first = after
        quick = time.perf_counter() - begun < PIECE_S
        size = 2 * size if quick else max(size // 2, int(LEAST_PIECE * least), 1)


def in_turn(
    count: int,
    threads: int,
    work: Callable[[Iterator[int], threading.Event], None],
    tick: Callable[[], object] = lambda: None,
) -> None:
    """Call ``work(numbers, ended)`` in threads, which take the numbers below ``count`` in turn.

    The first error, Ctrl-C among them, sets ``ended`` and is raised when all threads have returned.
    tick: called now and then, in this thread.
    """
    numbers, ended = deque(range(count)), threading.Event()
    if threads == 1:
        work(_taken(numbers, tick), ended)
        tick()
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="serpentail") as crew:
        try:
            waiting = {crew.submit(work, _taken(numbers), ended) for _ in range(threads)}
            while waiting:  # checks for signals now and then
                done, waiting = wait(waiting, POLL_S, FIRST_EXCEPTION)
                for future in done:
                    future.result()
                tick()
        finally:
            numbers.clear()
            ended.set()


def _taken(numbers: deque[int], tick: Callable[[], object] = lambda: None) -> Iterator[int]:
    """Numbers that no other thread has taken."""
    while True:
        tick()
        try:
            yield numbers.popleft()
        except IndexError:
            return
