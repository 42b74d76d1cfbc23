"""Runs blocks of points in processes of their own, survives crashes of these, and writes shards.

Why not multiprocessing or concurrent.futures: Dask's workers may not have children of
multiprocessing; both import the main program into every worker, also where only functions of
modules are run; and where a worker ends, ProcessPoolExecutor loses all rows of its block, and does
not tell at which point it was.
"""

import atexit
import signal
import subprocess
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import SweepError
from ...compiling.commands import inherited
from ...compiling.threads import VARIABLE
from .points import Axes, Point
from .shards import Row, Shard, ShardFolder
from .worker import Bundle

TRIES = 2  # of a point whose process ends: something else may have ended it
TOGETHER = 2048  # points that a process gets at once: it holds the motions of flights of them
HANGS = 10  # limits on the clock in which a point hangs if it takes less processor time than
LEAST = 0.1  # limits
COMMAND = "from serpentail.bridges.sweeps.worker import main; main({})"


@dataclass(frozen=True)
class BlockSettings:
    """What all blocks of a sweep have in common.

    job: pickled; script: the driver's main program, None if the job needs none of its names; limit:
    seconds of processor time that a point may take, None: no limit; together: whether points may
    be run side by side, with all results at once; store: None: the rows are returned.
    """

    job: bytes
    script: str | None
    limit: float | None
    together: bool
    store: ShardFolder | None


class Block(NamedTuple):
    """Points of one model: axes, places: what makes the points; numbers: of their rows."""

    settings: BlockSettings
    bundle: Bundle | None
    axes: Axes
    places: np.ndarray
    numbers: np.ndarray


class Result(NamedTuple):
    """What came of a block: a shard, None if it has no row; seconds of its rows; points that hung.

    The shard is written if the worker sees its store. refusal: why no process can run the points;
    it is no exception, because Dask would print that.
    """

    shard: Shard | None = None
    seconds: float = 0.0
    hung: int = 0
    refusal: str = ""

    @classmethod
    def of(cls, rows: list[Row], points: int, store: ShardFolder | None) -> "Result":
        """Return the rows of so many points."""
        shard = Shard.of(rows) if rows else None
        if shard and store and store.is_here():
            shard = shard.written(store.folder)
        return cls(shard, sum(row.seconds for row in rows), points - len(rows))


def run_block(block: Block) -> Result:
    """Run a block, and write its shard; NotWritten if it cannot be written."""
    rows: list[Row] = []
    for first in range(0, len(block.places), TOGETHER):
        part = slice(first, first + TOGETHER)
        points = zip(block.numbers[part].tolist(), block.axes.at(block.places[part]), strict=True)
        try:
            rows += _rows(block, dict(points))
        except SweepError as reason:
            return Result(refusal=str(reason))
    return Result.of(rows, len(block.numbers), block.settings.store)


def _rows(block: Block, left: dict[int, Point]) -> Iterator[Row]:
    """Yield the rows of points, whatever happens to the process that runs them.

    A point fails if it takes more processor time than the limit, or if the process ends twice while
    it runs. If it hangs, it has no row.
    """
    ends: Counter[int] = Counter()
    one_by_one = False
    while left:
        points = {k: left[k] for k in list(left)[:1]} if one_by_one else dict(left)
        process, begun = _process(), time.perf_counter()
        try:
            for rows in process.run(block, points):
                for row in rows:
                    del left[row.number]
                    yield row
                begun = time.perf_counter()
            _idle.append(process)
            continue
        except (EOFError, OSError) as reason:
            hangs, status = isinstance(reason, TimeoutError), process.end()
        # it was at the first point that is left, unless it ran all at once
        number = next(iter(left))
        if block.settings.together and len(points) > 1 and len(points) == len(left):
            one_by_one = True
            continue
        ends[number] += 1
        if hangs or status == -signal.SIGPROF or ends[number] >= TRIES:
            del left[number]
            if not hangs:
                error = _error_text(status, block.settings.limit)
                yield Row(number, None, error, time.perf_counter() - begun)


def _error_text(status: int, limit: float | None) -> str:
    if status == -signal.SIGPROF:
        return f"TimeLimit: took more than {limit:g} s of processor time"
    how = f"signal {-status}" if status < 0 else f"status {status}"
    return f"ProcessEnded: the process that ran it ended with {how}, {TRIES} times"


class Process:
    """A process that runs points, see ``worker``."""

    def __init__(self) -> None:
        here, there = Pipe()
        environment = inherited(**{VARIABLE: "1"})  # its siblings use the other cores
        command = [sys.executable, "-c", COMMAND.format(there.fileno())]
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # it inherits that
        try:
            self.child = subprocess.Popen(command, env=environment, pass_fds=[there.fileno()])
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        there.close()
        self.link: Connection[Any, Any] = here
        _all.add(self)

    def run(self, block: Block, points: dict[int, Point]) -> Iterator[list[Row]]:
        """Yield rows of points as they come.

        TimeoutError if a point hangs, EOFError or OSError if the process ends, SweepError if it
        cannot run them.
        """
        settings = block.settings
        limit = settings.limit or 0.0  # of one point
        first_limit = limit * len(points) if settings.together else limit  # of what comes first
        self.link.send((settings.script, settings.job, block.bundle, points, first_limit, limit))
        patience = 0.0  # s until the next answer; none until it has made the model
        while True:
            used = self._processor_time()
            while patience and not self.link.poll(patience):
                before, used = used, self._processor_time()
                if used - before < LEAST * limit:
                    raise TimeoutError
            answer = self.link.recv()
            if isinstance(answer, str):
                _idle.append(self)
                raise SweepError(f"run: no process can run it: {answer}")
            if answer is None:
                return
            yield answer
            patience = HANGS * (limit if answer else first_limit)

    def _processor_time(self) -> float:
        """Return the processor time that it took (s); OSError if it is gone."""
        return time.clock_gettime((~self.child.pid << 3) | 2)  # Linux's clock of a process

    def end(self) -> int:
        """End the process in any case; return its status."""
        _all.discard(self)
        self.child.kill()
        self.link.close()
        return self.child.wait()


# Those of a process that was forked find in its copy of these only processes that are not its own:
# they seem to have ended, and are left to the parent.
_idle: deque[Process] = deque()
_all: set[Process] = set()
_ending = threading.Event()  # while all are ended, and no new one is to begin


def _process() -> Process:
    """Return a process that has nothing to do."""
    if _ending.is_set():
        raise SweepError("the sweep is ended")
    with suppress(IndexError):
        while True:
            process = _idle.pop()
            if process.child.poll() is None:
                return process
            process.end()
    return Process()


@atexit.register
def end_all() -> None:
    """End all processes that this one started to run points."""
    _idle.clear()
    for process in list(_all):
        _all.discard(process)
        process.child.kill()
        process.child.wait()


@contextmanager
def ending() -> Iterator[None]:
    """End all processes, and let none begin meanwhile."""
    _ending.set()
    end_all()
    try:
        yield
    finally:
        end_all()
        _ending.clear()
