"""What is kept: how to make a thing, and what it depends on, go in; the thing, made only once,
comes out.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

MOST = 16  # programs and solvers


@dataclass(frozen=True)
class _Wish:
    of: tuple
    make: Callable = field(compare=False)


@lru_cache(maxsize=MOST)
def _made(wish: _Wish):
    return wish.make()


def kept(of: tuple, make: Callable):
    """Return make(), or what it returned for the same `of` (hashable) not long ago."""
    return _made(_Wish(of, make))
