"""Forks at bad moments; the children do every job, and tell."""

import itertools
import json
import os
import select
import signal
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from functools import partial

import serpentail as st

from .jobs import JOBS, batch, done, plan, rollouts

LIMIT = 30.0  # s a job: some take one where processors are busy, a job that hangs for ever


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
    """Return the digests of all jobs, as JSON."""
    return json.dumps({name: done(model, name) for name in JOBS})


@contextmanager
def while_another_thread(does: Callable[[st.Model], object], model: st.Model):
    """Have a thread do something again and again."""
    over, turns = threading.Event(), itertools.count()

    def work():
        while not over.is_set():
            does(model)
            next(turns)

    thread = threading.Thread(target=work)
    thread.start()
    time.sleep(0.05)
    yield
    over.set()
    thread.join()
    assert next(turns), "the thread did nothing"


@contextmanager
def while_it_compiles(model: st.Model):
    """Have a thread hold the locks of the C that is compiled late."""
    held, over = threading.Event(), threading.Event()
    batches = model.batch_library

    def work():
        with batches.sources["batch"].lock, batches.rollouts.lock:
            held.set()
            over.wait()

    thread = threading.Thread(target=work)
    thread.start()
    held.wait()
    yield
    over.set()
    thread.join()


def forked(model: st.Model) -> str:
    """Return what a child does."""
    return in_child(partial(all_jobs, model))


def again(model: st.Model) -> str:
    """Fork a child that does all jobs, then forks one that does them."""

    def work():
        all_jobs(model)
        return forked(model)

    return in_child(work)


def from_a_thread(model: st.Model) -> str:
    """Fork where the main thread is not the one that goes on in the child."""
    found: list[str] = []
    thread = threading.Thread(target=lambda: found.append(forked(model)))
    thread.start()
    thread.join()
    return found[0]


def beside(does: Callable[[st.Model], object], model: st.Model) -> str:
    """Fork while another thread does something."""
    with while_another_thread(does, model):
        return forked(model)


def beside_the_compiler(model: st.Model) -> str:
    """Fork while another thread holds the locks of late C."""
    with while_it_compiles(model):
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
