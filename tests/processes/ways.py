"""Ways to have work done elsewhere: in children, in pools of them, in threads, in forks.

``python -m tests.processes.ways FOLDER WAY ...`` does every job here, then there by each way, and
prints as JSON what came of each: "same", what it gave instead, or "hung".
"""

import json
import multiprocessing
import sys
from collections.abc import Callable, Iterator
from concurrent import futures
from functools import partial

import joblib

import serpentail as st

from .forks import LIMIT, MOMENTS
from .jobs import JOBS, done

TWICE = 2  # of each job: both workers of a pool, or both threads, at the same time


def _told(pipe, model: st.Model) -> None:
    for name in JOBS:
        pipe.send(done(model, name))


def by_children(method: str, model: st.Model) -> Iterator[list[str]]:
    """Start children, which do all jobs and tell; one that hangs is killed."""
    context = multiprocessing.get_context(method)
    pipes, children = [], []
    for _ in range(TWICE):
        here, there = context.Pipe(duplex=False)
        child = context.Process(target=_told, args=(there, model))
        child.start()
        there.close()
        pipes.append(here)
        children.append(child)
    for _ in JOBS:
        yield [told(pipe) for pipe in pipes]
    for child in children:
        child.kill()


def told(pipe) -> str:
    """Return what a child tells in time."""
    try:
        return pipe.recv() if pipe.poll(LIMIT) else "hung"
    except EOFError:
        return "died"


def by_joblib(backend: str, model: st.Model) -> Iterator[list[str]]:
    """Have joblib's workers do the jobs."""
    with joblib.Parallel(TWICE, backend=backend, timeout=LIMIT) as parallel:
        for name in JOBS:
            yield parallel(joblib.delayed(done)(model, name) for _ in range(TWICE))


def by_futures(make: Callable[[int], futures.Executor], model: st.Model) -> Iterator[list[str]]:
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


WAYS = {
    "fork": partial(by_children, "fork"),
    "spawn": partial(by_children, "spawn"),
    "forkserver": partial(by_children, "forkserver"),
    "loky": partial(by_joblib, "loky"),
    "joblib threads": partial(by_joblib, "threading"),
    "process pool": partial(by_futures, futures.ProcessPoolExecutor),
    "thread pool": partial(by_futures, futures.ThreadPoolExecutor),
    **{name: partial(by_forks, moment) for name, moment in MOMENTS.items()},
}


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
