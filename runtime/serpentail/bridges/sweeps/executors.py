"""Where blocks are run: processes of this machine, Dask's workers, or any executor."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ...basics.checks import refusal
from ...basics.errors import SerpentailError, SweepError
from ...basics.extras import needed
from ...compiling.threads import checked_threads, threads
from .processes import ending

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

    submit: Callable[..., Future]
    workers: Callable[[], int]
    alive: Callable[[], bool] = lambda: True


@contextmanager
def place_of(executor: Any) -> Iterator[Place]:
    """Provide the executor that was asked for; SweepError if it is unknown or not reachable."""
    name = executor if isinstance(executor, str) else "processes" if executor is None else ""
    kind, _, rest = name.partition(":")
    if kind == "processes":
        asked = int(rest) if rest.isdecimal() else rest or threads()
        count = checked_threads("executor: processes", asked, SweepError)
        pool = ThreadPoolExecutor(count, "serpentail-sweep")  # each thread controls one process
        try:
            yield Place(pool.submit, lambda: count)
        finally:
            with ending():  # of an end in good order, none is at work
                pool.shutdown(wait=True, cancel_futures=True)
    elif kind == "dask":
        with _dask(rest) as place:
            yield place
    elif hasattr(executor, "submit"):
        count = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        yield Place(executor.submit, lambda: count)
    else:
        raise refusal("executor", executor, CHOICES, SweepError)


@contextmanager
def _dask(address: str) -> Iterator[Place]:
    """Dask's workers: of a cluster on this machine, or of a scheduler's address or file."""
    distributed = needed("distributed", "dask")
    where = {"scheduler_file" if Path(address).suffix == ".json" else "address": address}
    with ExitStack() as closing:
        try:
            if not address:
                # threads of this process, because each block has a process of its own
                where["address"] = closing.enter_context(
                    distributed.LocalCluster(
                        n_workers=1,
                        threads_per_worker=threads(),
                        processes=False,
                        dashboard_address=None,
                        scheduler_kwargs={"dashboard_address": ":0"},  # others may have sweeps
                    )
                )
            client = closing.enter_context(distributed.Client(**where, timeout=PATIENCE_S))
        except (OSError, ValueError) as reason:
            raise SweepError(
                f"executor: no scheduler of Dask at {address!r} ({reason}): start `dask scheduler`,"
                " and give its address or its file"
            ) from None
        yield Place(
            client.get_executor(pure=False, retries=RETRIES).submit,
            lambda: max(1, sum(client.nthreads().values())),
            lambda: client.status == "running",
        )


def asked(ask: Callable, *arguments: Any) -> Any:
    """Ask an executor; what it raises, whatever that is, tells that it is gone."""
    try:
        return ask(*arguments)
    except SerpentailError:
        raise
    except Exception as reason:
        words = " ".join(str(reason).split())
        raise SweepError(f"{GONE} ({type(reason).__name__}: {words:.300})") from reason
