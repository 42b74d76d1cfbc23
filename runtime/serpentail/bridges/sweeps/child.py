"""A process that runs points, so that a crash or a hang in a point ends this process only."""

import importlib
import os
import pickle
import queue
import runpy
import signal
import sys
import threading
import types
from multiprocessing.connection import Connection

from ...basics.errors import SerpentailError
from .bundles import model_of
from .job import Job
from .runs import run_points
from .supervision import importing


def main(descriptor: int) -> None:
    """Run points that come through a socket, until it is closed.

    The system ends the process by SIGPROF once a point has taken more processor time than its
    limit. Ctrl-C is the driver's to answer: whoever starts this process blocks it.
    """
    os.dup2(2, 1)  # output of functions must not mix with reports
    link: Connection = Connection(descriptor)
    tasks: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(link, tasks), daemon=True).start()
    jobs: dict[bytes, Job] = {}
    while True:
        script, data, bundle, points, first, limit = tasks.get()
        try:
            if data not in jobs:
                jobs.clear()
                _as_main(script)
                jobs[data] = pickle.loads(data)
            model = model_of(bundle, jobs[data])
        except (SerpentailError, ImportError, AttributeError, OSError) as reason:
            link.send(("refused", f"{reason}"))
            continue
        link.send(("ready", None))
        signal.setitimer(signal.ITIMER_PROF, first)
        for told in run_points(jobs[data], model, points):
            signal.setitimer(signal.ITIMER_PROF, limit)
            link.send(("told", told))
        signal.setitimer(signal.ITIMER_PROF, 0)
        link.send(("end", None))


def _listen(link: Connection, tasks: queue.SimpleQueue) -> None:
    """Receive tasks; end the process when the parent is gone."""
    try:
        while True:
            tasks.put(link.recv())
    except (EOFError, OSError):
        os._exit(1)


def _as_main(script: str | None) -> None:
    """Have the functions of the program that the driver runs, as multiprocessing does."""
    if script is None or getattr(sys.modules["__main__"], "__file__", None) == script:
        return
    module = types.ModuleType("__mp_main__")
    importing.set()
    try:
        module.__dict__.update(runpy.run_path(script, run_name="__mp_main__"))
    finally:
        importing.clear()
    sys.modules["__main__"] = sys.modules["__mp_main__"] = module


if __name__ == "__main__":
    importlib.import_module("serpentail.bridges.sweeps.child").main(int(sys.argv[1]))
