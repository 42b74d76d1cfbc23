"""Writes files whole or not at all, and checks before the work that they can be written."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from .errors import NotWritten


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Provide a temporary file that replaces ``path`` on success and is removed on failure.

    NotWritten if the system refuses.
    """
    target = Path(path)
    _refuse_unusable_name(target)
    part = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(target)
    except OSError as reason:
        raise NotWritten(
            f"{str(target)!r} is not written ({reason.strerror or reason}): make room, or name "
            "another file"
        ) from reason
    finally:
        with contextlib.suppress(OSError):  # its folder may be missing
            part.unlink(missing_ok=True)


def refuse_unwritable(path: str | os.PathLike[str]) -> None:
    """OSError if a file cannot be written: it is a folder, or its folder cannot be used."""
    target = Path(path)
    _refuse_unusable_name(target)
    if target.is_dir():
        raise IsADirectoryError(f"{path} is a folder")
    refuse_unusable(target.absolute().parent)


def refuse_unusable(folder: str | os.PathLike[str]) -> None:
    """OSError if no file can be written into a folder; the folder need not exist yet."""
    place = Path(folder).absolute()
    while not place.exists():  # those are made
        place = place.parent
    if not place.is_dir():
        raise NotADirectoryError(f"{place} is not a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise PermissionError(f"{place} cannot be written to")


def _refuse_unusable_name(path: Path) -> None:
    """NotWritten if no system can have a file of this name."""
    if not path.name or "\0" in str(path):
        fault = "a path cannot contain the character NUL" if path.name else "it is a folder"
        raise NotWritten(f"{str(path)!r} is not written ({fault}): name another file")
