"""Parts of long studies: made side by side in processes, each kept as a file, and made anew only
where what it depends on changed.
"""

import hashlib
import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout

import serpentail as st
from serpentail.files import replacing
from serpentail.model.cores import VARIABLE, threads
from serpentail.motion.trajectory import ARRAYS
from serpentail.stages import Stage

Result = dict | list


@dataclass(frozen=True)
class Part:
    """A part of a study.

    make: returns its result, plain data; a function that can be pickled, without arguments.
    of: what else it depends on, plain data.  files: what it writes besides.
    """

    make: Callable[[], Result]
    of: dict
    files: tuple[Path, ...] = ()


def made(study: str, folder: Path, parts: Mapping[str, Part]) -> dict[str, Result]:
    """Return the results of parts by title; those that the folder has not are made, in as many
    processes as this one may use threads, and each is written at once: whole or not at all.

    SerpentailError where another process makes parts in the folder; what a part raises.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(folder / ".lock", timeout=0):
            return _made(study, folder, parts)
    except Timeout:
        raise st.SerpentailError(
            f"{folder}: another process makes parts of this study there: wait for its end, or give "
            "another folder"
        ) from None


def _made(study: str, folder: Path, parts: Mapping[str, Part]) -> dict[str, Result]:
    """Return the results of parts in a folder in which no other process makes any."""
    for left in folder.glob(".*.part"):  # by a process that was killed as it wrote
        left.unlink()
    paths = {title: folder / f"{title}.json" for title in parts}
    results = {title: _kept(paths[title], part) for title, part in parts.items()}
    missing = {paths[title]: part for title, part in parts.items() if results[title] is None}
    with Stage(study) as stage:
        for done, (path, result) in enumerate(_each(missing), 1):
            results[path.stem] = result
            stage.tell(done / len(missing), f"{path.stem} done")
    return results


def _each(missing: Mapping[Path, Part]) -> Iterator[tuple[Path, Result]]:
    """Make parts, and yield each as it is ready."""
    workers = min(threads(), len(missing))
    if workers < 2:
        yield from ((path, _written(path, part)) for path, part in missing.items())
        return
    # no fork: what runs in other threads, and what they have locked, would be copied
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, spawn, _begin) as pool:
        waiting = {pool.submit(_written, path, part): path for path, part in missing.items()}
        try:
            for future in as_completed(waiting):
                yield waiting[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():
                worker.terminate()
            raise


def _begin() -> None:
    """Make a process one that works for its parent: in one thread, and no longer than it lives."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    os.environ[VARIABLE] = "1"
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    multiprocessing.parent_process().join()
    os._exit(1)


def _written(path: Path, part: Part) -> Result:
    """Make a part and write it."""
    result = json.loads(json.dumps(part.make()))
    with replacing(path) as new:
        new.write_text(json.dumps({"of": part.of, "result": result}) + "\n")
    return result


def _kept(path: Path, part: Part) -> Result | None:
    """Return the result that a file has, where that was made of the same and all else is there."""
    with suppress(OSError, ValueError, KeyError, TypeError):  # none, or not a part
        found = json.loads(path.read_text())
        if found["of"] == json.loads(json.dumps(part.of)) and all(f.exists() for f in part.files):
            return found["result"]
    return None


def planned(model: st.Model, **settings) -> st.Plan:
    """Return a plan; KeyboardInterrupt where Ctrl-C ended its search: a part is whole or none."""
    plan = st.plan(model, **settings)
    if plan.report["stopped"] == "interrupt":
        raise KeyboardInterrupt
    return plan


def digest(*sources: Path) -> str:
    """Return a hash of Python sources and templates, files or folders: what makes a part is what it
    depends on, too.
    """
    inside = [
        p
        for source in sources
        for p in (sorted(source.rglob("*")) if source.is_dir() else [source])
    ]
    files = [p for p in inside if p.suffix in (".py", ".jinja")]
    return hashlib.sha256(b"\0".join(p.read_bytes() for p in files)).hexdigest()[:16]


def as_lists(flight: st.Trajectory) -> dict[str, list]:
    """Return a flight as lists."""
    return {name: getattr(flight, name).tolist() for name in ARRAYS}


def as_flight(lists: dict[str, list]) -> st.Trajectory:
    """Return the flight of lists."""
    return st.Trajectory(**{name: np.array(values) for name, values in lists.items()})
