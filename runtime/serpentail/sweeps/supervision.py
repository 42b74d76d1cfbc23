"""Runs blocks of points in processes of their own, and outlives what happens to these."""

import atexit
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from ..errors import SweepError
from ..model.cores import VARIABLE
from .bundles import Bundle
from .points import Point
from .runs import Told

TRIES = 2  # of a point whose process ends: something else may have ended it


@dataclass(frozen=True)
class Block:
    """Points of one model that are sent as one task.

    job: pickled; script: the driver's main program, None where the job needs none of its names;
    limit: seconds that a point may take, None: no limit; together: whether points may be run side
    by side, and told of all at once.
    """

    job: bytes
    script: str | None
    bundle: Bundle | None
    points: Sequence[Point]
    limit: float | None
    together: bool


class Ran(NamedTuple):
    """What came of a block: of its points, or why none could be run; seconds of work."""

    told: list[Told]
    refused: str | None
    seconds: float


class Child:
    """A process that runs points."""

    def __init__(self) -> None:
        here, there = Pipe()
        paths = [path or os.getcwd() for path in sys.path]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(dict.fromkeys(paths))}
        environment |= {VARIABLE: "1"}  # its siblings use the other cores
        command = [sys.executable, "-m", "serpentail.sweeps.child", str(there.fileno())]
        self.process = subprocess.Popen(command, env=environment, pass_fds=[there.fileno()])
        there.close()
        self.link: Connection[Any, Any] = here

    def end(self) -> int:
        """End the process, whatever it does; return its status."""
        self.process.kill()
        self.link.close()
        return self.process.wait()


_idle: list[Child] = []
_all: set[Child] = set()
_lock = threading.Lock()
_ending = threading.Event()  # while all are ended, and no new one is to begin


def run_block(block: Block) -> Ran:
    """Run a block: each of its points is told of, whatever becomes of the process that runs it.

    A point that takes longer than the limit fails; so does one in which the process ends twice.
    """
    told: dict[int, Told] = {}
    ended: dict[int, int] = {}
    begun, apart = time.perf_counter(), False
    while len(told) < len(block.points):
        left = [k for k in range(len(block.points)) if k not in told]
        places = left[:1] if apart else left
        child = _taken()
        found = _run(child, block, places)
        told |= {each.place: each for each in found.told}
        if isinstance(found.trouble, str):
            _give_back(child)
            return Ran([], found.trouble, 0.0)
        if found.trouble is None:
            _give_back(child)
            continue
        # the process is gone, or has to go: the point that it was at is to blame, if it was alone
        status = _drop(child)
        at = next(k for k in places if k not in told)
        if block.together and not apart and len(places) > 1 and not found.told:
            apart = True
            continue
        ended[at] = ended.get(at, 0) + 1
        if found.trouble is TOO_LONG or ended[at] >= TRIES:
            told[at] = Told(at, None, _why(found.trouble, status, block.limit), found.seconds)
    return Ran([told[k] for k in sorted(told)], None, time.perf_counter() - begun)


TOO_LONG, GONE = object(), object()


class Found(NamedTuple):
    """What a process told; trouble: None, TOO_LONG, GONE, or a refusal in words."""

    told: list[Told]
    trouble: Any
    seconds: float


def _run(child: Child, block: Block, places: list[int]) -> Found:
    """Let a process run some points of a block."""
    told: list[Told] = []
    begun, limit = time.perf_counter(), None
    try:
        points = [block.points[k] for k in places]
        child.link.send((block.script, block.job, block.bundle, points))
        while True:
            if limit is not None and not child.link.poll(limit):
                return Found(told, TOO_LONG, time.perf_counter() - begun)
            kind, content = child.link.recv()
            if kind == "refused":
                return Found(told, content, 0.0)
            if kind == "end":
                return Found(told, None, 0.0)
            if kind == "told":
                told += [each._replace(place=places[each.place]) for each in content]
            begun = time.perf_counter()
            limit = _limit(block, len(places)) if kind == "ready" else block.limit
    except (EOFError, OSError):
        return Found(told, GONE, time.perf_counter() - begun)


def _limit(block: Block, count: int) -> float | None:
    """Return how long the first word of some points may take."""
    if block.limit is None:
        return None
    return block.limit * count if block.together else block.limit


def _why(trouble: Any, status: int, limit: float | None) -> str:
    if trouble is TOO_LONG:
        return f"TimeLimit: took longer than {limit:g} s"
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
    """Leave to the parent of a forked process what is the parent's."""
    global _lock  # noqa: PLW0603 - another thread of the parent may hold it
    _lock = threading.Lock()
    _all.clear()
    _idle.clear()


atexit.register(end_all)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
