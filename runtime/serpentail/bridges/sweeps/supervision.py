"""Runs blocks of points in processes of their own, survives crashes of these, and writes shards."""

import atexit
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import SweepError
from ...compiling.commands import inherited
from ...compiling.threads import VARIABLE
from .axes import Axes, Point
from .bundles import Bundle
from .runs import Told
from .shards import Row, Shard

TRIES = 2  # of a point whose process ends: something else may have ended it
TOGETHER = 2048  # points that a process gets at once: it holds the motions of flights of them
HANGS = 10  # limits on the clock in which a point hangs if it takes less processor time than
LEAST = 0.1  # limits


@dataclass(frozen=True)
class ShardFolder:
    """Where workers write shards: a sweep's folder, and a file that tells its store from others.

    A worker that does not find this very store returns the rows to the driver.
    """

    folder: Path
    marked: Path
    mark: bytes

    def is_here(self) -> bool:
        """Tell if this process sees the store."""
        try:
            return self.marked.read_bytes() == self.mark
        except OSError:
            return False


@dataclass(frozen=True)
class Block:
    """Points of one model that are sent as one task.

    job: pickled; script: the driver's main program, None if the job needs none of its names;
    axes, places: what makes the points; numbers: of their rows; limit: seconds of processor time
    that a point may take, None: no limit; together: whether points may be run side by side, with
    all results at once; store: None: the rows are returned.
    """

    job: bytes
    script: str | None
    bundle: Bundle | None
    axes: Axes
    places: np.ndarray
    numbers: np.ndarray
    limit: float | None
    together: bool
    store: ShardFolder | None


class Ran(NamedTuple):
    """What came of a block: a shard or None, points that hung, why none could be run; seconds."""

    shard: Shard | None
    hung: int = 0
    refused: str | None = None
    seconds: float = 0.0


class Child:
    """A process that runs points."""

    def __init__(self) -> None:
        here, there = Pipe()
        environment = inherited(**{VARIABLE: "1"})  # its siblings use the other cores
        command = [sys.executable, "-m", "serpentail.bridges.sweeps.child", str(there.fileno())]
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # it inherits that
        try:
            self.process = subprocess.Popen(command, env=environment, pass_fds=[there.fileno()])
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        there.close()
        self.link: Connection[Any, Any] = here

    def used(self) -> float:
        """Return the processor time that it took (s); OSError if it is gone."""
        return time.clock_gettime((~self.process.pid << 3) | 2)  # Linux's clock of a process

    def end(self) -> int:
        """End the process in any case; return its status."""
        self.process.kill()
        self.link.close()
        return self.process.wait()


_idle: list[Child] = []
_all: set[Child] = set()
_lock = threading.Lock()
importing = threading.Event()  # in a worker process, while it imports the driver's main program
_ending = threading.Event()  # while all are ended, and no new one is to begin


def run_block(block: Block) -> Ran:
    """Run a block, and write its shard; NotWritten if it cannot be written."""
    told: list[Told] = []
    for first in range(0, len(block.places), TOGETHER):
        points = block.axes.at(block.places[first : first + TOGETHER])
        found = _run_all(block, points)
        if isinstance(found, str):
            return Ran(None, refused=found)
        told += found
    return ran(block.numbers, told, block.store)


def ran(numbers: np.ndarray, told: list[Told], store: ShardFolder | None) -> Ran:
    """Return the results of points as a shard, which is written if its store is here."""
    seconds = sum(each.seconds for each in told)
    rows = [
        Row(number, each.outcome, each.error, each.seconds)
        for number, each in zip(numbers.tolist(), told, strict=True)
        if each.outcome is not None or each.error is not None
    ]
    shard = Shard.of(rows) if rows else None
    if shard and store and store.is_here():
        shard = shard.written(store.folder)
    return Ran(shard, len(told) - len(rows), None, seconds)


def _run_all(block: Block, points: list[Point]) -> list[Told] | str:
    """Run points; each gets a result, whatever happens to the process that runs it.

    A point fails if it takes more processor time than the limit, or if the process ends twice while
    it runs. If it hangs, its result has neither an outcome nor an error. A text tells why no
    process can run them.
    """
    told: dict[int, Told] = {}
    ended: dict[int, int] = {}
    apart = False
    while len(told) < len(points):
        left = [k for k in range(len(points)) if k not in told]
        places = left[:1] if apart else left
        child = _taken()
        found = _run(child, block, {k: points[k] for k in places})
        told |= {each.place: each for each in found.told}
        if isinstance(found.trouble, str) or found.trouble is None:
            _give_back(child)
            if found.trouble:
                return found.trouble
            continue
        # the process is gone, or has to go: the point that it was at is to blame, if it was alone
        status = _drop(child)
        at = next(k for k in places if k not in told)
        if block.together and not apart and len(places) > 1 and not found.told:
            apart = True
            continue
        ended[at] = ended.get(at, 0) + 1
        if found.trouble is HANGING:
            told[at] = Told(at, None, None, found.seconds)
        elif status == -signal.SIGPROF or ended[at] >= TRIES:
            told[at] = Told(at, None, _why(status, block.limit), found.seconds)
    return [told[k] for k in sorted(told)]


HANGING, GONE = object(), object()


class Found(NamedTuple):
    """What a process sent; trouble: None, HANGING, GONE, or a refusal in words."""

    told: list[Told]
    trouble: Any
    seconds: float


def _run(child: Child, block: Block, points: dict[int, Point]) -> Found:
    """Let a process run points by their places."""
    told: list[Told] = []
    begun, places = time.perf_counter(), list(points)
    limit = block.limit or 0.0  # of one point
    first = limit * len(points) if block.together else limit  # of what is told first
    patience = None  # s until the next word
    try:
        task = (block.script, block.job, block.bundle, list(points.values()), first, limit)
        child.link.send(task)
        while True:
            used = child.used()
            while patience and not child.link.poll(patience):
                before, used = used, child.used()
                if used - before < LEAST * limit:
                    return Found(told, HANGING, time.perf_counter() - begun)
            kind, content = child.link.recv()
            if kind == "refused":
                return Found(told, content, 0.0)
            if kind == "end":
                return Found(told, None, 0.0)
            if kind == "told":
                told += [each._replace(place=places[each.place]) for each in content]
            begun = time.perf_counter()
            patience = HANGS * (first if kind == "ready" else limit)
    except (EOFError, OSError):
        return Found(told, GONE, time.perf_counter() - begun)


def _why(status: int, limit: float | None) -> str:
    if status == -signal.SIGPROF:
        return f"TimeLimit: took more than {limit:g} s of processor time"
    how = f"signal {-status}" if status < 0 else f"status {status}"
    return f"ProcessEnded: the process that ran it ended with {how}, {TRIES} times"


def _taken() -> Child:
    if _ending.is_set():
        raise SweepError("the sweep is ended")
    with _lock:
        while _idle:
            child = _idle.pop()
            if child.process.poll() is None:
                return child
            _all.discard(child)
            child.end()
    child = Child()
    with _lock:
        _all.add(child)
    return child


def _give_back(child: Child) -> None:
    with _lock:
        _idle.append(child)


def _drop(child: Child) -> int:
    with _lock:
        _all.discard(child)
    return child.end()


def end_all() -> None:
    """End all processes that this one started to run points."""
    with _lock:
        children = list(_all)
        _all.clear()
        _idle.clear()
    for child in children:
        child.process.kill()
        child.process.wait()


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


def _forget() -> None:
    """Leave the parent's resources to the parent in a forked process."""
    global _lock  # noqa: PLW0603 - another thread of the parent may hold it
    _lock = threading.Lock()
    _all.clear()
    _idle.clear()


atexit.register(end_all)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
