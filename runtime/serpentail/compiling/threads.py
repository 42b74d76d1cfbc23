"""Threads that share the states of a batch, or take up runs one after another, and how many.

A forked child has none of its parent's threads: it starts its own, and its locks are open.
"""

import math
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise
from operator import index
from pathlib import Path
from typing import SupportsIndex

from ..basics.checks import refusal
from ..basics.errors import SerpentailError

VARIABLE = "SERPENTAIL_THREADS"  # of the environment
MOST_THREADS = 1024  # larger numbers are mistakes
POLL_S = 0.1  # s between checks for signals, such as Ctrl-C
MIN_STATES_PER_THREAD = 256  # states: the least that is worth a thread
# states between checks for signals, at first and at least, relative to those worth a thread
FIRST_PIECE, LEAST_PIECE = 8, 1 / 4
PIECE_S = 0.05  # s between checks: pieces grow or shrink to this


# How many.


def threads(asked: int | None = None) -> int:
    """Return the number of threads: as asked, as in $SERPENTAIL_THREADS, else one for each core.

    By default a worker of a process pool (multiprocessing, concurrent.futures, joblib) uses one,
    because its siblings use the other cores. SerpentailError if $SERPENTAIL_THREADS is wrong.
    """
    if asked is not None:
        return asked
    chosen = os.environ.get(VARIABLE, "").strip()
    if chosen:
        return checked_threads(VARIABLE, int(chosen) if chosen.isdecimal() else chosen)
    multiprocessing = sys.modules.get("multiprocessing.process")
    is_worker = multiprocessing is not None and multiprocessing.parent_process() is not None
    return 1 if is_worker else cores()


def checked_threads(field: str, value: object, error: type[Exception] = SerpentailError) -> int:
    """Return a number of threads; the error names the field and what it needs."""
    whole = index(value) if isinstance(value, SupportsIndex) else 0
    if 1 <= whole <= MOST_THREADS and not isinstance(value, bool):
        return whole
    raise refusal(field, value, f"a whole number of threads from 1 to {MOST_THREADS}", error)


def cores() -> int:
    """Return how many cores this process may use: by its affinity, and by its container's quota."""
    affinity = hasattr(os, "sched_getaffinity")
    allowed = len(os.sched_getaffinity(0)) if affinity else os.cpu_count() or 1
    return math.ceil(min(allowed, _quota_here()))


@cache
def _quota_here() -> float:
    return quota(Path("/"))


def quota(root: Path) -> float:
    """Return the cores' worth of time that control groups grant this process; inf without a limit.

    root: of the file system, with proc/self and sys/fs/cgroup. The smallest limit counts, of the
    process's own group and of the groups around it.
    """
    least = math.inf
    for line in _text(root / "proc/self/cgroup").splitlines():
        number, controllers, group = line.split(":", 2)
        if number == "0" and not controllers:  # version 2
            mounts = ("", "unified")
        elif "cpu" in controllers.split(","):
            mounts = ("cpu", controllers)
        else:
            continue
        # in a container the path may be the host's: then the mount itself is the group
        for around in (group, *map(str, Path(group).parents)):
            for mount in mounts:
                folder = root / "sys/fs/cgroup" / mount / around.strip("/")
                least = min(least, _granted(folder))
    return least


def _granted(folder: Path) -> float:
    """Return the cores' worth of time of one group; inf without a limit.

    Quota, or "max" or -1, and period, in us: version 2 has one file of both, version 1 two.
    """
    files = ("cpu.max", "cpu.cfs_quota_us", "cpu.cfs_period_us")
    words = " ".join(_text(folder / name) for name in files).split()
    if len(words) == 2 and all(word.isdecimal() and int(word) for word in words):
        return int(words[0]) / int(words[1])
    return math.inf


def _text(path: Path) -> str:
    """Return the text of a file; none if it cannot be read."""
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""


# What they do.


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
    most: int | None,
    run: Callable[[int, int], None],
    least: int = MIN_STATES_PER_THREAD,
) -> None:
    """Call ``run(first, last)`` for pieces of a batch, in several threads if it is large.

    most: number of threads, None for as many as this process may use. least: states that are
    worth a thread. If states fail, the first one raises the error. Ctrl-C ends the work after the
    pieces that are running.
    """
    if count < 2 * least:
        run(0, count)
        return
    size, ended = threads(most), threading.Event()
    shares = min(size, count // least)
    if shares == 1:
        _in_pieces(run, (0, count), least, ended)
        return
    ends = [count * k // shares for k in range(shares + 1)]
    waiting = [pool(size).submit(_in_pieces, run, part, least, ended) for part in pairwise(ends)]
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
    size: int,
    work: Callable[[Iterator[int], threading.Event], None],
    tick: Callable[[], object] = lambda: None,
) -> None:
    """Call ``work(numbers, ended)`` in threads, which take the numbers below ``count`` in turn.

    size: number of threads. The first error, Ctrl-C among them, sets ``ended`` and is raised when
    all threads have returned. tick: called now and then, in this thread.
    """
    numbers, ended = deque(range(count)), threading.Event()
    if size == 1:
        work(_next_numbers(numbers, tick), ended)
        tick()
        return
    with ThreadPoolExecutor(size, thread_name_prefix="serpentail") as crew:
        try:
            waiting = {crew.submit(work, _next_numbers(numbers), ended) for _ in range(size)}
            while waiting:  # checks for signals now and then
                done, waiting = wait(waiting, POLL_S, FIRST_EXCEPTION)
                for future in done:
                    future.result()
                tick()
        finally:
            numbers.clear()
            ended.set()


def _next_numbers(numbers: deque[int], tick: Callable[[], object] = lambda: None) -> Iterator[int]:
    """Yield numbers that no other thread has taken."""
    while True:
        tick()
        try:
            yield numbers.popleft()
        except IndexError:
            return
