"""Sends the points of a sweep in blocks, and keeps their rows."""

import time
from collections import deque
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...basics.errors import SweepError
from ...basics.progress import Stage
from .places import Place, asked, place_of
from .processes import Block, Bundle, model_of
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
    """Points of one model without rows, that are not sent yet.

    pace: seconds that one takes; largest: points of the largest block that came back.
    """

    bundle: Bundle | None
    left: np.ndarray
    pace: float = 0.0
    largest: int = 0

    def take(self, workers: int) -> list[int]:
        """Return the numbers of the points of the next block; one to begin with."""
        usual = min(max(LEAST_S, workers / TASKS_PER_S), MOST_S) / max(self.pace, 1e-9)
        in_the_end = max(SHORTEST * usual, len(self.left) / (SHARE * workers))
        count = max(1, round(min(usual, in_the_end, GROWTH * self.largest, MOST_IN_BLOCK)))
        block, self.left = self.left[:count], self.left[count:]
        return block.tolist()

    def learn(self, rows: list[Row]) -> None:
        """Note how long a block took; in a small one, the start of a worker counts too much."""
        pace = sum(row.seconds for row in rows) / max(len(rows), 1)
        larger = len(rows) >= 2 * self.largest
        self.pace = pace if larger else 0.9 * self.pace + 0.1 * pace
        self.largest = max(self.largest, len(rows))


class Driver:
    """Runs all points of a sweep that have no rows; these come into the store."""

    def __init__(self, sweep: Sweep, limit: float | None, name: str):
        self.store, self.posed, self.spent = sweep.store, sweep.posed, sweep.spent
        self.name, self.job = name, sweep.posed.job
        self.usual = Block(self.job.pickled(), limit or 0.0, None, {})
        missing = np.flatnonzero(~self.store.done)
        models = self.posed.models[self.posed.axes.places(missing)]
        bundles = enumerate(self.posed.bundles)
        # groups take turns, so that workers make all models at once
        groups = (Group(bundle, missing[models == k]) for k, bundle in bundles)
        self.groups = deque(group for group in groups if len(group.left))

    def drive(self, executor: Any) -> None:
        """Run all points; NotWritten if rows cannot be written, SweepError if no worker is left."""
        begun = time.perf_counter()
        with Stage("sweep", self.name) as stage:
            self._tell(stage)
            if executor is None and not self.usual.limit and self.job.run == "simulate":
                self._run_here(stage)
            if self.groups:
                with place_of(executor) as place:
                    self._run_at(place, stage)
            self._tell(stage)
        self.spent.wall_s = time.perf_counter() - begun

    def _next(self, workers: int) -> tuple[Group, Block]:
        """Return the next block, of the group whose turn it is."""
        group = self.groups.popleft()
        numbers = group.take(workers)
        if len(group.left):
            self.groups.append(group)
        points = dict(zip(numbers, self.posed.axes.at(numbers), strict=True))
        return group, self.usual._replace(bundle=group.bundle, points=points)

    def _run_here(self, stage: Stage) -> None:
        """Run flights in this process for as long as others would take to begin."""
        begun = time.perf_counter()
        while self.groups and time.perf_counter() - begun < HERE_S:
            group, block = self._next(1)
            parts = run_points(self.job, model_of(block.bundle), block.points)
            self._keep(group, block, [row for part in parts for row in part])
            self._tell(stage)

    def _run_at(self, place: Place, stage: Stage) -> None:
        """Keep all workers at work until no point is left."""
        sent: dict[Future, tuple[Group, Block]] = {}
        try:
            while self.groups or sent:
                workers = self.spent.workers = asked(place.workers)
                while self.groups and len(sent) < AHEAD * workers:
                    group, block = self._next(workers)
                    sent[asked(place.submit, block)] = group, block
                for future in wait(sent, LOOK_S, FIRST_COMPLETED).done:
                    self._keep(*sent.pop(future), asked(future.result))
                self._tell(stage)
        finally:
            for future in sent:
                future.cancel()

    def _keep(self, group: Group, block: Block, rows: list[Row] | str) -> None:
        """Keep the rows of a block; SweepError if no process can run it."""
        if isinstance(rows, str):
            raise SweepError(rows)
        self.store.accept(rows)
        group.learn(rows)
        self.spent.points += len(rows)
        self.spent.hung += len(block.points) - len(rows)
        self.spent.blocks += 1
        self.spent.busy_s += sum(row.seconds for row in rows)

    def _tell(self, stage: Stage) -> None:
        done, total = np.count_nonzero(self.store.done), len(self.store.done)
        failed = np.count_nonzero(self.store.failed)
        words = f", {failed} failed" if failed else ""
        stage.tell(done / total, f"{self.name}: {done} of {total}{words}")
