"""Scheduling: nodes of a straight line go in, an order that hides latency without losing registers
comes out.

Recursions leave a processor waiting for one result after another, while independent work stands
further down the text than it can look ahead.  Longest remaining path first brings that work
forward, until REGISTERS values are alive; then what frees registers goes first.
"""

from collections import Counter

from ..ir.tape import BINARY, LEAVES, operands

REGISTERS = 24  # of 32 vector registers; on 16 it still pays
MOST_OPERATIONS = 2800  # beyond, spilled values cost more than latency
LATENCY = {"div": 13, "sqrt": 15, "sin": 30, "cos": 30, "neg": 1}  # cycles; 4 for all others


def scheduled(nodes, live: list[int], results) -> list[int]:
    """Return the live nodes, leaves first, in an order that respects their dependencies."""
    operations = [n for n in live if nodes[n][0] not in LEAVES]
    if sum(nodes[n][0] in BINARY for n in operations) > MOST_OPERATIONS:
        return live
    leaves = [n for n in live if nodes[n][0] in LEAVES]
    return leaves + _List(nodes, operations, set(results)).order()


class _List:
    """List scheduling of one straight line."""

    def __init__(self, nodes, operations: list[int], results: set[int]):
        known = set(operations)
        self.operands = {n: {a for a in operands(nodes[n]) if a in known} for n in operations}
        self.users = {n: [] for n in operations}
        for n, needed in self.operands.items():
            for a in needed:
                self.users[a].append(n)
        self.height = {}
        for n in reversed(operations):
            tail = max((self.height[u] for u in self.users[n]), default=0)
            self.height[n] = tail + LATENCY.get(nodes[n][0], 4)
        self.waiting = Counter({n: len(needed) for n, needed in self.operands.items()})
        self.uses = Counter({n: len(users) + (n in results) for n, users in self.users.items()})

    def order(self) -> list[int]:
        """Return the operations in order."""
        ready, out, alive = {n for n, count in self.waiting.items() if count == 0}, [], 0
        while ready:
            n = max(ready, key=self._freeing_first if alive >= REGISTERS else self._longest_first)
            ready.remove(n)
            out.append(n)
            alive += 1 - self._frees(n)
            self.uses.subtract(self.operands[n])
            self.waiting.subtract(self.users[n])
            ready.update(u for u in self.users[n] if self.waiting[u] == 0)
        return out

    def _frees(self, n: int) -> int:
        """How many values are used for the last time."""
        return sum(self.uses[a] == 1 for a in self.operands[n])

    def _longest_first(self, n: int) -> tuple:
        return self.height[n], self._frees(n), -n

    def _freeing_first(self, n: int) -> tuple:
        return self._frees(n), self.height[n], -n
