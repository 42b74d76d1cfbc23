"""Sends the points of a sweep in blocks, and keeps their rows."""

import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import SerpentailError, SweepError
from ...basics.progress import Stage
from .executors import Place, place_of
from .processes import Block, BlockSettings, run_block
from .result import Sweep
from .runs import run_points
from .store import Row
from .worker import Bundle, model_of

LEAST_S = 1.0  # s of work that a block is to have
MOST_S = 60.0  # s of work that a kill may cost
TASKS_PER_S = 30  # that blocks are made for
GROWTH = 8  # times more points than in the block before
MOST_IN_BLOCK = 50_000
SHARE = 3  # blocks a worker that what is left is cut into, so that all end at about one time
SHORTEST = 0.25  # of its usual time that a block has in the end
AHEAD = 2  # blocks a worker, so that none waits
TRIES = 4  # of a block whose worker is gone
LOOK_S = 0.2  # s between looks at the executor
HERE_S = 3.0  # s of work of flights that is not worth other processes
GONE = (
    "executor: its workers are gone: finished rows are kept, and the same call resumes from there"
)


@dataclass
class Group:
    """Points of one model without rows, that are not sent yet; pace: seconds that one takes."""

    bundle: Bundle | None
    left: np.ndarray
    pace: float = 0.0
    largest: int = field(default=0, init=False)  # block that came back

    def take(self, workers: int) -> np.ndarray:
        """Return the numbers of the points of the next block."""
        count = block_size(self.pace, self.largest, len(self.left), workers)
        block, self.left = np.split(self.left, [count])
        return block

    def learn(self, rows: list[Row]) -> None:
        """Note how long a block took; in a small one, the start of a worker counts too much."""
        pace = sum(row.seconds for row in rows) / len(rows)
        larger = len(rows) >= 2 * self.largest
        self.pace = pace if larger else 0.9 * self.pace + 0.1 * pace
        self.largest = max(self.largest, len(rows))


def block_size(pace: float, largest: int, left: int, workers: int) -> int:
    """Return how many points the next block has, of those that are left; one to begin with.

    pace: seconds a point; largest: points of the largest block before.
    """
    usual = min(max(LEAST_S, workers / TASKS_PER_S), MOST_S) / max(pace, 1e-9)
    in_the_end = max(SHORTEST * usual, left / (SHARE * workers))
    return max(1, round(min(usual, in_the_end, GROWTH * largest, MOST_IN_BLOCK, left)))


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
        missing = np.flatnonzero(~self.store.done)
        models = self.posed.models(missing)
        bundles = enumerate(self.posed.bundles)
        # groups take turns, so that workers make all models at once
        self.groups = deque(Group(bundle, missing[models == k]) for k, bundle in bundles)
        self.done, self.failed = int(self.store.done.sum()), self.store.failed
        self.lost: deque[Work] = deque()  # blocks whose worker is gone

    def drive(self, executor: Any) -> None:
        """Run all points; NotWritten if rows cannot be written, SweepError if no worker is left."""
        begun = time.perf_counter()
        with Stage("sweep", self.name) as stage:
            self._tell(stage)
            if executor is None and self.settings.limit is None and self.settings.together:
                self._run_here(stage)
            if any(len(group.left) for group in self.groups):
                with place_of(executor) as place:
                    self._run_at(place, stage)
            self._tell(stage)
        self.spent.wall_s = time.perf_counter() - begun

    def _run_here(self, stage: Stage) -> None:
        """Run flights in this process for as long as others would take to begin."""
        begun, job = time.perf_counter(), self.posed.job
        while time.perf_counter() - begun < HERE_S and (work := self._next()):
            numbers = work.numbers
            points = dict(zip(numbers.tolist(), self.posed.axes.at(numbers), strict=True))
            parts = run_points(job, model_of(work.group.bundle, job), points)
            self._keep(work, [row for part in parts for row in part])
            self._tell(stage)

    def _run_at(self, place: Place, stage: Stage) -> None:
        """Keep all workers at work until no point is left."""
        ended: SimpleQueue[Future] = SimpleQueue()
        sent: dict[Future, Work] = {}
        work, looked = self._next(), -LOOK_S
        try:
            while work or sent:
                if time.perf_counter() - looked >= LOOK_S:
                    looked = time.perf_counter()
                    self.spent.workers = _asked(place.workers)
                    if not place.alive():
                        raise SweepError(GONE)
                    self._tell(stage)
                while work and len(sent) < AHEAD * self.spent.workers:
                    columns = self.posed.axes.columns(work.numbers)
                    block = Block(self.settings, work.group.bundle, columns, work.numbers)
                    future = _asked(place.submit, run_block, block)
                    sent[future] = work
                    future.add_done_callback(ended.put)
                    work = self._next()
                with suppress(Empty):
                    future = ended.get(timeout=LOOK_S)
                    self._receive(sent.pop(future), future, place)
                    work = work or self._next()
        finally:
            for future in sent:
                future.cancel()

    def _next(self) -> Work | None:
        """Return the next block to send; None if there is none."""
        if self.lost:
            return self.lost.popleft()
        for _ in self.groups:
            self.groups.rotate(-1)
            if len(self.groups[0].left):
                return Work(self.groups[0], self.groups[0].take(self.spent.workers))
        return None

    def _receive(self, work: Work, future: Future, place: Place) -> None:
        """Keep the rows of a block that has ended; put it back if its worker was lost."""
        try:
            rows = future.result()
        except SerpentailError:
            raise
        except Exception as reason:  # whatever an executor loses work by
            if work.tries + 1 >= TRIES or not place.alive():
                raise _gone(reason) from reason
            self.lost.append(work._replace(tries=work.tries + 1))
            return
        if isinstance(rows, str):
            raise SweepError(rows)
        self._keep(work, rows)

    def _keep(self, work: Work, rows: list[Row]) -> None:
        """Keep the rows of a block."""
        self.store.accept(rows)
        self.done += len(rows)
        self.failed += sum(row.error is not None for row in rows)
        if rows:
            work.group.learn(rows)
        self.spent.points += len(rows)
        self.spent.hung += len(work.numbers) - len(rows)
        self.spent.blocks += 1
        self.spent.busy_s += sum(row.seconds for row in rows)

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
