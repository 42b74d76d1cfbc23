"""Reads files that others may exchange meanwhile, or may have put something else in place of."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

# Windows has only the last, and opens no folders: files there are found by their paths.
PLAIN = sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_CLOEXEC", "O_BINARY"))


def regular_bytes(path: str | Path, folder: int | None = None) -> bytes:
    """Return the content of a file, whose name may be relative to the handle of a folder.

    OSError if it cannot be read, or is a pipe, a device or a folder: the call never waits for a
    writer.
    """
    handle = os.open(path, os.O_RDONLY | PLAIN, dir_fd=folder)
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        with open(handle, "rb", closefd=False) as file:
            return file.read()
    finally:
        os.close(handle)


@dataclass(frozen=True)
class Held:
    """A folder as it was first seen; an open handle follows it if it is moved."""

    path: Path
    seen: os.stat_result
    handle: int | None

    def read(self, name: str) -> bytes:
        """Return the content of a file in it; OSError as of ``regular_bytes``."""
        if self.handle is None:
            return regular_bytes(self.path / name)
        return regular_bytes(name, self.handle)

    def is_there(self) -> bool:
        """Tell whether its path still leads to it."""
        try:
            return os.path.samestat(os.stat(self.path), self.seen)
        except OSError:
            return False


@contextmanager
def held(folder: Path) -> Iterator[Held]:
    """Hold a folder while it is read; OSError if there is no such folder."""
    if os.open not in os.supports_dir_fd:
        os.listdir(folder)  # NotADirectoryError for a file
        yield Held(folder, os.stat(folder), None)
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | PLAIN)
    try:
        yield Held(folder, os.fstat(handle), handle)
    finally:
        os.close(handle)
