"""Number of threads that this process may use: as set, or by the machine and its container."""

import math
import os
import sys
from functools import cache
from operator import index
from pathlib import Path
from typing import SupportsIndex

from ..basics.checks import refusal
from ..basics.errors import SerpentailError

VARIABLE = "SERPENTAIL_THREADS"  # of the environment
MOST_THREADS = 1024  # larger numbers are mistakes


def threads(asked: int | None = None) -> int:
    """Return the number of threads: as asked, as in $SERPENTAIL_THREADS, else one for each core.

    By default a worker of a process pool (multiprocessing, concurrent.futures, joblib) uses one,
    because its siblings use the other cores. SerpentailError if $SERPENTAIL_THREADS is wrong.
    """
    if asked is not None:
        return asked
    chosen = os.environ.get(VARIABLE, "").strip()
    if chosen:
        return checked_threads(VARIABLE, int(chosen) if chosen.isdecimal() else chosen)
    return 1 if _is_worker() else cores()


def checked_threads(field: str, value: object, error: type[Exception] = SerpentailError) -> int:
    """Return a number of threads; the error names the field and what it needs."""
    whole = index(value) if isinstance(value, SupportsIndex) else 0
    if 1 <= whole <= MOST_THREADS and not isinstance(value, bool):
        return whole
    raise refusal(field, value, f"a whole number of threads from 1 to {MOST_THREADS}", error)


def _is_worker() -> bool:
    """Tell whether multiprocessing, or a library built on it, started this process."""
    multiprocessing = sys.modules.get("multiprocessing.process")
    return multiprocessing is not None and multiprocessing.parent_process() is not None


def cores() -> int:
    """Return how many cores this process may use: by its affinity, and by its container's quota."""
    affinity = hasattr(os, "sched_getaffinity")
    own = len(os.sched_getaffinity(0)) if affinity else os.cpu_count() or 1
    return math.ceil(min(own, _own_quota()))


@cache
def _own_quota() -> float:
    return quota(Path("/"))


def quota(root: Path) -> float:
    """Return the cores' worth of time that control groups grant this process; inf without a limit.

    root: of the file system, with proc/self and sys/fs/cgroup. The smallest limit counts, of the
    process's own group and of the groups around it.
    """
    least = math.inf
    for line in _lines(root / "proc/self/cgroup"):
        number, controllers, own = line.split(":", 2)
        if number == "0" and not controllers:
            mounts, limit = ("sys/fs/cgroup", "sys/fs/cgroup/unified"), _limit_v2
        elif "cpu" in controllers.split(","):
            mounts, limit = ("sys/fs/cgroup/cpu", f"sys/fs/cgroup/{controllers}"), _limit_v1
        else:
            continue
        # in a container the path may be the host's: then the mount itself is the group
        groups = [own, *map(str, Path(own).parents)]
        folders = [root / mount / group.strip("/") for mount in mounts for group in groups]
        least = min([least, *map(limit, dict.fromkeys(folders))])
    return least


def _limit_v2(folder: Path) -> float:
    """Limit of a group of version 2: cpu.max has quota, or "max", and period in us."""
    words = " ".join(_lines(folder / "cpu.max")).split()
    return _ratio(*words) if len(words) == 2 else math.inf


def _limit_v1(folder: Path) -> float:
    """Limit of a group of version 1: a file for each of quota, -1 for none, and period in us."""
    words = [" ".join(_lines(folder / f"cpu.cfs_{name}_us")) for name in ("quota", "period")]
    return _ratio(*words)


def _ratio(granted: str, period: str) -> float:
    if granted.isdecimal() and period.isdecimal() and int(granted) and int(period):
        return int(granted) / int(period)
    return math.inf


def _lines(path: Path) -> list[str]:
    """Return the lines of a file; none if it cannot be read."""
    try:
        return path.read_text().splitlines()
    except (OSError, ValueError):
        return []
