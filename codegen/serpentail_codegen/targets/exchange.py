"""Exchanges two folders by one rename, so that every reader sees either the old or the new one.

If the process is killed, one of them is left whole, and a temporary folder beside it, which a later
call deletes. If the system or the file system (NFS, for example) cannot exchange two folders, there
are two renames, and the place is empty for a moment between them.
"""

import ctypes
import errno
import os
import re
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

PART = re.compile(r"\.serpentail-[0-9a-f]{24}\.part")
LOST_S = 600.0  # s; an older temporary folder is from a process that was killed
OCCUPIED = (errno.ENOTEMPTY, errno.EEXIST)
# errors of a system that cannot exchange folders there, or synchronise them
UNKNOWN = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP)
# errors of one that cannot link files there, or no more of them
UNLINKED = (*UNKNOWN, errno.EPERM, errno.EACCES, errno.EXDEV, errno.EMLINK, errno.ENOENT)
HERE, EXCHANGE = -100, 2  # AT_FDCWD; RENAME_EXCHANGE of Linux and RENAME_SWAP of macOS


@contextmanager
def pinned(folder: Path) -> Iterator[Callable[[], bool]]:
    """Yield a function that tells whether a folder is still the one that it was at the start."""
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except FileNotFoundError:
        yield lambda: not os.path.lexists(folder)
        return
    try:
        yield lambda: _leads_to(folder, handle)
    finally:
        os.close(handle)


def _leads_to(path: Path, handle: int) -> bool:
    """Tell whether a path still leads to the folder of an open handle."""
    try:
        return os.path.samestat(path.stat(), os.fstat(handle))
    except FileNotFoundError:
        return False


def replace_folder(
    folder: Path, contents: Mapping[str, bytes], old: Collection[str], same: Callable[[], bool]
) -> bool:
    """Put a folder with these files in place of one whose own files had the names `old`.

    Other files in it, those of its user, are kept. Returns False, and does nothing, if the folder
    is not the same any more because another process was quicker. OSError if something cannot be
    written; then the old folder stays.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    beside = _name_beside(folder)
    try:
        beside.mkdir()
        _fill(beside, folder, contents)
        _bring_along(beside, folder, {*contents, *old})
        with suppress(FileNotFoundError):
            shutil.copymode(folder, beside)
        for place in {beside, *(path.parent for path in beside.rglob("*"))}:
            _synchronise(place)
        if not same():
            return False
        _swap(beside, folder)
        _synchronise(folder.parent)
    finally:
        shutil.rmtree(beside, ignore_errors=True)  # the old folder by now
    return True


def sweep(parent: Path) -> None:
    """Delete the temporary folders of killed processes."""
    with suppress(OSError):
        for path in parent.iterdir():
            if PART.fullmatch(path.name) and time.time() - path.lstat().st_mtime > LOST_S:
                shutil.rmtree(path, ignore_errors=True)


def _name_beside(folder: Path) -> Path:
    return folder.with_name(f".serpentail-{secrets.token_hex(12)}.part")


def holds(path: Path, content: bytes) -> bool:
    """Tell whether a file has this content."""
    try:
        return path.is_file() and path.read_bytes() == content
    except OSError:
        return False


def _fill(beside: Path, folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write the files, but keep unchanged ones: `make` goes by their times."""
    for name, content in contents.items():
        path = beside / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not (holds(folder / name, content) and _linked(folder / name, path)):
            with open(path, "xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())


def _bring_along(beside: Path, folder: Path, ours: Collection[str]) -> None:
    """Give the new folder all files that are not ours, too."""
    for name, is_folder in _leaves(folder):
        source, path = folder / name, beside / name
        if name in ours:
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        if is_folder:
            path.mkdir(exist_ok=True)
        elif not _linked(source, path):
            with suppress(FileNotFoundError):  # its user deleted it meanwhile
                shutil.copy2(source, path, follow_symlinks=False)


def _leaves(folder: Path, inside: str = "") -> Iterator[tuple[str, bool]]:
    """Yield the names of files and of empty folders below a folder, and whether it is one."""
    found: list[os.DirEntry[str]] = []
    with suppress(FileNotFoundError), os.scandir(folder / inside) as listed:
        found = list(listed)
    for entry in found:
        name = f"{inside}{entry.name}"
        if entry.is_dir(follow_symlinks=False):
            yield from list(_leaves(folder, f"{name}/")) or [(name, True)]
        else:
            yield name, False


def _linked(source: Path, path: Path) -> bool:
    """Give a file a second name; False if the file system cannot."""
    try:
        os.link(source, path, follow_symlinks=False)
    except OSError as error:
        if error.errno not in UNLINKED:
            raise
        return False
    return True


def _synchronise(folder: Path) -> None:
    """Write the names in a folder to the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in UNKNOWN:
            raise
    finally:
        os.close(handle)


def _swap(beside: Path, folder: Path) -> None:
    """Exchange the places of the two; `beside` is the old folder then, or gone."""
    while True:
        try:
            beside.rename(folder)  # there is no folder, or an empty one
            return
        except OSError as error:
            if error.errno not in OCCUPIED:
                raise
        try:
            if not _exchanged(beside, folder):
                _in_steps(beside, folder)
            return
        except OSError as error:  # another process was using it
            if error.errno not in (errno.ENOENT, *OCCUPIED):
                raise


def _exchanged(beside: Path, folder: Path) -> bool:
    """Exchange two folders by one rename; False if the system cannot."""
    call = _system_call()
    if call is None or call(os.fsencode(beside), os.fsencode(folder)) == 0:
        return call is not None
    code = ctypes.get_errno()
    if code in UNKNOWN:
        return False
    raise OSError(code, os.strerror(code), str(folder))


@cache
def _system_call() -> Callable[[bytes, bytes], int] | None:
    """Return the system's function that exchanges two paths."""
    library = ctypes.CDLL(None, use_errno=True)
    name = "renamex_np" if sys.platform == "darwin" else "renameat2"
    function = getattr(library, name, None)
    if function is None:
        return None
    if sys.platform == "darwin":
        return lambda one, other: function(one, other, ctypes.c_uint(EXCHANGE))
    return lambda one, other: function(HERE, one, HERE, other, ctypes.c_uint(EXCHANGE))


def _in_steps(beside: Path, folder: Path) -> None:
    """Exchange two folders by two renames, with nothing at the place for a moment."""
    aside = _name_beside(folder)
    folder.rename(aside)
    try:
        beside.rename(folder)
    except OSError as error:
        if error.errno in OCCUPIED:  # another process was quicker
            shutil.rmtree(aside, ignore_errors=True)
        else:
            aside.rename(folder)
        raise
    aside.rename(beside)
