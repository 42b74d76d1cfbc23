"""Sends the points of a sweep in blocks, and keeps their rows."""

import time
from collections import deque
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

from ...basics.errors import SweepError
from ...basics.progress import Stage
from .executors import GONE, Place, asked, place_of
from .processes import Block, BlockSettings, Bundle, model_of, run_block
from .result import Sweep
from .runs import run_points
from .store import Row

LEAST_S = 1.0  # s of work that a block is to have
MOST_S = 60.0  # s of work that a kill may cost
TASKS_PER_S = 30  # that blocks are made for
GROWTH = 8  # times more points than in the block before
MOST_IN_BLOCK = 50_000
SHARE = 3  # blocks a worker that what is left is cut into, so that all end at about one time
SHORTEST = 0.25  # of its usual time that a block has in the end
AHEAD = 2  # blocks a worker, so that none waits
LOOK_S = 0.2  # s between looks at the executor
HERE_S = 3.0  # s of work of flights that is not worth other processes


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
        pace = sum(row.seconds for row in rows) / max(len(rows), 1)
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


class Driver:
    """Runs all points of a sweep that have no rows; these come into the store."""

    def __init__(self, sweep: Sweep, settings: BlockSettings, name: str):
        self.store, self.posed, self.spent = sweep.store, sweep.posed, sweep.spent
        self.settings, self.name = settings, name
        missing = np.flatnonzero(~self.store.done)
        models = self.posed.models[self.posed.axes.places(missing)]
        bundles = enumerate(self.posed.bundles)
        # groups take turns, so that workers make all models at once
        self.groups = deque(Group(bundle, missing[models == k]) for k, bundle in bundles)

    def drive(self, executor: Any) -> None:
        """Run all points; NotWritten if rows cannot be written, SweepError if no worker is left."""
        begun = time.perf_counter()
        with Stage("sweep", self.name) as stage:
            self._tell(stage)
            if executor is None and self.settings.limit is None and self.settings.together:
                self._run_here(stage)
            if self._group():
                with place_of(executor) as place:
                    self._run_at(place, stage)
            self._tell(stage)
        self.spent.wall_s = time.perf_counter() - begun

    def _group(self) -> Group | None:
        """Return the group whose turn it is; None if no points are left to send."""
        for _ in range(len(self.groups)):
            self.groups.rotate(-1)
            if len(self.groups[0].left):
                return self.groups[0]
        return None

    def _run_here(self, stage: Stage) -> None:
        """Run flights in this process for as long as others would take to begin."""
        begun, job = time.perf_counter(), self.posed.job
        while time.perf_counter() - begun < HERE_S and (group := self._group()):
            numbers = group.take(1)
            points = zip(numbers.tolist(), self.posed.axes.at(numbers), strict=True)
            parts = run_points(job, model_of(group.bundle), dict(points))
            self._keep(group, len(numbers), [row for part in parts for row in part])
            self._tell(stage)

    def _run_at(self, place: Place, stage: Stage) -> None:
        """Keep all workers at work until no point is left."""
        ended: SimpleQueue[Future] = SimpleQueue()
        sent: dict[Future, tuple[Group, int]] = {}
        group, looked = self._group(), -LOOK_S
        try:
            while group or sent:
                if time.perf_counter() - looked >= LOOK_S:
                    looked, self.spent.workers = time.perf_counter(), asked(place.workers)
                    if not place.alive():
                        raise SweepError(GONE)
                    self._tell(stage)
                while group and len(sent) < AHEAD * self.spent.workers:
                    numbers = group.take(self.spent.workers)
                    columns = self.posed.axes.columns(numbers)
                    block = Block(self.settings, group.bundle, columns, numbers)
                    future = asked(place.submit, run_block, block)
                    sent[future] = group, len(numbers)
                    future.add_done_callback(ended.put)
                    group = self._group()
                with suppress(Empty):
                    future = ended.get(timeout=LOOK_S)
                    self._keep(*sent.pop(future), asked(future.result))
        finally:
            for future in sent:
                future.cancel()

    def _keep(self, group: Group, points: int, rows: list[Row] | str) -> None:
        """Keep the rows of a block of points; SweepError if no process can run it."""
        if isinstance(rows, str):
            raise SweepError(rows)
        self.store.accept(rows)
        group.learn(rows)
        self.spent.points += len(rows)
        self.spent.hung += points - len(rows)
        self.spent.blocks += 1
        self.spent.busy_s += sum(row.seconds for row in rows)

    def _tell(self, stage: Stage) -> None:
        done, total, failed = int(self.store.done.sum()), len(self.store.done), self.store.failed
        words = f", {failed} failed" if failed else ""
        stage.tell(done / total, f"{self.name}: {done} of {total}{words}")
