"""Where blocks are run: processes of this machine, Dask's workers, or any executor."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...basics.checks import refusal
from ...basics.errors import SweepError
from ...basics.extras import needed
from ...compiling.threads import checked_threads, threads
from .supervision import ending

CHOICES = (
    'None, "processes", "processes:4", "dask", "dask:tcp://host:8786", "dask:scheduler.json", or '
    "an executor of concurrent.futures"
)
PATIENCE_S = 30  # s to wait for a scheduler
RETRIES = 3  # by Dask, of a task whose worker is gone


@dataclass(frozen=True)
class Place:
    """Where blocks are run; ``workers`` returns how many are at work now."""

    submit: Callable[..., Future]
    workers: Callable[[], int]
    alive: Callable[[], bool] = lambda: True


@contextmanager
def place_of(executor: Any) -> Iterator[Place]:
    """Provide the executor that was asked for; SweepError if it is unknown or not reachable."""
    if executor is None:
        executor = "processes"
    if isinstance(executor, str):
        kind, _, rest = executor.partition(":")
        if kind == "processes":
            asked = rest or None
            count = (
                checked_threads(
                    "executor: processes", int(rest) if rest.isdecimal() else rest, SweepError
                )
                if asked
                else threads()
            )
            with _processes(count) as place:
                yield place
            return
        if kind == "dask":
            with _dask(rest) as place:
                yield place
            return
    elif hasattr(executor, "submit"):
        count = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        yield Place(executor.submit, lambda: count)
        return
    raise refusal("executor", executor, CHOICES, SweepError)


@contextmanager
def _processes(count: int) -> Iterator[Place]:
    """Threads, each of which controls one process."""
    pool: Executor = ThreadPoolExecutor(count, "serpentail-sweep")
    try:
        yield Place(pool.submit, lambda: count)
    finally:
        with ending():  # of an end in good order, none is at work
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _dask(address: str) -> Iterator[Place]:
    """Dask's workers: of a cluster on this machine, or of a scheduler's address or file."""
    distributed = needed("distributed", "dask")
    if address:
        where: dict[str, Any] = {"address": address}
        if Path(address).suffix == ".json":
            where = {"scheduler_file": address}
        cluster = None
    else:
        # threads of this process, because each block has a process of its own
        cluster = distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=threads(),
            processes=False,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": ":0"},  # any port: others may have sweeps
        )
        where = {"address": cluster}
    try:
        client = distributed.Client(**where, timeout=PATIENCE_S)
    except (OSError, ValueError) as reason:
        raise SweepError(
            f"executor: no scheduler of Dask at {address!r} ({reason}): start `dask scheduler`, "
            "and give its address or its file"
        ) from None
    try:
        pool = client.get_executor(pure=False, retries=RETRIES)
        yield Place(
            pool.submit,
            lambda: max(1, sum(client.nthreads().values())),
            lambda: client.status == "running",
        )
    finally:
        client.close()
        if cluster is not None:
            cluster.close()
