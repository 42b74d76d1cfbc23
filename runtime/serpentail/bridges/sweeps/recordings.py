"""The files of marker tracks that identifications of a sweep read."""

import hashlib
from os import PathLike
from pathlib import Path
from typing import Any

from ...basics.checks import shown
from ...basics.errors import SweepError
from .axes import Point
from .job import DATA, Job


def recordings(job: Job, point: Point) -> list[Any]:
    """Return the trials of a point: paths of files, whole, and tracks as they were given."""
    given = point.get(DATA, job.settings.get(DATA))
    listed = list(given) if isinstance(given, list | tuple) else [given]
    return [
        Path(job.parent) / each if isinstance(each, str | PathLike) else each for each in listed
    ]


def digest_of(job: Job, point: Point) -> str:
    """Return a hash of the content of a point's files; SweepError where one cannot be read."""
    found = hashlib.sha256()
    for path in recordings(job, point):
        if isinstance(path, Path):
            try:
                found.update(hashlib.sha256(path.read_bytes()).digest())
            except OSError as reason:
                raise SweepError(
                    f"{DATA}: {shown(str(path))}: it cannot be read ({reason.strerror}): needs "
                    "files of marker tracks"
                ) from None
    return found.hexdigest()
