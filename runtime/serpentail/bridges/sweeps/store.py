"""The store of a sweep: a folder with a folder of shards for each sweep, or memory."""

import hashlib
import json
import os
import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from ...basics.errors import SweepError
from ...basics.files import refuse_unusable, replacing
from .axis import as_json
from .shards import NAME, Row, Shard, ShardFolder, in_order, parquet_library

MARK = "store.json"  # tells that a folder is a store, and which one
SPEC = "sweep.json"
LOCK = "lock"
FORMAT = 2


class Store:
    """The rows of one sweep, in its folder of a store, or in memory if the path is None.

    spec: plain data on which the rows depend, which tells one sweep from others; "family" is what
    sweeps have in common whose rows can be the same. One process writes at a time, any number may
    read. An existing row is never replaced. ``look`` finds the rows, as ``writing`` does.
    """

    def __init__(self, path: str | os.PathLike[str] | None, spec: Mapping[str, Any], total: int):
        self.path = None if path is None else Path(path).absolute()
        self.spec = json.loads(as_json(spec))
        self.shards: list[Shard] = []
        self.done = np.zeros(total, bool)
        if self.path is not None:
            parquet_library()
            _refuse_other(self.path)
            family, sweep = (
                hashlib.sha256(as_json(x).encode()).hexdigest()[:16] for x in (spec["family"], spec)
            )
            self.folder = self.path / f"{family}-{sweep}"

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Be the one process that writes; SweepError if another is."""
        if self.path is None:
            yield
            return
        lock = FileLock(self.path / LOCK)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock.acquire(timeout=0)
        except Timeout:
            raise SweepError(
                f"store: another process is writing {self.path}: wait for its end, look with "
                "--status, or name another folder"
            ) from None
        except OSError as reason:
            raise SweepError(f"store: {reason}: name another folder") from None
        try:
            self._begin(self.path)
            yield
            # the shards of workers that were thought to be lost: others have their rows
            for path in set(_files(self.folder)) - {shard.where for shard in self.shards}:
                Path(path).unlink(missing_ok=True)
        finally:
            lock.release()

    def _begin(self, path: Path) -> None:
        """Mark the folder, take rows of sweeps that have the same, and find all rows."""
        if not (path / MARK).exists():
            _write(path / MARK, {"format": FORMAT, "id": secrets.token_hex(8)})
        if not (self.folder / SPEC).exists():
            for other in sorted(path.glob(f"{self.folder.name[:16]}-*/{SPEC}")):
                self._adopt(other)
            _write(self.folder / SPEC, self.spec)
        self.look()

    def _adopt(self, other: Path) -> None:
        """Take the rows of another sweep that are rows of this one, too."""
        try:
            total, numbers_here = adopted_numbers(json.loads(other.read_bytes()), self.spec)
        except (ArithmeticError, LookupError, MemoryError, RecursionError, TypeError, ValueError):
            raise SweepError(f"store: {other} is damaged: delete its folder") from None
        for shard in _accepted(other.parent, np.zeros(total, bool)):
            rows = [
                row._replace(number=number)
                for row, number in zip(
                    shard.rows(), numbers_here(shard.numbers()).tolist(), strict=True
                )
                if number >= 0 and not self.done[number]
            ]
            if rows:
                self.accept(Shard.of(sorted(rows)))

    @property
    def place(self) -> ShardFolder | None:
        """Return where workers write shards; None: in memory."""
        if self.path is None:
            return None
        marked = self.path / MARK
        return ShardFolder(self.folder, marked, marked.read_bytes())

    def look(self) -> None:
        """Find the rows that there are now."""
        if self.path is not None:
            self.done[:] = False
            self.shards = _accepted(self.folder, self.done)

    def accept(self, shard: Shard) -> None:
        """Take notice of a shard, and write it if that was not done."""
        if self.path is not None and not isinstance(shard.where, str):
            shard = shard.written(self.folder)
        self.done[shard.numbers()] = True
        self.shards.append(shard)

    @property
    def failed(self) -> int:
        """How many rows tell of a failure."""
        return sum(shard.failed for shard in self.shards)

    def rows(self) -> Iterator[Row]:
        """Yield all rows in the order of their numbers."""
        return in_order(self.shards)

    def row(self, number: int) -> Row | None:
        """Return the row of a number; None if it has none."""
        near = (shard for shard in self.shards if shard.first <= number <= shard.last)
        return next((row for shard in near for row in shard.rows() if row.number == number), None)

    def forget(self, numbers: Sequence[int] | None = None) -> None:
        """Delete rows, by default those of failures, so that they are made again."""
        gone = np.zeros(len(self.done), bool)
        if numbers is None:
            failures = (shard for shard in self.shards if shard.failed)
            numbers = [r.number for shard in failures for r in shard.rows() if r.error is not None]
        gone[numbers] = True
        for shard in list(self.shards):
            if not gone[shard.first : shard.last + 1].any():
                continue
            rows = [row for row in shard.rows() if not gone[row.number]]
            if len(rows) < shard.size:
                self.shards.remove(shard)
                if rows:
                    self.accept(Shard.of(rows))
                if self.path is not None:
                    os.unlink(shard.where)
        self.done &= ~gone


def _files(folder: Path) -> list[str]:
    """Return the paths of shards in a folder, in the order of their first numbers."""
    paths: list[str] = []
    for inner in folder.glob("[0-9]*"):
        with os.scandir(inner) as entries:
            paths += [entry.path for entry in entries if NAME.fullmatch(entry.name)]
    return sorted(paths)


def _accepted(folder: Path, done: np.ndarray) -> list[Shard]:
    """Return the shards of a folder but those that have rows of others, and mark rows as done."""
    accepted = []
    for shard in map(Shard.at, _files(folder)):
        numbers = shard.numbers()
        if not done[numbers].any():
            done[numbers] = True
            accepted.append(shard)
    return accepted


def _refuse_other(path: Path) -> None:
    """SweepError if a path is that of anything but a store or a place for one."""
    try:
        if path.is_file():
            raise SweepError(
                f"store: {path} is a file, of an earlier version or of another program: a store "
                "is a folder: name another"
            )
        names = {each.name for each in path.iterdir()} if path.is_dir() else set()
        if names and not names & {MARK, LOCK}:
            raise SweepError(f"store: {path} is a folder of other files: name another")
        refuse_unusable(path)
    except OSError as reason:
        raise SweepError(f"store: {reason}: name another folder") from None


def _write(path: Path, value: Any) -> None:
    """Write plain data as JSON."""
    with replacing(path) as part:
        part.write_text(as_json(value), encoding="utf-8")


def adopted_numbers(
    old: Mapping[str, Any], new: Mapping[str, Any]
) -> tuple[int, Callable[[np.ndarray], np.ndarray]]:
    """Return how many points an old sweep has, and what finds their numbers in a new one.

    It returns -1 for points that the new sweep does not have. Both sweeps are told by their "spec",
    see ``pose``.
    """
    old_sizes, new_sizes = _sizes(old), _sizes(new)
    old_models, new_models = (
        np.broadcast_to(np.array(spec["models"]), sizes)
        for spec, sizes in ((old, old_sizes), (new, new_sizes))
    )
    old_axes = {tuple(names): k for k, (names, _) in enumerate(old["grids"])}
    possible = {tuple(names) for names, _ in new["grids"]} == old_axes.keys()
    possible = possible and all(old[name] == new[name] for name in _same(new))

    # for each new axis: which old one it was, and the new place of each old place
    axes = []
    for names, rows in new["grids"] if possible else ():
        k = old_axes[tuple(names)]
        places = {row: place for place, row in enumerate(rows)}
        axes.append((k, np.array([places.get(row, -1) for row in old["grids"][k][1]])))
    if new["spreads"]:
        samples = np.arange(old["points"])
        axes.append((-1, np.where(samples < new["points"], samples, -1)))

    def numbers_in_new(numbers: np.ndarray) -> np.ndarray:
        if not possible:
            return np.full(len(numbers), -1)
        places = np.unravel_index(numbers, old_sizes)
        moved = [new_places[places[k]] for k, new_places in axes]
        inside = tuple(np.maximum(x, 0) for x in moved)
        there = np.all([x >= 0 for x in moved], axis=0)
        there &= old_models[places] == new_models[inside]
        return np.where(there, np.ravel_multi_index(inside, new_sizes), -1)

    return int(np.prod(old_sizes)), numbers_in_new


def _sizes(spec: Mapping[str, Any]) -> tuple[int, ...]:
    """Return how many places each axis has."""
    grids = tuple(len(rows) for _, rows in spec["grids"])
    return (*grids, spec["points"]) if spec["spreads"] else grids


def _same(spec: Mapping[str, Any]) -> list[str]:
    """Return what another sweep must have equal so that equal samples have equal numbers."""
    names = ["spreads", "seed"] if spec["spreads"] else ["spreads"]
    latin = any(kind == "latin" for _, (kind, *_) in spec["spreads"])
    return [*names, "points"] if latin else names
