"""Has jobs done elsewhere: in pools of children, in threads, in forks at bad moments.

``python -m tests.processes.elsewhere FOLDER WAY ...`` does every job here, then there by each way,
and prints as JSON what came of each: "same", what it gave instead, or "hung".
"""

import hashlib
import itertools
import json
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
from joblib.externals.loky import ProcessPoolExecutor as LokyExecutor

import serpentail as st

STATES = 2400  # more than both threads take, and enough for vectors
AGAIN = {"duration": 0.4, "bounds": st.Bounds(angle=np.pi / 3)}
AGAIN["tolerances"] = st.Tolerances(attitude=None)
LIMIT = 30.0  # s a job: some take one where processors are busy, a job that hangs for ever
TWICE = 2  # of each job: both workers of a pool, or both threads, at the same time

# What a process or thread may be asked for, each as the digest of all numbers that come out.


def start(model):
    """Return q and v of a rat thrown up, pitched, and turning about all axes."""
    q, v = np.full(model.nq, 0.1), np.zeros(model.nv)
    q[:7] = 0, 0, 0.3, np.cos(0.4), np.sin(0.4), 0, 0
    v[:6] = 0, -0.3, 2.4, 1, -2, 1.5
    return q, v


def starts(model, count):
    """Return states that are near to it."""
    random = np.random.default_rng(7)
    return [each + 0.01 * random.normal(size=(count, len(each))) for each in start(model)]


def _digest(*arrays) -> str:
    return hashlib.sha256(b"".join(np.array(a, float).tobytes() for a in arrays)).hexdigest()


def batch(model) -> str:
    """Evaluate states that threads share, one by one and in lanes."""
    q, v = starts(model, STATES)
    found = model.forward_dynamics(q, v, np.zeros(model.nv - 6))
    return _digest(found, model.mass_matrix(q), *model.energy(q, v))


def simulate(model) -> str:
    flight = st.simulate(model, *start(model), t_span=0.1)
    return _digest(flight.q, flight.v)


def rollouts(model) -> str:
    found = st.simulate(model, *starts(model, 12), t_span=0.1, output_step=0.02)
    return _digest(found.q, found.v, found.kinetic)


def casadi(model) -> str:
    """Evaluate symbolic and compiled functions of CasADi."""
    state = *start(model), np.zeros(model.nv - 6)
    external = model.casadi.external("forward_dynamics", 2)
    values = (*state, model.casadi.parameter_vector)
    blocks = external.jacobian()(*values, external(*values))
    symbolic = model.casadi.forward_dynamics(*state)
    return _digest(symbolic, external(*values), *map(np.array, blocks))


def plan(model) -> str:
    """Plan a motion: FATROP, IPOPT from there, its linear algebra, and the truth of its end."""
    batch(model)  # from then on nodes are evaluated in lanes, whose last digits are their own
    settings = {"start": start(model), **AGAIN}
    found = st.plan(model, **settings, solver=st.Solver(track=False))
    other = st.plan(model, **settings, guess=found, solver=st.Solver("ipopt", track=False))
    assert found.report["converged"] and other.report["converged"], (found.report, other.report)
    return _digest(found.solution.samples.states, other.solution.samples.states, found.trajectory.q)


JOBS = {job.__name__: job for job in (batch, simulate, rollouts, casadi, plan)}


def done(model: st.Model, name: str) -> str:
    """Return the digest of a job, or what it raised."""
    try:
        return JOBS[name](model)
    except Exception as error:
        return repr(error)


# Forks at bad moments; the children do every job, and tell.


def in_child(work: Callable[[], str]) -> str:
    """Return what work in a forked child tells; one that hangs is killed."""
    ours, theirs = os.pipe()
    child = os.fork()
    if not child:
        os.write(theirs, work().encode())
        os._exit(0)
    os.close(theirs)
    ready, _, _ = select.select([ours], [], [], LIMIT)
    said = os.read(ours, 65536).decode() if ready else "hung"
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(ours)
    return said or "died"


def all_jobs(model: st.Model) -> str:
    return json.dumps({name: done(model, name) for name in JOBS})


def forked(model: st.Model) -> str:
    return in_child(partial(all_jobs, model))


def again(model: st.Model) -> str:
    """Fork a child that does all jobs, then forks one that does them."""

    def work():
        all_jobs(model)
        return forked(model)

    return in_child(work)


def from_a_thread(model: st.Model) -> str:
    """Fork where the main thread is not the one that goes on in the child."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(forked, model).result()


def beside(does: Callable[[st.Model], object], model: st.Model) -> str:
    """Fork while another thread does something again and again."""
    over, turns = threading.Event(), itertools.count()

    def work():
        while not over.is_set():
            does(model)
            next(turns)

    with ThreadPoolExecutor(1) as thread:
        thread.submit(work)
        time.sleep(0.05)
        said = forked(model)
        over.set()
    assert next(turns), "the thread did nothing"
    return said


def beside_the_compiler(model: st.Model) -> str:
    """Fork while the locks of the C that is compiled late are held, as by another thread."""
    batches = model.batch_library
    with batches.sources["batch"].lock, batches.rollouts.lock:
        return forked(model)


MOMENTS = {
    "at rest": forked,
    "a fork of a fork": again,
    "from a thread": from_a_thread,
    "beside a batch": partial(beside, batch),
    "beside rollouts": partial(beside, rollouts),
    "beside a plan": partial(beside, plan),
    "beside the compiler": beside_the_compiler,
}


def by_executor(make: Callable, model: st.Model) -> Iterator[list[str]]:
    with make(TWICE) as executor:
        for name in JOBS:
            asked = [executor.submit(done, model, name) for _ in range(TWICE)]
            yield [each.result(LIMIT) for each in asked]


def by_forks(moment: Callable[[st.Model], str], model: st.Model) -> Iterator[list[str]]:
    """Have a child do the jobs that is forked at a moment."""
    said = moment(model)
    found = json.loads(said) if said.startswith("{") else dict.fromkeys(JOBS, said)
    yield from ([found[name]] for name in JOBS)


POOLS = {
    method: partial(ProcessPoolExecutor, mp_context=get_context(method))
    for method in ("fork", "spawn", "forkserver")
}
POOLS |= {"loky": LokyExecutor, "threads": ThreadPoolExecutor}
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
