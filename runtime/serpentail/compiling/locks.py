"""Lets one process at a time build an entry of the cache, while others that need it wait."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .cache import LOCKS, mark_used, own_folder

PATIENCE_S = 600.0  # s to wait for another process, because that may be suspended


@contextlib.contextmanager
def alone(cache: Path, name: str) -> Iterator[None]:
    """Hold the lock of a name; continue without it if locks do not work, or after a long wait.

    Without the lock an entry may be built twice, but entries are still added whole.
    """
    from filelock import FileLock  # only builds need it

    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError, NotImplementedError):
            path = own_folder(cache, LOCKS) / f"{name}.lock"
            held.enter_context(FileLock(path, timeout=PATIENCE_S))
            mark_used(path)
        yield
