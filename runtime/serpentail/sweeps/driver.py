"""Sends the points of a sweep in blocks of about one second, and writes their rows."""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import ceil
from typing import Any, NamedTuple

from ..errors import SweepError
from ..stages import Stage
from .axes import Point
from .bundles import Bundle, model_of
from .executors import Place, place_of
from .job import Job
from .runs import run_points
from .store import Row, Store
from .supervision import Block, Ran, run_block

BLOCK_S = 1.0  # s of work that a block is to have
GROWTH = 8  # times more points than in the block before
MOST_IN_BLOCK = 20_000
AHEAD = 2  # blocks a worker, so that none waits
TRIES = 4  # of a block whose worker is gone
LOOK_S = 0.2  # s between checks of blocks
HERE_S = 3.0  # s of work of flights that is not worth other processes


class Task(NamedTuple):
    """A point that is to be run: the key of its row, and the point as JSON too."""

    key: str
    text: str
    point: Point


Work = tuple["Group", list[Task], int]  # points of a group, and how often they were sent in vain


@dataclass
class Group:
    """Points of one model that are still to be run; pace: seconds for a point, if known."""

    bundle: Bundle | None
    job: Job
    left: deque[Task]
    pace: float | None = None
    last: int = 0  # points of the largest block that came back

    def size(self, workers: int) -> int:
        """Return how many points the next block has."""
        if self.pace is None:
            return 1
        most = min(GROWTH * self.last, ceil(len(self.left) / workers), MOST_IN_BLOCK)
        return max(1, min(most, round(BLOCK_S / max(self.pace, 1e-9))))

    def take(self, workers: int) -> list[Task]:
        """Return the points of the next block."""
        return [self.left.popleft() for _ in range(min(self.size(workers), len(self.left)))]

    def learn(self, points: int, seconds: float) -> None:
        """Note how long points took."""
        self.pace, self.last = seconds / points, max(self.last, points)


@dataclass
class Spent:
    """What a sweep took: elapsed seconds, seconds of all workers, blocks, points, workers."""

    wall_s: float = 0.0
    busy_s: float = 0.0
    blocks: int = 0
    points: int = 0
    workers: int = 1


@dataclass
class Driver:
    """Runs groups of points and keeps their rows."""

    store: Store
    groups: Sequence[Group]
    limit: float | None
    script: str | None
    name: str
    total: int
    done: int
    failed: int
    spent: Spent = field(default_factory=Spent)

    def drive(self, executor: Any) -> Spent:
        """Run all points; NotWritten if rows cannot be written, SweepError if no worker is left."""
        begun = time.perf_counter()
        with Stage("sweep", self.name) as stage:
            self._tell(stage)
            if executor is None and self.limit is None:
                self._here(stage)
            if any(group.left for group in self.groups):
                with place_of(executor) as place:
                    self._elsewhere(place, stage)
        self.spent.wall_s = time.perf_counter() - begun
        return self.spent

    # ---- in this process -------------------------------------------------------------------------

    def _here(self, stage: Stage) -> None:
        """Run flights in this process for as long as others would take to begin."""
        begun = time.perf_counter()
        for group in self.groups:
            if group.job.run != "simulate":
                return
            model = model_of(group.bundle, group.job)
            while group.left and time.perf_counter() - begun < HERE_S:
                tasks, clock = group.take(1), time.perf_counter()
                points = [task.point for task in tasks]
                told = [each for part in run_points(group.job, model, points) for each in part]
                ran = Ran(told, None, time.perf_counter() - clock)
                self._keep(group, tasks, ran)
                self._tell(stage)

    # ---- in others -------------------------------------------------------------------------------

    def _elsewhere(self, place: Place, stage: Stage) -> None:
        """Keep all workers at work until no point is left."""
        waiting: dict[Future, Work] = {}
        lost: deque[Work] = deque()
        jobs = {id(group): group.job.pickled() for group in self.groups}
        blocks = self._blocks()
        try:
            while True:
                with _reached():
                    self.spent.workers = place.workers()
                while len(waiting) < AHEAD * self.spent.workers:
                    work = lost.popleft() if lost else next(blocks, None)
                    if work is None:
                        break
                    with _reached():
                        waiting[place.submit(run_block, self._block(work, jobs))] = work
                if not waiting:
                    return
                ready, _ = wait(waiting, LOOK_S, FIRST_COMPLETED)
                for future in ready:
                    work = waiting.pop(future)
                    ran = self._result(future, work[2], place)
                    if ran is None:
                        lost.append((work[0], work[1], work[2] + 1))
                    else:
                        self._keep(work[0], work[1], ran)
                self._tell(stage)
                if not place.alive():
                    raise SweepError(GONE)
        finally:
            for future in waiting:
                future.cancel()

    def _blocks(self) -> Iterator[Work]:
        """Yield points of the groups in turn."""
        while True:
            left = [group for group in self.groups if group.left]
            if not left:
                return
            for group in left:
                if group.left:
                    yield group, group.take(self.spent.workers), 0

    def _block(self, work: Work, jobs: dict[int, bytes]) -> Block:
        """Return points as they travel."""
        group, tasks, _ = work
        points = [task.point for task in tasks]
        together = group.job.run == "simulate"
        return Block(jobs[id(group)], self.script, group.bundle, points, self.limit, together)

    def _result(self, future: Future, tries: int, place: Place) -> Ran | None:
        """Return the results of a block; None if it is to be sent again."""
        try:
            return future.result()
        except (Exception, CancelledError) as reason:  # whatever an executor loses work by
            if tries + 1 >= TRIES or not place.alive():
                raise _gone(reason) from reason
            return None

    # ---- rows ------------------------------------------------------------------------------------

    def _keep(self, group: Group, tasks: list[Task], ran: Ran) -> None:
        """Write the rows of a block."""
        if ran.refused is not None:
            raise SweepError(f"run: no process can run it: {ran.refused}")
        rows = [
            Row(task.key, task.text, told.outcome, told.error, told.seconds)
            for task, told in zip(tasks, ran.told, strict=True)
        ]
        self.store.add(rows)
        group.learn(len(tasks), sum(row.seconds for row in rows))
        self.done += len(rows)
        self.failed += sum(row.error is not None for row in rows)
        self.spent.points += len(rows)
        self.spent.blocks += 1
        self.spent.busy_s += sum(row.seconds for row in rows)

    def _tell(self, stage: Stage) -> None:
        failed = f", {self.failed} failed" if self.failed else ""
        stage.tell(self.done / self.total, f"{self.name}: {self.done} of {self.total}{failed}")


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
