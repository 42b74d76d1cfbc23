"""The order of a straight line's operations: independent work fills the time that results take.

Recursions leave a processor waiting for one result after another, while independent work stands
further down the text than it can look ahead.  Longest remaining path first brings that work
forward, until REGISTERS values are alive; then what frees registers goes first.
"""

from collections.abc import Iterable, Sequence
from heapq import heappop, heappush

from ..ir.tape import BINARY, LEAVES, Node, operands

REGISTERS = 24  # of 32 vector registers; on 16 it still pays
MOST_OPERATIONS = 2800  # beyond, spilled values cost more than latency
# operations for each cycle of the longest path: beyond, there is enough to do in any order
MOST_ABREAST = 7
LATENCY = {"div": 13, "sqrt": 15, "sin": 30, "cos": 30, "neg": 1}  # cycles; 4 for all others


def scheduled(nodes: Sequence[Node], live: list[int], results: Iterable[int]) -> list[int]:
    """Return the live nodes, leaves first, in an order that respects their dependencies."""
    operations = [n for n in live if nodes[n][0] not in LEAVES]
    if sum(nodes[n][0] in BINARY for n in operations) > MOST_OPERATIONS:
        return live
    scheduler = _ListScheduler(nodes, operations, set(results))
    if len(operations) > MOST_ABREAST * max(scheduler.height.values(), default=0):
        return live
    return [n for n in live if nodes[n][0] in LEAVES] + scheduler.order()


class _ListScheduler:
    """List scheduling of one straight line.

    The operations that are ready lie in two heaps, one for each rule of choice.  How many values an
    operation uses for the last time can only grow while it waits: it then enters the heaps once
    more, ahead of its earlier entries, and what was placed already is passed over.
    """

    def __init__(self, nodes: Sequence[Node], operations: list[int], results: set[int]):
        # which operation needs which
        to_schedule = set(operations)
        self.operands = {n: {a for a in operands(nodes[n]) if a in to_schedule} for n in operations}
        self.users: dict[int, list[int]] = {n: [] for n in operations}
        for n, needed in self.operands.items():
            for a in needed:
                self.users[a].append(n)

        # longest remaining path, in cycles
        self.height: dict[int, int] = {}
        for n in reversed(operations):
            tail = max((self.height[u] for u in self.users[n]), default=0)
            self.height[n] = tail + LATENCY.get(nodes[n][0], 4)

        # operands that are still to come, and uses that are still to come
        self.waiting = {n: len(needed) for n, needed in self.operands.items()}
        self.uses = {n: len(users) + (n in results) for n, users in self.users.items()}

        # operands that are used for the last time
        self.frees = {
            n: sum(self.uses[a] == 1 for a in needed) for n, needed in self.operands.items()
        }

        self.longest_first: list[tuple[int, int, int]] = []
        self.freeing_first: list[tuple[int, int, int]] = []
        self.placed: set[int] = set()

    def order(self) -> list[int]:
        """Return the operations in order."""
        out: list[int] = []
        alive = 0
        for n, count in self.waiting.items():
            if count == 0:
                self._enter(n)
        while len(out) < len(self.operands):
            n = self._next(self.freeing_first if alive >= REGISTERS else self.longest_first)
            out.append(n)
            alive += 1 - self.frees[n]
            self._place(n)
        return out

    def _enter(self, n: int) -> None:
        """Let an operation that is ready compete under both rules; of equals the first is taken."""
        heappush(self.longest_first, (-self.height[n], -self.frees[n], n))
        heappush(self.freeing_first, (-self.frees[n], -self.height[n], n))

    def _next(self, heap: list[tuple[int, int, int]]) -> int:
        """Take the best operation that is not placed yet."""
        while True:
            n = heappop(heap)[-1]
            if n not in self.placed:
                return n

    def _place(self, n: int) -> None:
        """Count an operation as done, for its operands and its users."""
        self.placed.add(n)

        # an operand with one use left is freed by whoever has that use
        for a in self.operands[n]:
            self.uses[a] -= 1
            if self.uses[a] == 1:
                for last in set(self.users[a]) - self.placed:
                    self.frees[last] += 1
                    if self.waiting[last] == 0:
                        self._enter(last)

        for user in self.users[n]:
            self.waiting[user] -= 1
            if self.waiting[user] == 0:
                self._enter(user)
