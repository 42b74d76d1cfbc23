"""The store of a sweep: a folder of Parquet files of rows for each sweep, or memory."""

import hashlib
import json
import math
import os
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from heapq import heappop, heappush
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from filelock import FileLock, Timeout

from serpentail_scene.messages import one_line

from ...basics.errors import SweepError
from ...basics.extras import needed
from ...basics.files import refuse_unusable, replacing
from .axis import as_json

MARK = "store.json"  # tells that a folder is a store
SPEC = "sweep.json"
LOCK = "lock"
FORMAT = 2
NAME = re.compile(r"\d{8}-\d{8}-\d+-\d+-[0-9a-f]{8}\.parquet")
IN_FOLDER = 100_000  # numbers of points whose files share a folder, so that folders stay small
AT_ONCE = 4096  # rows that are read together


class Row(NamedTuple):
    """Result of a point: its number, outcome (JSON) or the error in place of it, seconds."""

    number: int
    outcome: str | None
    error: str | None
    seconds: float


class Shard(NamedTuple):
    """Rows that are kept together: their first and last number, how many, how many failed."""

    first: int
    last: int
    size: int
    failed: int
    where: Any  # path of the file, or the rows themselves

    @classmethod
    def at(cls, path: str) -> "Shard":
        """Return the shard of a file, from its name."""
        first, last, size, failed = map(int, os.path.basename(path).split("-")[:4])
        return cls(first, last, size, failed, path)

    def numbers(self) -> np.ndarray:
        """Return the numbers of its rows."""
        if self.size == self.last - self.first + 1:
            return np.arange(self.first, self.last + 1)
        return np.array([row.number for row in self.rows()])

    def rows(self) -> Iterator[Row]:
        """Yield its rows; SweepError if its file cannot be read."""
        if not isinstance(self.where, str):
            yield from self.where
            return
        arrow, parquet, schema = parquet_library()
        try:
            with parquet.ParquetFile(self.where) as file:
                if not file.schema_arrow.equals(schema):
                    raise ValueError("it has other columns")
                for batch in file.iter_batches(AT_ONCE):
                    for row in map(Row, *(column.to_pylist() for column in batch.columns)):
                        if not (self.first <= row.number <= self.last and row.seconds >= 0):
                            raise ValueError(f"it has a row {row.number} of {row.seconds} s")
                        yield row
        except (OSError, ValueError, TypeError, arrow.ArrowException) as reason:
            raise SweepError(
                f"store: {self.where} cannot be read ({one_line(str(reason))}): delete it, and the "
                "same call makes its rows again"
            ) from None


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
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            held = FileLock(self.path / LOCK).acquire(timeout=0)
        except Timeout:
            raise SweepError(
                f"store: another process is writing {self.path}: wait for its end, look with "
                "--status, or name another folder"
            ) from None
        except OSError as reason:
            raise SweepError(f"store: {reason}: name another folder") from None
        with held:
            self._begin(self.path)
            yield

    def _begin(self, path: Path) -> None:
        """Mark the folder, take rows of sweeps that have the same, and find all rows."""
        _write(path / MARK, {"format": FORMAT})
        if not (self.folder / SPEC).exists():
            for other in sorted(path.glob(f"{self.folder.name[:16]}-*/{SPEC}")):
                self._adopt(other)
            _write(self.folder / SPEC, self.spec)
        self.look()

    def _adopt(self, other: Path) -> None:
        """Take the rows of another sweep that are rows of this one, too."""
        try:
            numbers_here = shared_numbers(json.loads(other.read_bytes()), self.spec)
            for shard in _accepted(other.parent, np.zeros(len(numbers_here), bool)):
                here = numbers_here[shard.numbers()].tolist()
                rows = [row._replace(number=k) for k, row in zip(here, shard.rows(), strict=True)]
                self.accept(row for row in rows if row.number >= 0 and not self.done[row.number])
        except (ArithmeticError, LookupError, MemoryError, RecursionError, TypeError, ValueError):
            raise SweepError(f"store: {other} is damaged: delete its folder") from None

    def look(self) -> None:
        """Find the rows that there are now."""
        if self.path is not None:
            self.done[:] = False
            self.shards = _accepted(self.folder, self.done)

    def accept(self, rows: Iterable[Row]) -> None:
        """Keep rows, whole or not at all; NotWritten if they cannot be written."""
        told = sorted(rows)
        if not told:
            return
        failed = sum(row.error is not None for row in told)
        shard = Shard(told[0].number, told[-1].number, len(told), failed, told)
        if self.path is not None:
            shard = self._written(shard)
        self.done[shard.numbers()] = True
        self.shards.append(shard)

    def _written(self, shard: Shard) -> Shard:
        """Return rows as a file."""
        arrow, parquet, schema = parquet_library()
        table = arrow.Table.from_pylist([row._asdict() for row in shard.where], schema)
        check = zlib.crc32(table["number"].to_numpy().tobytes())
        first, last, size, failed, _ = shard
        name = f"{first:08d}-{last:08d}-{size}-{failed}-{check:08x}.parquet"
        path = self.folder / f"{first // IN_FOLDER:03d}" / name
        with replacing(path) as part:
            parquet.write_table(table, part, compression="zstd")
        return shard._replace(where=str(path))

    @property
    def failed(self) -> int:
        """How many rows tell of a failure."""
        return sum(shard.failed for shard in self.shards)

    def rows(self) -> Iterator[Row]:
        """Yield all rows in the order of their numbers; few files are open at a time."""
        opened: list[tuple[Row, Iterator[Row]]] = []  # a heap of the next row of each
        for shard in [*sorted(self.shards, key=lambda shard: shard[:4]), None]:
            while opened and (shard is None or opened[0][0].number < shard.first):
                row, rest = heappop(opened)
                yield row
                if following := next(rest, None):
                    heappush(opened, (following, rest))
            if shard is not None:
                rest = shard.rows()
                heappush(opened, (next(rest), rest))

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
                self.accept(rows)
                if self.path is not None:
                    os.unlink(shard.where)
        self.done &= ~gone


def parquet_library() -> tuple[Any, Any, Any]:
    """Return what reads and writes rows, and their columns; ExtraMissing if it is missing."""
    arrow, parquet = needed("pyarrow", "parquet"), needed("pyarrow.parquet", "parquet")
    kinds = (arrow.int64(), arrow.string(), arrow.string(), arrow.float64())
    return arrow, parquet, arrow.schema(list(zip(Row._fields, kinds, strict=True)))


def _accepted(folder: Path, done: np.ndarray) -> list[Shard]:
    """Return the shards of a folder, and mark their rows as done.

    A kill while rows are forgotten leaves these in two files: the second one is passed over.
    """
    accepted = []
    paths = [path for path in folder.glob("[0-9]*/*") if NAME.fullmatch(path.name)]
    for shard in map(Shard.at, sorted(map(str, paths))):
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
    """Write plain data as JSON, unless the file is there."""
    if not path.exists():
        with replacing(path) as part:
            part.write_text(as_json(value), encoding="utf-8")


def shared_numbers(old: Mapping[str, Any], new: Mapping[str, Any]) -> np.ndarray:
    """Return the numbers that the points of an old sweep have in a new one; -1: none.

    Both sweeps are told by their "spec", see ``pose``. Of fewer or more samples the first ones are
    the same, but not those of a Latin hypercube.
    """
    places: list[dict] = []
    for spec in (old, new):
        places.append({tuple(names): rows for names, rows in spec["grids"]})
        places[-1] |= {(): np.arange(spec["points"])} if spec["spreads"] else {}
    sizes = [tuple(map(len, each.values())) for each in places]
    latin = any(kind == "latin" for _, (kind, *_) in new["spreads"])
    same = ["spreads", *(["seed"] if new["spreads"] else []), *(["points"] if latin else [])]
    found = np.full(math.prod(sizes[0]), -1)
    if places[0].keys() != places[1].keys() or any(old[name] != new[name] for name in same):
        return found

    # the numbers of the new sweep, with its axes in the order of the old one's
    order = [list(places[1]).index(names) for names in places[0]]
    models, others = (
        np.broadcast_to(np.array(spec["models"]), size)
        for spec, size in zip((old, new), sizes, strict=True)
    )
    numbers = np.arange(others.size).reshape(sizes[1]).transpose(order)
    both = [np.intersect1d(places[0][k], places[1][k], True, True)[1:] for k in places[0]]
    here, there = (np.ix_(*each) for each in zip(*both, strict=True))
    shared = models[here] == others.transpose(order)[there]
    found.reshape(sizes[0])[here] = np.where(shared, numbers[there], -1)
    return found
