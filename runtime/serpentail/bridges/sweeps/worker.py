"""A process that runs points, so that a crash or a hang in a point ends this process only."""

import os
import pickle
import queue
import signal
import threading
import zlib
from dataclasses import replace
from functools import lru_cache
from multiprocessing.connection import Connection
from typing import NamedTuple

from ...basics.errors import SerpentailError
from ...compiling.cache import cache_folder
from ...model.load import model_from
from ...model.manifest import CheckedFolder, snapshot
from ...model.model import Model
from .runs import Job, run_points

MOST_MODELS = 64  # that a process keeps


class Bundle(NamedTuple):
    """A model's generated folder as it is sent to workers: the manifest's hash, and all, packed."""

    manifest_hash: str
    content: bytes

    @classmethod
    def of(cls, checked: CheckedFolder) -> "Bundle":
        """Return the bundle of a folder that was checked."""
        whole = CheckedFolder(checked.folder, checked.manifest, dict(checked.files))
        return cls(checked.manifest_hash, zlib.compress(pickle.dumps(whole)))


def model_of(bundle: Bundle | None, job: Job) -> Model | None:
    """Return the model of a bundle for a job, compiled if this machine has not yet done so."""
    return bundle and _model(bundle, pickle.dumps(job.parameters), job.profile)


@lru_cache(MOST_MODELS)
def _model(bundle: Bundle, parameters: bytes, profile: str | None) -> Model:
    """Return the model of a folder that is put into this machine's cache."""
    checked: CheckedFolder = pickle.loads(zlib.decompress(bundle.content))
    checked = replace(checked, folder=snapshot(checked, cache_folder(None)))
    return model_from(checked, pickle.loads(parameters) or None, profile=profile)


@lru_cache(1)
def _job(content: bytes) -> Job:
    job: Job = pickle.loads(content)
    return job


def main(descriptor: int) -> None:
    """Run points that come through a socket, until it is closed.

    The answers to a task are [] once it begins, then lists of rows, at last None; or a text that
    tells why this process cannot run it. The system ends the process by SIGPROF once a point has
    taken more processor time than its limit.
    """
    os.dup2(2, 1)  # output of functions must not mix with reports
    link: Connection = Connection(descriptor)
    tasks: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(link, tasks), daemon=True).start()
    while True:
        content, bundle, points, first_limit, limit = tasks.get()
        try:
            job = _job(content)
            model = model_of(bundle, job)
        except (SerpentailError, ImportError, AttributeError, OSError) as reason:
            link.send(f"{reason}")
            continue
        link.send([])
        signal.setitimer(signal.ITIMER_PROF, first_limit)
        for rows in run_points(job, model, points):
            signal.setitimer(signal.ITIMER_PROF, limit)
            link.send(rows)
        signal.setitimer(signal.ITIMER_PROF, 0)
        link.send(None)


def _listen(link: Connection, tasks: queue.SimpleQueue) -> None:
    """Receive tasks; end the process when the parent is gone."""
    try:
        while True:
            tasks.put(link.recv())
    except (EOFError, OSError):
        os._exit(1)
