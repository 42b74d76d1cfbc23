"""Sends the points of a sweep in blocks, and takes notice of their rows."""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import NotWritten, SweepError
from ...basics.progress import Stage
from .axes import Axes
from .blocks import Gate, Missing, Pace
from .bundles import Bundle, model_of
from .executors import Place, place_of
from .job import Job
from .runs import run_points
from .store import Store
from .supervision import Block, Ran, ShardFolder, ran, run_block

AHEAD = 2  # blocks a worker, so that none waits
TRIES = 4  # of a block whose worker is gone
LOOK_S = 0.2  # s between looks at the executor
SOON_S = 0.01  # s after which another task may pass
HERE_S = 3.0  # s of work of flights that is not worth other processes


class Work(NamedTuple):
    """Points of a group, and how often they were sent in vain."""

    group: "Group"
    numbers: np.ndarray
    tries: int = 0


@dataclass
class Group:
    """Points of one model that are still to be run."""

    bundle: Bundle | None
    missing: Missing
    pace: Pace = field(default_factory=Pace)

    def take(self, workers: int) -> np.ndarray:
        """Return the numbers of the points of the next block."""
        return self.missing.take(self.pace.block(self.missing.left, workers))


@dataclass
class Spent:
    """What a sweep took: elapsed seconds, seconds of all workers, blocks, points, workers; and how
    many points hung.
    """

    wall_s: float = 0.0
    busy_s: float = 0.0
    blocks: int = 0
    points: int = 0
    workers: int = 1
    hung: int = 0


@dataclass
class Driver:
    """Runs groups of points, whose rows come into the store."""

    store: Store
    axes: Axes
    job: Job
    groups: Sequence[Group]
    limit: float | None
    script: str | None
    name: str
    spent: Spent = field(default_factory=Spent)

    def __post_init__(self) -> None:
        self.done, self.failed = int(self.store.done.sum()), self.store.failed
        self.place: ShardFolder | None = self.store.place

    def drive(self, executor: Any) -> None:
        """Run all points; NotWritten if rows cannot be written, SweepError if no worker is left."""
        begun = time.perf_counter()
        with Stage("sweep", self.name) as stage:
            self._tell(stage)
            if executor is None and self.limit is None:
                self._here(stage)
            if any(group.missing.left for group in self.groups):
                with place_of(executor) as place:
                    self._elsewhere(place, stage)
        self.spent.wall_s = time.perf_counter() - begun

    # ---- in this process -------------------------------------------------------------------------

    def _here(self, stage: Stage) -> None:
        """Run flights in this process for as long as others would take to begin."""
        begun = time.perf_counter()
        for group in self.groups if self.job.run == "simulate" else ():
            model = model_of(group.bundle, self.job)
            while group.missing.left and time.perf_counter() - begun < HERE_S:
                numbers = group.take(1)
                parts = run_points(self.job, model, self.axes.at(numbers))
                told = [each for part in parts for each in part]
                self._keep(group, numbers, ran(numbers, told, self.place))
                self._tell(stage)

    # ---- in others -------------------------------------------------------------------------------

    def _elsewhere(self, place: Place, stage: Stage) -> None:
        """Keep all workers at work until no point is left."""
        waiting: dict[Future, Work] = {}
        ready: SimpleQueue[Future] = SimpleQueue()
        lost: deque[Work] = deque()
        job, blocks = self.job.pickled(), self._blocks()
        gate, looked = Gate(time.perf_counter()), -LOOK_S
        try:
            while True:
                now = time.perf_counter()
                if now - looked > LOOK_S:
                    looked = now
                    with _reached():
                        self.spent.workers = place.workers()
                    if not place.alive():
                        raise SweepError(GONE)
                    self._tell(stage)
                full = self._send(place, job, (waiting, ready), (lost, blocks), gate)
                if not waiting and not full:
                    self._tell(stage)
                    return
                for future in _ended(ready, SOON_S if full == "gate" else LOOK_S):
                    work = waiting.pop(future)
                    ran = self._result(future, work.tries, place)
                    if ran is None:
                        lost.append(work._replace(tries=work.tries + 1))
                    else:
                        self._keep(work.group, work.numbers, ran)
        finally:
            for future in waiting:
                future.cancel()

    def _send(self, place: Place, job: bytes, sent: tuple, rest: tuple, gate: Gate) -> str:
        """Send blocks; return what holds up more of them, "" if none is left."""
        (waiting, ready), (lost, blocks) = sent, rest
        while len(waiting) < AHEAD * self.spent.workers:
            if not gate.passes(time.perf_counter()):
                return "gate"
            work = lost.popleft() if lost else next(blocks, None)
            if work is None:
                return ""
            with _reached():
                future = place.submit(run_block, self._block(work, job))
            waiting[future] = work
            future.add_done_callback(ready.put)
        return "workers"

    def _blocks(self) -> Iterator[Work]:
        """Yield points of the groups in turn."""
        while True:
            left = [group for group in self.groups if group.missing.left]
            if not left:
                return
            for group in left:
                yield Work(group, group.take(self.spent.workers))

    def _block(self, work: Work, job: bytes) -> Block:
        """Return points as they travel."""
        axes, places = self.axes.part(work.numbers)
        together = self.job.run == "simulate"
        given = (job, self.script, work.group.bundle, axes, places, work.numbers)
        return Block(*given, self.limit, together, self.place)

    def _result(self, future: Future, tries: int, place: Place) -> Ran | None:
        """Return the results of a block; None if it is to be sent again."""
        try:
            return future.result()
        except NotWritten:
            raise
        except (Exception, CancelledError) as reason:  # whatever an executor loses work by
            if tries + 1 >= TRIES or not place.alive():
                raise _gone(reason) from reason
            return None

    # ---- rows ------------------------------------------------------------------------------------

    def _keep(self, group: Group, numbers: np.ndarray, ran: Ran) -> None:
        """Take notice of the rows of a block."""
        if ran.refused is not None:
            raise SweepError(f"run: no process can run it: {ran.refused}")
        if ran.shard is not None:
            self.store.accept(ran.shard)
            self.done += ran.shard.size
            self.failed += ran.shard.failed
        group.pace.learn(len(numbers), ran.seconds)
        self.spent.points += len(numbers) - ran.hung
        self.spent.hung += ran.hung
        self.spent.blocks += 1
        self.spent.busy_s += ran.seconds

    def _tell(self, stage: Stage) -> None:
        failed = f", {self.failed} failed" if self.failed else ""
        total = len(self.axes)
        stage.tell(self.done / total, f"{self.name}: {self.done} of {total}{failed}")


GONE = (
    "executor: its workers are gone: finished rows are kept, and the same call resumes from there"
)


def _gone(reason: BaseException) -> SweepError:
    words = " ".join(str(reason).split())
    return SweepError(f"{GONE} ({type(reason).__name__}: {words:.300})")


@contextmanager
def _reached() -> Iterator[None]:
    """Ask an executor; what it raises, whatever that is, tells that it is gone."""
    try:
        yield
    except Exception as reason:
        raise _gone(reason) from reason


def _ended(ready: SimpleQueue, patience: float) -> Iterator[Future]:
    """Yield the futures that have ended, after some seconds at the latest."""
    with suppress(Empty):
        yield ready.get(timeout=patience)
        while True:
            yield ready.get_nowait()
