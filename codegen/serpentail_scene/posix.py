"""What only POSIX has, locks of open files and handles of folders: Windows goes without them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]


def has_locks() -> bool:
    """Tell whether ``lock`` locks."""
    return fcntl is not None


def lock(handle: int, wait: bool = True) -> None:
    """Lock an open file or folder until it is closed; OSError if it is held, or has no locks."""
    if fcntl is not None:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def opened_folder(folder: str | os.PathLike[str]) -> Iterator[int | None]:
    """Lend the handle of a folder; None where it has none, as on Windows."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        yield None
        return
    try:
        yield handle
    finally:
        os.close(handle)


def synchronise(folder: str | os.PathLike[str]) -> None:
    """Write the names in a folder to the disk, where the file system can."""
    with opened_folder(folder) as handle, suppress(OSError):
        if handle is not None:
            os.fsync(handle)
