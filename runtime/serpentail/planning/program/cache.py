"""A small cache of the terms of nodes, which take long to make.

Planning again from another start then derives nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

CAPACITY = 48  # terms; those that were not used for longest go


@dataclass(frozen=True)
class _Entry:
    """A key, and how to make its value; entries with the same key are equal."""

    key: tuple
    make: Callable[[], Any] = field(compare=False)


@lru_cache(maxsize=CAPACITY)
def _made(entry: _Entry) -> Any:
    return entry.make()


def memoised(key: tuple, make: Callable[[], Any]) -> Any:
    """Return make(), or what it returned for the same key (hashable) not long ago."""
    return _made(_Entry(key, make))
