"""Where blocks are run: processes of this machine, Dask's workers, or any executor."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ...basics.checks import refusal
from ...basics.errors import SerpentailError, SweepError
from ...basics.extras import needed
from ...compiling.threads import checked_threads, threads
from .processes import Block, Crew, run_block

CHOICES = (
    'None, "processes", "processes:4", "dask", "dask:tcp://host:8786", "dask:scheduler.json", or '
    "an executor of concurrent.futures"
)
GONE = (
    "executor: its workers are gone: finished rows are kept, and the same call resumes from there"
)
PATIENCE_S = 30  # s to wait for a scheduler
RETRIES = 3  # by Dask, of a task whose worker is gone


class Place(NamedTuple):
    """Where blocks are run; ``workers`` returns how many are at work now."""

    submit: Callable[[Block], Future]
    workers: Callable[[], int]


@contextmanager
def place_of(executor: Any) -> Iterator[Place]:
    """Provide the executor that was asked for; SweepError if it is unknown or not reachable."""
    name = executor if isinstance(executor, str) else "processes" if executor is None else ""
    kind, _, rest = name.partition(":")
    if kind == "processes":
        asked = int(rest) if rest.isdecimal() else rest or threads()
        count = checked_threads("executor: processes", asked, SweepError)
        crew = Crew()
        pool = ThreadPoolExecutor(count, "serpentail-sweep")  # each thread controls one process
        try:
            yield Place(lambda block: pool.submit(crew.run, block), lambda: count)
        finally:
            crew.dismiss()  # of an end in good order, none is at work
            pool.shutdown()
            crew.dismiss()  # which are idle now
    elif kind == "dask":
        with _dask(rest) as place:
            yield place
    elif hasattr(executor, "submit"):
        count = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        yield Place(partial(executor.submit, run_block), lambda: count)
    else:
        raise refusal("executor", executor, CHOICES, SweepError)


@contextmanager
def _dask(address: str) -> Iterator[Place]:
    """Dask's workers: of a cluster in this process, or of a scheduler's address or file."""
    distributed = needed("distributed", "dask")
    where: dict[str, Any]
    if address:
        where = {"scheduler_file" if Path(address).suffix == ".json" else "address": address}
    else:
        # threads, because each block has a process of its own; other programs may have sweeps, too
        where = {"n_workers": 1, "threads_per_worker": threads(), "processes": False}
        where |= {"dashboard_address": ":0"}
    try:
        client = distributed.Client(**where, timeout=PATIENCE_S)
    except (OSError, ValueError) as reason:
        raise SweepError(
            f"executor: no scheduler of Dask at {address!r} ({reason}): start `dask scheduler`,"
            " and give its address or its file"
        ) from None

    def workers() -> int:
        if client.status != "running":
            raise ConnectionError("its scheduler does not answer")
        return max(1, sum(client.nthreads().values()))

    with client:
        executor = client.get_executor(pure=False, retries=RETRIES)
        yield Place(partial(executor.submit, run_block), workers)


def asked(ask: Callable, *arguments: Any) -> Any:
    """Ask an executor; what it raises, whatever that is, tells that it is gone."""
    try:
        return ask(*arguments)
    except SerpentailError:
        raise
    except Exception as reason:
        words = " ".join(str(reason).split())
        raise SweepError(f"{GONE} ({type(reason).__name__}: {words:.300})") from reason
