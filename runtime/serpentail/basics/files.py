"""Writes files whole or not at all, and checks before the work that they can be written."""

import contextlib
import csv
import os
import re
import secrets
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from serpentail_scene.posix import has_locks, lock, synchronise

from .errors import NotWritten

PART = re.compile(r"\..+\.[0-9a-f]{8}\.part")
# begins a text, but no number, that a spreadsheet would run, with or without a ' in front
FORMULA = re.compile(r"'*(?![-+]?[\d.]+(e[-+]?\d+)?$)[-=+@\t\r\n]", re.IGNORECASE)
ABANDONED_AFTER_S = 60.0  # without a change: a part that no process holds was left by a kill


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Provide a temporary file that replaces ``path`` on success and is removed on failure.

    On success it is on the disk. A link is followed; a device or a pipe stays and gets the content.
    NotWritten if the system refuses.
    """
    _refuse_unusable_name(Path(path))
    target = Path(os.path.realpath(path))
    special = _special(target)
    with contextlib.ExitStack() as after:
        try:
            if special:
                folder = Path(after.enter_context(tempfile.TemporaryDirectory()))
            else:
                folder = target.parent
                folder.mkdir(parents=True, exist_ok=True)
                _remove_abandoned(folder)
            part = after.enter_context(_locked_part(folder, target.name))
            yield part
            if special:
                with part.open("rb") as content, target.open("wb") as stream:
                    shutil.copyfileobj(content, stream)
            else:
                _sync(part)
                part.replace(target)
                synchronise(folder)
        except OSError as reason:
            raise NotWritten(
                f"{str(path)!r} is not written ({reason.strerror or reason}): make room, or name "
                "another file"
            ) from reason


def write_csv(path: str | os.PathLike[str], rows: Iterable[Iterable[Any]]) -> Path:
    """Write rows as CSV, whole or not at all, and return the path; numbers have all their digits.

    Texts that a spreadsheet would run as a formula get a ' in front, see ``without_quote``.
    NotWritten if the system refuses.
    """
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerows([_quoted(cell) for cell in row] for row in rows)
    return Path(path)


def write_netcdf(path: str | os.PathLike[str], data: Any) -> Path:
    """Write a dataset of xarray as NetCDF, whole or not at all, and return the path.

    SciPy, which is always installed, writes NetCDF 3 with 64-bit offsets. NotWritten if the system
    refuses.
    """
    with replacing(path) as part:
        data.to_netcdf(part, engine="scipy", format="NETCDF3_64BIT")
    return Path(path)


def _quoted(cell: Any) -> Any:
    """Return a cell, a text with a ' in front if it could be a formula."""
    if not isinstance(cell, str):
        return cell
    cell = cell.replace("\r\n", "\n").replace("\r", "\n")  # which the csv module does not quote
    return f"'{cell}" if FORMULA.match(cell) else cell


def without_quote(text: str) -> str:
    """Return the text that ``write_csv`` wrote as this cell."""
    return text[1:] if text.startswith("'") and FORMULA.match(text) else text


@contextlib.contextmanager
def _locked_part(folder: Path, name: str) -> Iterator[Path]:
    """Make an empty part, locked while this process uses it, and remove it if it is still there."""
    part = folder / f".{name}.{secrets.token_hex(4)}.part"
    handle = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        if has_locks():
            lock(handle)
        else:
            os.close(handle)  # an open file cannot be renamed there
        yield part
    finally:
        with contextlib.suppress(OSError):  # its folder may be missing
            part.unlink(missing_ok=True)
        if has_locks():
            os.close(handle)


def _remove_abandoned(folder: Path) -> None:
    """Remove parts that killed processes left in a folder, where locks tell which these are."""
    if not has_locks():
        return
    with os.scandir(folder) as entries:
        parts = [entry.path for entry in entries if PART.fullmatch(entry.name)]
    for part in parts:
        with contextlib.suppress(OSError):  # it is held, or gone
            if time.time() - os.stat(part).st_mtime > ABANDONED_AFTER_S:
                handle = os.open(part, os.O_RDWR)
                try:
                    lock(handle, wait=False)
                    os.unlink(part)
                finally:
                    os.close(handle)


def _sync(path: Path) -> None:
    """Wait until a file is on the disk."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def refuse_unwritable(path: str | os.PathLike[str]) -> None:
    """OSError if a file cannot be written: it is a folder, or its folder cannot be used."""
    target = Path(path)
    _refuse_unusable_name(target)
    if target.is_dir():
        raise IsADirectoryError(f"{path} is a folder")
    if not _special(target):
        refuse_unusable(target.absolute().parent)
    elif not os.access(target, os.W_OK):
        raise PermissionError(f"{path} cannot be written to")


def refuse_unusable(folder: str | os.PathLike[str]) -> None:
    """OSError if no file can be written into a folder; the folder need not exist yet."""
    place = Path(folder).absolute()
    while not place.exists():  # those are made
        place = place.parent
    if not place.is_dir():
        raise NotADirectoryError(f"{place} is not a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise PermissionError(f"{place} cannot be written to")


def _special(path: Path) -> bool:
    """Tell if a path is that of a device, a pipe or a socket."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _refuse_unusable_name(path: Path) -> None:
    """NotWritten if no system can have a file of this name."""
    if not path.name or "\0" in str(path):
        fault = "a path cannot contain the character NUL" if path.name else "it is a folder"
        raise NotWritten(f"{str(path)!r} is not written ({fault}): name another file")
