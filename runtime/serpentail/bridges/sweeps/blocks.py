"""How many points are sent as one block, and how many blocks a second."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .pose import Posed

LEAST_S = 1.0  # s of work that a block is to have
MOST_S = 60.0  # s of work that a kill may cost
TASKS_PER_S = 100  # that blocks are made for: one scheduler of Dask does about 220
MOST_TASKS_PER_S = 180  # that are sent
BURST = 20  # tasks that are sent at once in the beginning
GROWTH = 8  # times more points than in the block before
MOST_IN_BLOCK = 50_000
SHARE = 3  # blocks a worker that what is left is cut into, so that all end at about one time
OLDER = 0.98  # weight of what is known when a block comes back
SHORTEST = 0.25  # of its usual time that a block has in the end


@dataclass
class Pace:
    """How long points take: seconds of recent points, and the points of the largest block."""

    seconds: float = 0.0
    points: float = 0.0
    largest: int = 0

    def learn(self, points: int, seconds: float) -> None:
        """Note how long a block took; of a much larger one, the start of workers is a less part."""
        weight = OLDER if points < 2 * self.largest else 0.0
        self.seconds = weight * self.seconds + seconds
        self.points = weight * self.points + points
        self.largest = max(self.largest, points)

    def block(self, left: int, workers: int) -> int:
        """Return how many points the next block has, of those that are not sent yet."""
        if not self.points:
            return 1
        pace = max(self.seconds / self.points, 1e-9)
        usual = min(max(LEAST_S, workers / TASKS_PER_S), MOST_S) / pace
        in_the_end = max(SHORTEST * usual, left / (SHARE * workers))
        return max(1, round(min(usual, in_the_end, GROWTH * self.largest, MOST_IN_BLOCK, left)))


@dataclass
class Gate:
    """Lets tasks pass, so many a second; ``free`` of them may pass now."""

    at: float
    free: float = BURST

    def passes(self, now: float) -> bool:
        """Tell if one more task may pass now."""
        self.free = min(BURST, self.free + (now - self.at) * MOST_TASKS_PER_S)
        self.at = now
        if self.free < 1:
            return False
        self.free -= 1
        return True


class Group:
    """Points of one model without rows, in order; ``left`` of them are not sent yet."""

    def __init__(self, posed: Posed, model: int, done: np.ndarray):
        self.bundle, self.pace = posed.bundles[model], Pace()
        self.left = sum(map(len, _missing(posed, model, done)))
        self._windows = _missing(posed, model, done)
        self._next = np.empty(0, np.int64)

    def take(self, workers: int) -> np.ndarray:
        """Return the numbers of the points of the next block."""
        count = self.pace.block(self.left, workers)
        while len(self._next) < min(count, self.left):
            self._next = np.concatenate([self._next, next(self._windows)])
        block, self._next = np.split(self._next, [count])
        self.left -= len(block)
        return block


def _missing(posed: Posed, model: int, done: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the numbers of a model's points that are not done, in windows that need little room."""
    for first in range(0, len(done), MOST_IN_BLOCK):
        numbers = first + np.flatnonzero(~done[first : first + MOST_IN_BLOCK])
        yield numbers[posed.models(numbers) == model]
