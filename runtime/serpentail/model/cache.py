"""The cache of compiled models: where it is, and how a library gets in whole."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path

from ..errors import SerpentailError

CACHE_FORMAT = 1  # part of every name in the cache: raise it when the meaning of a name changes
REMEDY_CACHE = "set SERPENTAIL_CACHE to a folder you can write"


# The cache: <folder>/<key>/<digest of the library>.so, so one rename publishes a library with its
# proof.


def cache_folder(cache: Path | None) -> Path:
    """Return the cache: the argument, else $SERPENTAIL_CACHE, else $XDG_CACHE_HOME or ~/.cache,
    absolute.
    """
    own = cache or os.environ.get("SERPENTAIL_CACHE")
    shared = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(shared):  # the XDG specification has relative paths ignored
        shared = "~/.cache"
    try:
        return (Path(own) if own else Path(shared) / "serpentail").expanduser().absolute()
    except RuntimeError as error:
        raise SerpentailError(f"no cache of compiled models: {error}; {REMEDY_CACHE}") from error


def digest(data: object) -> str:
    """Return the sha256 of `data` as JSON."""
    return hashlib.sha256(json.dumps([CACHE_FORMAT, data]).encode()).hexdigest()


def trusted(place: Path) -> Path | None:
    """Return a library at `place` that has the content it is named after, so no damaged one."""
    with contextlib.suppress(OSError):
        for path in sorted(place.iterdir()):
            if path.name == library_name(path):
                return path
    return None


def library_name(path: Path) -> str:
    """Return the name that the content of `path` deserves."""
    return f"{hashlib.sha256(path.read_bytes()).hexdigest()}.so"


@contextlib.contextmanager
def temporary_file(folder: Path, suffix: str = ".part") -> Iterator[Path]:
    """Lend an empty file in `folder` under a name that no other process has, gone at the end."""
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f".{os.urandom(12).hex()}{suffix}"
    part.touch(exist_ok=False)
    try:
        yield part
    finally:
        part.unlink(missing_ok=True)
