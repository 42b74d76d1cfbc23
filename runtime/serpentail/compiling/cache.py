"""The cache of compiled models: its folder, its owner, and how entries are added whole."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

from ..basics.errors import SerpentailError
from .safe_files import regular_bytes

CACHE_FORMAT = 2  # part of every name in the cache: raise it when the meaning of a name changes
REMEDY_CACHE = "set SERPENTAIL_CACHE to a folder you can write"
ROOT = 0  # user id of the administrator, who may read everything

# Folders of the cache. An entry is made in PARTS, and one rename puts it in its place.
LIBRARIES = "libraries"  # <key>/<digest of the library>.so: each has the proof of its content
MODELS = "models"  # <manifest hash>/: generated folders as they were checked
BUILDS = "builds"  # <key>.json: the model that was made of a scene
COMPILERS = "compilers"  # <key>.json: properties of a compiler
LOCKS = "locks"
PARTS = "parts"


def cache_folder(cache: Path | None) -> Path:
    """Return the cache: as asked, else $SERPENTAIL_CACHE, else in $XDG_CACHE_HOME or ~/.cache."""
    chosen = cache or os.environ.get("SERPENTAIL_CACHE")
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


# Owner. Libraries in the cache are executed, so nobody else may be able to put them there.


def refuse_others(*paths: Path) -> None:
    """Raise SerpentailError if others than the user and root own it or may write to it.

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
                private = (
                    not status.st_mode & stat.S_ISVTX
                )  # not a folder for all users, such as /tmp
                mend = f"`chmod -R go-w {path}` if all in it is yours, or " if private else ""
                raise _unsafe(path, "is writable by others", mend)


def refuse_open(cache: Path) -> None:
    """Raise SerpentailError if everybody may exchange a folder above the cache, as not in /tmp."""
    for path in cache.resolve().parents if hasattr(os, "geteuid") else ():
        with contextlib.suppress(OSError):
            mode = os.stat(path).st_mode
            if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
                raise _unsafe(path, "is writable by others", f"`chmod o-w {path}`, or ")


def _unsafe(path: Path, fault: str, remedy: str) -> SerpentailError:
    """Return the error that others could have put libraries into the cache."""
    return SerpentailError(
        f"the cache of compiled models: {path} {fault}, who could make you run their code: "
        f"{remedy}set SERPENTAIL_CACHE to a folder of your own"
    )


def unwritable(cache: Path, error: OSError) -> SerpentailError:
    """Return the error that the cache cannot be written."""
    reason = error.strerror or str(error)
    return SerpentailError(
        f"cannot write to the cache of compiled models {cache}: {reason}; {REMEDY_CACHE}"
    )


def own_folder(cache: Path, kind: str) -> Path:
    """Return a folder of the cache that is private to the user; make it if it is missing."""
    for path in (cache, cache / kind):
        path.mkdir(0o700, parents=True, exist_ok=True)
    refuse_others(cache, cache / kind)
    return cache / kind


# Entries.


def library_in(place: Path) -> Path | None:
    """Return a library at `place` that has the content it is named after, so no damaged one."""
    with contextlib.suppress(OSError):
        for name in sorted(os.listdir(place)):
            path = place / name
            if name == library_name(path):
                refuse_others(place.parent, place, path)
                mark_used(place)
                return path
    return None


def library_name(path: Path) -> str:
    """Return the name that the content of `path` deserves."""
    return f"{hashlib.sha256(regular_bytes(path)).hexdigest()}.so"


def mark_used(place: Path) -> None:
    """Store the time of use, by which unused entries are found."""
    with contextlib.suppress(OSError):
        os.utime(place)


@contextlib.contextmanager
def workshop(cache: Path) -> Iterator[Path]:
    """Lend a new folder of the cache that no other process has, gone at the end."""
    part = own_folder(cache, PARTS) / os.urandom(12).hex()
    part.mkdir(0o700)
    try:
        yield part
    finally:
        shutil.rmtree(part, ignore_errors=True)


def publish(part: Path, place: Path, whole: Callable[[Path], object]) -> None:
    """Put an entry in its place by one rename; keep a whole one that is there, replace another."""
    own_folder(place.parents[1], place.parent.name)
    try:
        part.rename(place)
    except OSError:
        if whole(place):  # another process was first
            return
        discard(place, place.parents[1])
        part.rename(place)


def discard(place: Path, cache: Path) -> None:
    """Delete an entry, so that nobody sees half of it."""
    with workshop(cache) as part, contextlib.suppress(FileNotFoundError):
        place.rename(part / place.name)
