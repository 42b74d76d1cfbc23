"""Parts of long studies as the rows of a sweep: a part is computed again only if its inputs
changed.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from serpentail.bridges.sweeps.sweep import posed
from serpentail.motion.trajectory import ARRAYS

Result = dict | list


@dataclass(frozen=True)
class Part:
    """A part of a study.

    make: returns its result, plain data; a function that can be pickled, without arguments. of:
    other inputs on which the result depends, plain data. files: files that it writes.
    """

    make: Callable[[], Result]
    of: dict
    files: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Maker:
    """Computes the part that a point of a sweep names."""

    study: str
    makes: Mapping[str, Callable[[], Result]]

    @property
    def __name__(self) -> str:
        """Return the name that progress reports show."""
        return self.study

    def __call__(self, point: dict) -> dict[str, str]:
        """Return the part's result as JSON, which may hold NaN here."""
        return {"result": json.dumps(self.makes[point["part"]]())}


def made(study: str, folder: Path, parts: Mapping[str, Part]) -> dict[str, Result]:
    """Return the results of parts by title.

    Parts that FOLDER/STUDY.rows does not have are computed, in as many processes as this one may
    use threads. Each becomes a row when it is finished. SerpentailError if a part failed, or if
    another process computes parts in the folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    over = {("part", "of"): st.grid([(title, part.of) for title, part in parts.items()])}
    run = Maker(study, {title: part.make for title, part in parts.items()})
    store = folder / f"{study}.rows"
    _forget_without_files(posed(None, over, run, store), parts)
    rows = st.sweep(None, over, run, store=store, executor="processes", retry_failed=True).rows()
    for row in rows:
        if row["error"]:
            raise st.SerpentailError(f"{row['part']}: {row['error']}")
    return {row["part"]: json.loads(row["result"]) for row in rows}


def _forget_without_files(found: st.Sweep, parts: Mapping[str, Part]) -> None:
    """Forget the results of parts whose files are gone, so that they are computed again."""
    gone = {title for title, part in parts.items() if not all(f.exists() for f in part.files)}
    points = enumerate(found.axes)
    with found.store.writing():
        found.store.forget([k for k, point in points if point["part"] in gone])


def digest(*sources: Path) -> str:
    """Return a hash of sources, files or folders, for the inputs of a part."""
    inside = [
        p
        for source in sources
        for p in (sorted(source.rglob("*")) if source.is_dir() else [source])
    ]
    files = [p for p in inside if p.suffix in (".py", ".jinja", ".c", ".h")]
    return hashlib.sha256(b"\0".join(p.read_bytes() for p in files)).hexdigest()[:16]


def as_lists(flight: st.Trajectory) -> dict[str, list]:
    """Return a flight as lists."""
    return {name: getattr(flight, name).tolist() for name in ARRAYS}


def as_flight(lists: dict[str, list]) -> st.Trajectory:
    """Return the flight of lists."""
    return st.Trajectory(**{name: np.array(values) for name, values in lists.items()})
