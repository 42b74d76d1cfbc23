"""Runs blocks of points in processes of their own, and survives crashes and hangs of these.

Why not multiprocessing, concurrent.futures, loky or pebble: Dask's workers may not have children of
multiprocessing, on which all of these build, and it imports the main program into every worker.
"""

import atexit
import hashlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import SerpentailError, SweepError
from ...compiling.cache import cache_folder
from ...compiling.commands import inherited
from ...compiling.threads import VARIABLE, after_fork
from ...model.load import model_from
from ...model.manifest import CheckedFolder, snapshot
from ...model.model import Model
from .axis import as_json
from .points import Point, points_of
from .runs import run_points
from .store import Row

TRIES = 2  # of a point whose process ends: something else may have ended it
TOGETHER = 2048  # points that a process gets at once: it holds the motions of flights of them
HANGS = 10  # limits on the clock in which a point hangs if it takes less processor time than
LEAST = 0.1  # limits
COMMAND = "from serpentail.bridges.sweeps.processes import serve; serve({})"
MOST_MODELS = 64  # that a process keeps


class Bundle(NamedTuple):
    """A model as it is sent to workers: its folder, parameters and profile, and a hash of these."""

    identity: str
    content: bytes

    @classmethod
    def of(
        cls, checked: CheckedFolder, parameters: Mapping | None = None, profile: str | None = None
    ) -> "Bundle":
        """Return the bundle of a folder that was checked."""
        whole = CheckedFolder(checked.folder, checked.manifest, dict(checked.files))
        told = as_json([checked.manifest_hash, parameters, profile])
        content = zlib.compress(pickle.dumps((whole, parameters, profile)))
        return cls(hashlib.sha256(told.encode()).hexdigest(), content)


@lru_cache(MOST_MODELS)
def model_of(bundle: Bundle | None) -> Model | None:
    """Return the model of a bundle, compiled if this machine has not yet done so."""
    if bundle is None:
        return None
    checked, parameters, profile = pickle.loads(zlib.decompress(bundle.content))
    checked = replace(checked, folder=snapshot(checked, cache_folder()))
    return model_from(checked, parameters, profile=profile)


@dataclass(frozen=True)
class BlockSettings:
    """What all blocks of a sweep have in common.

    job: pickled; limit: seconds of processor time that a point may take, None: no limit; together:
    whether points may be run side by side, with all results at once.
    """

    job: bytes
    limit: float | None
    together: bool


class Block(NamedTuple):
    """Points of one model: columns: their values by names; numbers: of their rows."""

    settings: BlockSettings
    bundle: Bundle | None
    columns: dict[str, list]
    numbers: np.ndarray


def run_block(block: Block) -> list[Row] | str:
    """Return the rows of a block but of points that hang, or why no process can run it.

    The reason is no exception, because Dask would print that.
    """
    points = list(zip(block.numbers.tolist(), points_of(block.columns), strict=True))
    try:
        parts = (dict(points[k : k + TOGETHER]) for k in range(0, len(points), TOGETHER))
        return [row for part in parts for row in _rows(block, part)]
    except SweepError as reason:
        return str(reason)


def _rows(block: Block, left: dict[int, Point]) -> Iterator[Row]:
    """Yield the rows of points, whatever happens to the process that runs them.

    A point fails if it takes more processor time than the limit, or if the process ends twice while
    it runs. If it hangs, it has no row.
    """
    ends: Counter[int] = Counter()
    one_by_one = False
    while left:
        points = {k: left[k] for k in list(left)[:1]} if one_by_one else dict(left)
        process, begun = _idle.pop() if _idle else Process(), time.perf_counter()
        try:
            for rows in process.run(block, points):
                for row in rows:
                    del left[row.number]
                    yield row
                begun = time.perf_counter()
            continue
        except (EOFError, OSError) as reason:
            hangs, status = isinstance(reason, TimeoutError), process.end()
        # it was at the first point that is left, unless it ran all at once
        if block.settings.together and 1 < len(points) == len(left):
            one_by_one = True
            continue
        number = next(iter(left))
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
    """A process that runs points, see ``serve``."""

    def __init__(self) -> None:
        if _ending.is_set():
            raise SweepError("the sweep is ended")
        here, there = Pipe()
        self.child = subprocess.Popen(
            [sys.executable, "-c", COMMAND.format(there.fileno())],
            env=inherited(**{VARIABLE: "1"}),  # its siblings use the other cores
            stdin=subprocess.DEVNULL,
            pass_fds=[there.fileno()],
            process_group=0,  # Ctrl-C is the driver's to answer
        )
        there.close()
        self.link: Connection[Any, Any] = here
        _all.add(self)

    def run(self, block: Block, points: dict[int, Point]) -> Iterator[list[Row]]:
        """Yield rows of points as they come; then it is idle.

        TimeoutError if a point hangs, EOFError or OSError if the process ends, SweepError if it
        cannot run them.
        """
        settings = block.settings
        limit = settings.limit or 0.0  # of one point
        first_limit = limit * len(points) if settings.together else limit  # of what comes first
        self.link.send((settings.job, block.bundle, points, first_limit, limit))
        patience = None  # s until the next answer; any until it has made the model
        while (answer := self._answer(patience, LEAST * limit)) is not None:
            if isinstance(answer, str):
                _idle.append(self)
                raise SweepError(f"run: no process can run it: {answer}")
            yield answer
            patience = HANGS * (limit if answer else first_limit) or None
        _idle.append(self)

    def _answer(self, patience: float | None, least: float) -> Any:
        """Return an answer; TimeoutError if the process takes too little time in its patience."""
        clock = (~self.child.pid << 3) | 2  # Linux's of its processor time
        used = time.clock_gettime(clock)
        while not self.link.poll(patience):
            before, used = used, time.clock_gettime(clock)
            if used - before < least:
                raise TimeoutError
        return self.link.recv()

    def end(self) -> int:
        """End the process in any case; return its status."""
        _all.discard(self)
        self.child.kill()
        self.link.close()
        return self.child.wait()


_idle: list[Process] = []
_all: set[Process] = set()
_ending = threading.Event()  # while all are ended, and no new one is to begin
after_fork(_idle.clear)  # they are the parent's
after_fork(_all.clear)


@atexit.register
def end_all() -> None:
    """End all processes that this one started to run points."""
    _idle.clear()
    while _all:
        process = _all.pop()
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


# In such a process.


_job = lru_cache(1)(pickle.loads)  # one after another: tasks of a sweep have the same


def serve(descriptor: int) -> None:
    """Run points that come through a socket, until it is closed.

    The answers to a task are [] once it begins, then lists of rows, at last None; or a text that
    tells why this process cannot run it. The system ends the process by SIGPROF once a point has
    taken more processor time than its limit.
    """
    os.dup2(2, 1)  # output of functions must not mix with reports
    link: Connection = Connection(descriptor)
    tasks: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(link, tasks), daemon=True).start()
    while True:
        content, bundle, points, first_limit, limit = tasks.get()
        try:
            job = _job(content)
            model = model_of(bundle)
        except (SerpentailError, ImportError, AttributeError, OSError) as reason:
            link.send(f"{reason}")
            continue
        link.send([])
        signal.setitimer(signal.ITIMER_PROF, first_limit)
        for rows in run_points(job, model, points):
            signal.setitimer(signal.ITIMER_PROF, limit)
            link.send(rows)
        signal.setitimer(signal.ITIMER_PROF, 0)
        link.send(None)


def _listen(link: Connection, tasks: queue.SimpleQueue) -> None:
    """Receive tasks; end the process when the parent is gone."""
    try:
        while True:
            tasks.put(link.recv())
    except (EOFError, OSError):
        os._exit(1)
