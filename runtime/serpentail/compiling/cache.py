"""The cache of compiled models: its folder, its owner, its locks, and entries that come whole."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..basics.errors import SerpentailError

CACHE_FORMAT = 3  # part of every name in the cache: raise it when the meaning of a name changes
REMEDY_CACHE = "set SERPENTAIL_CACHE to a folder you can write"
ROOT = 0  # user id of the administrator, who may read everything
PATIENCE_S = 600.0  # s to wait for another process, because that may be suspended

# Folders of the cache. An entry is made in PARTS, and one rename puts it in its place.
# Of the first four, it is <key>/<SHA-256 of the file>, and so proves its content.
LIBRARIES = "libraries"  # compiled C
BUILDS = "builds"  # of a scene: the hash of the manifest of its model
COMPILERS = "compilers"  # properties of a compiler
SOLVERS = "solvers"  # whether a solver has a setting
MODELS = "models"  # <manifest hash>/: generated folders as they were checked
LOCKS = "locks"
PARTS = "parts"


def cache_folder() -> Path:
    """Return the cache: $SERPENTAIL_CACHE, else in $XDG_CACHE_HOME or ~/.cache."""
    chosen = os.environ.get("SERPENTAIL_CACHE")
    shared = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(shared):  # the XDG specification has relative paths ignored
        shared = "~/.cache"
    try:
        return (Path(chosen) if chosen else Path(shared) / "serpentail").expanduser().absolute()
    except RuntimeError as error:
        raise SerpentailError(f"no cache of compiled models: {error}; {REMEDY_CACHE}") from error


def digest(data: object) -> str:
    """Return the sha256 of `data` as JSON."""
    return hashlib.sha256(json.dumps([CACHE_FORMAT, data]).encode()).hexdigest()


def regular_bytes(path: Path) -> bytes:
    """Return the content of a file; OSError if it is none.

    For a pipe, too, or a device: the call never waits for a writer.
    """
    plain = sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_CLOEXEC", "O_BINARY"))
    handle = os.open(path, os.O_RDONLY | plain)  # Windows has only the last of them
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        with open(handle, "rb", closefd=False) as file:
            return file.read()
    finally:
        os.close(handle)


# Owner. Libraries in the cache are executed, so nobody else may be able to put them there.


def refuse_others(*paths: Path) -> None:
    """Raise SerpentailError if others than the user and root may exchange any of these.

    Windows has no such owners and rights: there a cache is as safe as its folder.
    """
    if not hasattr(os, "geteuid"):
        return
    for path in paths:
        with contextlib.suppress(OSError):
            status = os.stat(path)
            if status.st_uid not in (os.geteuid(), ROOT):
                raise _unsafe(path, f"belongs to user {status.st_uid}", "")
            if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                for_all = status.st_mode & stat.S_ISVTX  # such as /tmp, which must stay open
                remedy = f"`chmod -R go-w {path}` if all in it is yours, or "
                raise _unsafe(path, "is writable by others", "" if for_all else remedy)


def refuse_open(cache: Path) -> None:
    """Raise SerpentailError if everybody may exchange a folder above the cache, as not in /tmp."""
    for path in cache.resolve().parents if hasattr(os, "geteuid") else ():
        with contextlib.suppress(OSError):
            if os.stat(path).st_mode & (stat.S_IWOTH | stat.S_ISVTX) == stat.S_IWOTH:
                raise _unsafe(path, "is writable by others", f"`chmod o-w {path}`, or ")


def _unsafe(path: Path, fault: str, remedy: str) -> SerpentailError:
    """Return the error that others could have put libraries into the cache."""
    return SerpentailError(
        f"the cache of compiled models: {path} {fault}, who could make you run their code: "
        f"{remedy}set SERPENTAIL_CACHE to a folder of your own"
    )


def _private_folder(cache: Path, kind: str) -> Path:
    """Return a folder of the cache that is private to the user; make it if it is missing."""
    for path in (cache, cache / kind):
        path.mkdir(0o700, parents=True, exist_ok=True)
    refuse_others(cache, cache / kind)
    return cache / kind


# Entries.


def find(cache: Path, kind: str, key: str) -> tuple[Path, bytes] | None:
    """Return the file of an entry, and its content; None if it is missing or damaged."""
    place = cache / kind / key
    with contextlib.suppress(OSError):
        for name in sorted(os.listdir(place)):
            content = regular_bytes(place / name)
            if Path(name).stem == hashlib.sha256(content).hexdigest():
                refuse_others(cache, place.parent, place, place / name)
                mark_used(place)
                return place / name, content
    return None


def store(cache: Path, kind: str, key: str, file: Path) -> Path:
    """Move a file of a workshop into an entry, and return its place there.

    If another process was first, its library stays, which may be in use.
    """
    name = f"{hashlib.sha256(file.read_bytes()).hexdigest()}{file.suffix}"
    entry, place = file.with_name("entry"), cache / kind / key
    entry.mkdir(0o700)
    file.chmod(0o700)
    file.rename(entry / name)
    publish(entry, place, lambda: kind == LIBRARIES and find(cache, kind, key) is not None)
    found = find(cache, kind, key)
    return found[0] if found else place / name


def read_note(cache: Path, kind: str, key: str) -> Any:
    """Return what ``write_note`` stored; None if it is missing or damaged."""
    found = find(cache, kind, key)
    return None if found is None else json.loads(found[1])


def write_note(cache: Path, kind: str, key: str, data: object) -> None:
    """Store data that JSON can express, in place of an earlier note."""
    with workshop(cache) as part:
        file = part / "note.json"
        file.write_text(json.dumps(data), encoding="utf-8")
        store(cache, kind, key, file)


def mark_used(place: Path) -> None:
    """Store the time of use, by which unused entries are found."""
    with contextlib.suppress(OSError):
        os.utime(place)


@contextlib.contextmanager
def workshop(cache: Path) -> Iterator[Path]:
    """Lend a new folder of the cache that no other process has, gone at the end.

    SerpentailError if the cache cannot be written.
    """
    try:
        part = _private_folder(cache, PARTS) / os.urandom(12).hex()
        part.mkdir(0o700)
        try:
            yield part
        finally:
            shutil.rmtree(part, ignore_errors=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SerpentailError(
            f"cannot write to the cache of compiled models {cache}: {reason}; {REMEDY_CACHE}"
        ) from error


def publish(part: Path, place: Path, is_whole: Callable[[], bool]) -> None:
    """Put an entry in its place by one rename; keep a whole one that is there, replace another."""
    _private_folder(place.parents[1], place.parent.name)
    try:
        part.rename(place)
    except OSError:
        if not is_whole():  # else another process was first
            discard(place, place.parents[1])
            part.rename(place)


def discard(place: Path, cache: Path) -> None:
    """Delete an entry, so that nobody sees half of it."""
    with workshop(cache) as part, contextlib.suppress(FileNotFoundError):
        place.rename(part / place.name)


@contextlib.contextmanager
def alone(cache: Path, name: str) -> Iterator[None]:
    """Hold the lock of a name; continue without it if locks do not work, or after a long wait.

    Without the lock an entry may be built twice, but entries are still added whole.
    """
    from filelock import FileLock  # only builds need it

    with contextlib.ExitStack() as locks:
        with contextlib.suppress(OSError, NotImplementedError):
            path = _private_folder(cache, LOCKS) / f"{name}.lock"
            locks.enter_context(FileLock(path, timeout=PATIENCE_S))
            mark_used(path)
        yield
