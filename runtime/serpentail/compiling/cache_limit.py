"""Keeps the cache of compiled models within its size, and lists its content."""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..basics.errors import SerpentailError
from .cache import BUILDS, COMPILERS, LIBRARIES, LOCKS, MODELS, PARTS, discard

DEFAULT_SIZE = "1G"
UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}
IN_USE_S = 600.0  # s: recently used entries stay, because a process may be about to open them
LOST_S = 3600.0  # s: older parts are from builds that were killed
KINDS = (LIBRARIES, MODELS, BUILDS, COMPILERS)
# Names of entries and parts: other files in the user's folder do not belong to the cache.
OURS = {
    **dict.fromkeys((LIBRARIES, MODELS), re.compile(r"[0-9a-f]{64}")),
    **dict.fromkeys((BUILDS, COMPILERS), re.compile(r"[0-9a-f]{64}\.json")),
    LOCKS: re.compile(r"[0-9a-f]{64}\.lock"),
    PARTS: re.compile(r"[0-9a-f]{24}"),
}


@dataclass(frozen=True)
class Entry:
    """Something in the cache: its kind, size in bytes, and when it was last used, in s."""

    kind: str
    path: Path
    size: int
    used: float


def limit() -> int:
    """Return the largest size of the cache in bytes; SerpentailError if the setting is wrong."""
    text = os.environ.get("SERPENTAIL_CACHE_SIZE") or DEFAULT_SIZE
    found = re.fullmatch(r"(\d{1,9})([KMGT]?)", text.strip(), re.IGNORECASE | re.ASCII)
    if found is None:
        raise SerpentailError(
            f"SERPENTAIL_CACHE_SIZE: value {text!r:.60}: needs a number of bytes, or of K, M, G or "
            "T, such as 500M"
        )
    return int(found[1]) * UNITS[found[2].upper()]


def entries(cache: Path, *kinds: str) -> Iterator[Entry]:
    """Yield all that is of these kinds."""
    for kind in kinds:
        names: list[str] = []
        with contextlib.suppress(OSError):
            names = sorted(os.listdir(cache / kind))
        for name in filter(OURS[kind].fullmatch, names):
            with contextlib.suppress(OSError):
                path = cache / kind / name
                yield Entry(kind, path, _size(path), path.lstat().st_mtime)


def _size(path: Path) -> int:
    """Return the bytes of the files at or below a path."""
    files = [path] if not path.is_dir() else [p for p in path.rglob("*") if not p.is_dir()]
    return sum(file.lstat().st_size for file in files)


def bound(cache: Path, most: int) -> None:
    """Delete leftovers of killed builds, then the oldest entries, down to ``most`` bytes."""
    now = time.time()
    for lost in entries(cache, PARTS, LOCKS):
        if now - lost.used > LOST_S:
            _delete(lost.path, cache)
    kept = sorted(entries(cache, *KINDS), key=lambda entry: entry.used)
    size = sum(entry.size for entry in kept)
    for entry in kept:
        if size <= most or now - entry.used < IN_USE_S:
            return
        _delete(entry.path, cache)
        size -= entry.size


def contents(cache: Path) -> dict[str, str | int]:
    """Return the folder of the cache, the number of entries of each kind, and their bytes."""
    found = list(entries(cache, *OURS))
    counts = {kind: sum(entry.kind == kind for entry in found) for kind in KINDS}
    size = sum(entry.size for entry in found)
    return {"folder": str(cache), **counts, "bytes": size, "limit": limit()}


def empty(cache: Path) -> None:
    """Delete all entries of the cache; processes keep what they have loaded."""
    for entry in entries(cache, *OURS):
        _delete(entry.path, cache)


def _delete(path: Path, cache: Path) -> None:
    """Delete an entry; ignore one that cannot be deleted, or that another process deletes."""
    with contextlib.suppress(OSError):
        discard(path, cache)
