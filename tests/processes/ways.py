"""Ways to have work done elsewhere: in pools of children, in threads, in forks at bad moments.

``python -m tests.processes.ways FOLDER WAY ...`` does every job here, then there by each way, and
prints as JSON what came of each: "same", what it gave instead, or "hung".
"""

import json
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

from joblib.externals.loky import ProcessPoolExecutor as LokyExecutor

import serpentail as st

from .forks import LIMIT, MOMENTS
from .jobs import JOBS, done

TWICE = 2  # of each job: both workers of a pool, or both threads, at the same time


def pool(method: str, workers: int) -> Executor:
    """Return a pool whose workers are started by a method."""
    return ProcessPoolExecutor(workers, mp_context=get_context(method))


def by_executor(make: Callable[[int], Executor], model: st.Model) -> Iterator[list[str]]:
    """Have the workers of an executor do the jobs."""
    with make(TWICE) as executor:
        for name in JOBS:
            asked = [executor.submit(done, model, name) for _ in range(TWICE)]
            yield [each.result(LIMIT) for each in asked]


def by_forks(moment: Callable[[st.Model], str], model: st.Model) -> Iterator[list[str]]:
    """Have a child do the jobs that is forked at a moment."""
    said = moment(model)
    found = json.loads(said) if said.startswith("{") else dict.fromkeys(JOBS, said)
    for name in JOBS:
        yield [found[name]]


POOLS = {
    **{method: partial(pool, method) for method in ("fork", "spawn", "forkserver")},
    "loky": LokyExecutor,
    "threads": ThreadPoolExecutor,
}
WAYS = {name: partial(by_executor, make) for name, make in POOLS.items()}
WAYS |= {name: partial(by_forks, moment) for name, moment in MOMENTS.items()}


def main(folder: str, *ways: str) -> None:
    """Print what came of each job, by each way."""
    model = st.load(folder)
    expected = [done(model, name) for name in JOBS]
    for way in ways:
        outcome = {}
        for name, here, found in zip(JOBS, expected, WAYS[way](model), strict=True):
            outcome[name] = ["same" if each == here else f"{each}, not {here}" for each in found]
        print(json.dumps({way: outcome}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
