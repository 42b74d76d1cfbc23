"""Lets one process at a time build an entry of the cache, while those who need it too wait."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .cache import LOCKS, mark_used, own_folder

PATIENCE_S = 600.0  # s to wait for another process, which may have been stopped


@contextlib.contextmanager
def alone(cache: Path, name: str) -> Iterator[None]:
    """Hold the lock of a name; on file systems without locks, and without patience, go on anyway.

    Going on costs a second build and no more, as entries come into the cache whole.
    """
    from filelock import FileLock  # only builds need it

    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError, NotImplementedError):
            path = own_folder(cache, LOCKS) / f"{name}.lock"
            held.enter_context(FileLock(path, timeout=PATIENCE_S))
            mark_used(path)
        yield
