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
from .cache import BUILDS, COMPILERS, LIBRARIES, LOCKS, MODELS, PARTS, SOLVERS, discard

DEFAULT_SIZE = "1G"
UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}
IN_USE_S = 600.0  # s: recently used entries stay, because a process may be about to open them
LOST_S = 3600.0  # s: older parts are from builds that were killed
ENTRIES = (LIBRARIES, MODELS, BUILDS, COMPILERS, SOLVERS)
LEFTOVERS = (PARTS, LOCKS)
# Other files in the user's folder do not belong to the cache. Notes of version 0.2 were .json.
NAME = re.compile(r"[0-9a-f]{24}|[0-9a-f]{64}(\.json|\.lock)?")


@dataclass(frozen=True)
class CacheEntry:
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


def entries(cache: Path, kinds: tuple[str, ...]) -> Iterator[CacheEntry]:
    """Yield all that is of these kinds."""
    for kind in kinds:
        with contextlib.suppress(OSError):
            for path in sorted((cache / kind).iterdir()):
                if not NAME.fullmatch(path.name):
                    continue
                with contextlib.suppress(OSError):  # another process deletes it
                    files = [path, *(path.rglob("*") if path.is_dir() else ())]
                    size = sum(file.lstat().st_size for file in files if not file.is_dir())
                    yield CacheEntry(kind, path, size, path.lstat().st_mtime)


def keep_within(cache: Path, most: int) -> None:
    """Delete leftovers of killed builds, then the oldest entries, down to ``most`` bytes."""
    now = time.time()
    for leftover in entries(cache, LEFTOVERS):
        if now - leftover.used > LOST_S:
            _delete(leftover.path, cache)
    by_use = sorted(entries(cache, ENTRIES), key=lambda entry: entry.used)
    size = sum(entry.size for entry in by_use)
    for entry in by_use:
        if size <= most or now - entry.used < IN_USE_S:
            return
        _delete(entry.path, cache)
        size -= entry.size


def contents(cache: Path) -> dict[str, str | int]:
    """Return the folder of the cache, the number of entries of each kind, and their bytes."""
    found = list(entries(cache, ENTRIES + LEFTOVERS))
    counts = {kind: sum(entry.kind == kind for entry in found) for kind in ENTRIES}
    size = sum(entry.size for entry in found)
    return {"folder": str(cache), **counts, "bytes": size, "limit": limit()}


def empty(cache: Path) -> None:
    """Delete all entries of the cache; processes keep what they have loaded."""
    for entry in entries(cache, ENTRIES + LEFTOVERS):
        _delete(entry.path, cache)


def _delete(path: Path, cache: Path) -> None:
    """Delete an entry; ignore one that cannot be deleted, or that another process deletes."""
    with contextlib.suppress(SerpentailError):
        discard(path, cache)
