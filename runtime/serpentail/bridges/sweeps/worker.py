"""A process that runs points, so that a crash or a hang in a point ends this process only."""

import hashlib
import os
import pickle
import queue
import signal
import threading
import zlib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from multiprocessing.connection import Connection
from typing import NamedTuple

from ...basics.errors import SerpentailError
from ...compiling.cache import cache_folder
from ...model.load import model_from
from ...model.manifest import CheckedFolder, snapshot
from ...model.model import Model
from .axis import as_json
from .runs import Job, run_points

MOST_MODELS = 64  # that a process keeps


class Bundle(NamedTuple):
    """A model as it is sent to workers: its folder, parameters and profile, and a hash of these."""

    identity: str
    content: bytes

    @classmethod
    def of(
        cls, checked: CheckedFolder, parameters: Mapping | None = None, profile: str | None = None
    ) -> "Bundle":
        """Return the bundle of a folder that was checked."""
        whole = CheckedFolder(checked.folder, checked.manifest, dict(checked.files))
        told = as_json([checked.manifest_hash, parameters, profile])
        content = zlib.compress(pickle.dumps((whole, parameters, profile)))
        return cls(hashlib.sha256(told.encode()).hexdigest(), content)


@lru_cache(MOST_MODELS)
def model_of(bundle: Bundle | None) -> Model | None:
    """Return the model of a bundle, compiled if this machine has not yet done so."""
    if bundle is None:
        return None
    checked, parameters, profile = pickle.loads(zlib.decompress(bundle.content))
    checked = replace(checked, folder=snapshot(checked, cache_folder(None)))
    return model_from(checked, parameters, profile=profile)


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
            model = model_of(bundle)
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
