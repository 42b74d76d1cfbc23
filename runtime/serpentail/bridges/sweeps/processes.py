"""Runs blocks of points in processes of their own, and survives the end of these.

Why not multiprocessing, concurrent.futures, loky or pebble: Dask's workers may not have children of
multiprocessing, on which all of these build, and it imports the main program into every worker.
"""

import hashlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import NamedTuple

from ...basics.errors import SerpentailError, SweepError
from ...compiling.cache import cache_folder
from ...compiling.commands import inherited
from ...compiling.threads import VARIABLE, after_fork
from ...model.load import model_from
from ...model.manifest import CheckedFolder, snapshot
from ...model.model import Model
from .axis import as_json
from .points import Point
from .runs import TOGETHER, run_points
from .store import Row

TRIES = 2  # of a point whose process ends: something else may have ended it
HANGS = 30  # limits on the clock in which a point hangs: on a crowded machine it may still work
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


class Block(NamedTuple):
    """Points of one model, by the numbers of their rows.

    job: pickled; limit: seconds of processor time that a point may take, 0: no limit.
    """

    job: bytes
    limit: float
    bundle: Bundle | None
    points: dict[int, Point]


class Crew:
    """Processes that run points, each for one thread at a time."""

    def __init__(self) -> None:
        self.all: set[Process] = set()
        self.idle: list[Process] = []
        self.dismissed = False

    def run(self, block: Block, tries: int = TRIES) -> list[Row]:
        """Return the rows of a block but of points that hang; SweepError if none can run it.

        A point fails if it takes more processor time than the limit, or if it ends its process as
        often as it is tried.
        """
        begun = time.perf_counter()
        process = self.idle.pop() if self.idle else Process()
        self.all.add(process)
        if self.dismissed:  # while it was made
            process.child.kill()
        try:
            process.link.send(block)
            answer: list[Row] | str = process.link.recv()
            self.idle.append(process)
            if isinstance(answer, str):
                raise SweepError(f"run: no process can run it: {answer}")
            return answer
        except (EOFError, OSError):
            self.all.discard(process)
            status = process.end()
        if self.dismissed:
            return []
        if len(block.points) > 1:  # one by one, so that the point at fault shows
            alone = (block._replace(points={k: point}) for k, point in block.points.items())
            return [row for each in alone for row in self.run(each)]
        if status == -signal.SIGALRM:
            return []
        if tries > 1 and status != -signal.SIGPROF:
            return self.run(block, tries - 1)
        error = _error_text(status, block.limit)
        return [Row(number, None, error, time.perf_counter() - begun) for number in block.points]

    def dismiss(self) -> None:
        """End all processes; their threads return, and start no others."""
        self.dismissed = True
        for process in list(self.all):
            process.child.kill()
        while self.idle:
            self.idle.pop().end()


def _error_text(status: int, limit: float) -> str:
    if status == -signal.SIGPROF:
        return f"TimeLimit: took more than {limit:g} s of processor time"
    how = f"signal {-status}" if status < 0 else f"status {status}"
    return f"ProcessEnded: the process that ran it ended with {how}, {TRIES} times"


_here = Crew()  # of executors that run blocks in threads or processes of their own
after_fork(_here.idle.clear)  # they are the parent's


def run_block(block: Block) -> list[Row] | str:
    """Return the rows of a block where an executor has sent it, or why no process can run it.

    The reason is no exception, because Dask would print that.
    """
    try:
        return _here.run(block)
    except SweepError as reason:
        return str(reason)


class Process:
    """A process that runs points, see ``serve``."""

    def __init__(self) -> None:
        self.link, there = Pipe()
        self.child = subprocess.Popen(
            [sys.executable, "-c", COMMAND.format(there.fileno())],
            env=inherited(**{VARIABLE: "1"}),  # its siblings use the other cores
            stdin=subprocess.DEVNULL,
            pass_fds=[there.fileno()],
            process_group=0,  # Ctrl-C is the driver's to answer
        )
        there.close()

    def end(self) -> int:
        """End the process in any case; return its status."""
        self.child.kill()
        self.link.close()
        return self.child.wait()


# In such a process.


_job = lru_cache(1)(pickle.loads)  # one after another: tasks of a sweep have the same


def serve(descriptor: int) -> None:
    """Run points that come through a socket, until it is closed or the parent ends.

    The answer to a block is a list of rows, or a text that tells why it cannot be run. The system
    ends the process by SIGPROF once a point has taken more processor time than its limit, and by
    SIGALRM once it hangs.
    """
    os.dup2(2, 1)  # output of functions must not mix with reports
    link: Connection = Connection(descriptor)
    threading.Thread(target=_end_after, args=(os.getppid(),), daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            block: Block = link.recv()
            try:
                job, model = _job(block.job), model_of(block.bundle)
            except (SerpentailError, ImportError, AttributeError, OSError) as reason:
                link.send(f"{reason}")
                continue
            rows: list[Row] = []
            _allow(block.limit * (min(len(block.points), TOGETHER) if job.run == "simulate" else 1))
            for part in run_points(job, model, block.points):
                _allow(block.limit * len(part))  # for as many
                rows += part
            _allow(0.0)
            link.send(rows)


def _allow(seconds: float) -> None:
    """Let the next points take some processor time; 0: any."""
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, HANGS * seconds)


def _end_after(parent: int) -> None:
    """End this process when its parent has ended."""
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
