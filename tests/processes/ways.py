"""Ways to have work done elsewhere: in children, in pools of them, in threads.

``python -m tests.processes.ways WAY FOLDER`` does every job here, then there, and prints as JSON
what came of each there: "same", what it gave instead, or "hung".
"""

import json
import multiprocessing
import sys
from collections.abc import Callable, Iterator
from concurrent import futures
from functools import partial

import joblib

import serpentail as st

from .jobs import JOBS

LIMIT = 30.0  # s a job: some take one where processors are busy, a job that hangs for ever
TWICE = 2  # of each job: both workers of a pool, or both threads, at the same time


def done(model: st.Model, name: str) -> str:
    """Return the digest of a job, or what it raised."""
    try:
        return JOBS[name](model)
    except Exception as error:
        return repr(error)


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


WAYS = {
    "fork": partial(by_children, "fork"),
    "spawn": partial(by_children, "spawn"),
    "forkserver": partial(by_children, "forkserver"),
    "loky": partial(by_joblib, "loky"),
    "joblib threads": partial(by_joblib, "threading"),
    "process pool": partial(by_futures, futures.ProcessPoolExecutor),
    "thread pool": partial(by_futures, futures.ThreadPoolExecutor),
}


def main(way: str, folder: str) -> None:
    """Print what came of each job."""
    model = st.load(folder)
    expected = [done(model, name) for name in JOBS]
    outcome = {}
    for name, here, found in zip(JOBS, expected, WAYS[way](model), strict=True):
        outcome[name] = ["same" if each == here else f"{each}, not {here}" for each in found]
        print(json.dumps({name: outcome[name]}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
