"""Sends the points of a sweep in blocks, and takes notice of their rows."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import SerpentailError, SweepError
from ...basics.progress import Stage
from .blocks import Gate, Group
from .executors import Place, place_of
from .result import Sweep
from .runs import run_points
from .supervision import Block, BlockSettings, Result, run_block
from .worker import model_of

AHEAD = 2  # blocks a worker, so that none waits
TRIES = 4  # of a block whose worker is gone
LOOK_S = 0.2  # s between looks at the executor
WAIT_S = 0.02  # s for a block, until more may be sent
HERE_S = 3.0  # s of work of flights that is not worth other processes
GONE = (
    "executor: its workers are gone: finished rows are kept, and the same call resumes from there"
)


class Work(NamedTuple):
    """Points of a group, and how often they were sent in vain."""

    group: Group
    numbers: np.ndarray
    tries: int = 0


class Driver:
    """Runs all points of a sweep that have no rows; these come into the store."""

    def __init__(self, sweep: Sweep, settings: BlockSettings, name: str):
        self.store, self.posed, self.spent = sweep.store, sweep.posed, sweep.spent
        self.settings, self.name = settings, name
        models = range(len(self.posed.bundles))
        self.groups = [Group(self.posed, model, self.store.done) for model in models]
        self.done, self.failed = int(self.store.done.sum()), self.store.failed
        self.sent: dict[Future, Work] = {}
        self.ended: SimpleQueue[Future] = SimpleQueue()
        self.lost: deque[Work] = deque()  # blocks whose worker is gone

    @property
    def left(self) -> bool:
        """Whether there are points that are not sent yet."""
        return any(group.left for group in self.groups)

    def drive(self, executor: Any) -> None:
        """Run all points; NotWritten if rows cannot be written, SweepError if no worker is left."""
        begun = time.perf_counter()
        with Stage("sweep", self.name) as stage:
            self._tell(stage)
            if executor is None and self.settings.limit is None and self.settings.together:
                self._run_here(stage)
            if self.left:
                with place_of(executor) as place:
                    self._run_at(place, stage)
            self._tell(stage)
        self.spent.wall_s = time.perf_counter() - begun

    def _run_here(self, stage: Stage) -> None:
        """Run flights in this process for as long as others would take to begin."""
        begun = time.perf_counter()
        for group in self.groups:
            model = model_of(group.bundle, self.posed.job)
            while group.left and time.perf_counter() - begun < HERE_S:
                numbers = group.take(1)
                points = zip(numbers.tolist(), self.posed.axes.at(numbers), strict=True)
                parts = run_points(self.posed.job, model, dict(points))
                rows = [row for part in parts for row in part]
                self._keep(group, Result.of(rows, len(numbers), self.settings.store))
                self._tell(stage)

    def _run_at(self, place: Place, stage: Stage) -> None:
        """Keep all workers at work until no point is left."""
        blocks, gate, looked = self._blocks(), Gate(time.perf_counter()), -LOOK_S
        try:
            while self.sent or self.lost or self.left:
                now = time.perf_counter()
                if now - looked >= LOOK_S:
                    looked = now
                    self.spent.workers = _asked(place.workers)
                    if not place.alive():
                        raise SweepError(GONE)
                    self._tell(stage)
                # as many blocks as the workers and the scheduler bear
                while len(self.sent) < AHEAD * self.spent.workers and gate.passes(now):
                    work = self.lost.popleft() if self.lost else next(blocks, None)
                    if work is None:
                        break
                    future = _asked(place.submit, run_block, self._block(work))
                    self.sent[future] = work
                    future.add_done_callback(self.ended.put)
                with suppress(Empty):
                    self._receive(self.ended.get(timeout=WAIT_S), place)
        finally:
            for future in self.sent:
                future.cancel()

    def _receive(self, future: Future, place: Place) -> None:
        """Keep the rows of a block that has ended; put it back if its worker was lost."""
        work = self.sent.pop(future)
        try:
            result = future.result()
        except SerpentailError:
            raise
        except Exception as reason:  # whatever an executor loses work by
            if work.tries + 1 >= TRIES or not place.alive():
                raise _gone(reason) from reason
            self.lost.append(work._replace(tries=work.tries + 1))
        else:
            self._keep(work.group, result)

    def _blocks(self) -> Iterator[Work]:
        """Yield points of the groups in turn."""
        while self.left:
            for group in self.groups:
                if group.left:
                    yield Work(group, group.take(self.spent.workers))

    def _block(self, work: Work) -> Block:
        """Return points as they travel."""
        axes, places = self.posed.axes.part(work.numbers)
        return Block(self.settings, work.group.bundle, axes, places, work.numbers)

    def _keep(self, group: Group, result: Result) -> None:
        """Take notice of the rows of a block."""
        if result.refusal:
            raise SweepError(result.refusal)
        points = 0
        if result.shard is not None:
            self.store.accept(result.shard)
            points = result.shard.size
            self.done += points
            self.failed += result.shard.failed
            group.pace.learn(points, result.seconds)
        self.spent.points += points
        self.spent.hung += result.hung
        self.spent.blocks += 1
        self.spent.busy_s += result.seconds

    def _tell(self, stage: Stage) -> None:
        failed = f", {self.failed} failed" if self.failed else ""
        total = len(self.posed.axes)
        stage.tell(self.done / total, f"{self.name}: {self.done} of {total}{failed}")


def _asked(ask: Callable, *arguments: Any) -> Any:
    """Ask an executor; what it raises, whatever that is, tells that it is gone."""
    try:
        return ask(*arguments)
    except Exception as reason:
        raise _gone(reason) from reason


def _gone(reason: BaseException) -> SweepError:
    words = " ".join(str(reason).split())
    return SweepError(f"{GONE} ({type(reason).__name__}: {words:.300})")
