"""Reads files that others may exchange meanwhile, or may have put something else in place of."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def regular_bytes(path: str | Path, folder: int | None = None) -> bytes:
    """Return the content of a file, its name relative to the handle of a folder where one is given.

    OSError where it cannot be read, or is a pipe, a device or a folder: nothing waits for a writer.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=folder)
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        with open(handle, "rb", closefd=False) as file:
            return file.read()
    finally:
        os.close(handle)


@contextmanager
def handle_of(folder: Path) -> Iterator[int]:
    """Lend a handle of a folder, which stays with that folder wherever it is moved."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield handle
    finally:
        os.close(handle)


def leads_to(path: Path, handle: int) -> bool:
    """Tell whether a path still leads to the folder of a handle."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(handle))
    except OSError:
        return False
