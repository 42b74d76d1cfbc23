"""The store of a sweep: a file of SQLite, or memory."""

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from serpentail_scene.messages import one_line

from ...basics.errors import NotWritten, SweepError

TABLE = "CREATE TABLE rows (point INTEGER, outcome TEXT, error TEXT, seconds REAL)"
FOUND = np.dtype([("place", np.int64), ("point", np.int64), ("failed", bool)])
AT_ONCE = 2048  # rows that are read together
FAULTS = (OSError, OverflowError, RecursionError, TypeError, ValueError, sqlite3.Error)
PATIENCE_S = 60  # s to wait while another process reads


class Row(NamedTuple):
    """Result of a point: its number, outcome (JSON) or the error in place of it, seconds."""

    number: int
    outcome: str | None
    error: str | None
    seconds: float


class Store:
    """The rows of one sweep, in a file that sweeps share, or in memory if the path is None.

    keys: for each point, a number (int64) that tells it from the points of all sweeps. ``done`` and
    ``failed`` tell for each point whether it has a row, and whether its run failed; ``look`` finds
    them, as ``writing`` does. One process writes at a time, any number may read.
    """

    def __init__(self, path: str | PathLike[str] | None, keys: np.ndarray):
        self.path = None if path is None else Path(path).absolute()
        self.keys = keys
        self.places = np.zeros(len(keys), np.int64)  # of rows in the file; 0: none
        self.failed = np.zeros(len(keys), bool)
        self.base: Any = None  # the open file
        if self.path is None or self.path.exists():
            self._open()

    @property
    def done(self) -> np.ndarray:
        """Tell for each point whether it has a row."""
        return self.places > 0

    def _open(self) -> bool:
        """Open the file, which need not exist; return whether it has a table of rows."""
        with self.reading():
            if self.base is None:
                self.base = sqlite3.connect(
                    self.path or ":memory:",
                    PATIENCE_S,
                    isolation_level=None,
                    check_same_thread=False,
                )
            tables = [sql for (sql,) in self.base.execute("SELECT sql FROM sqlite_master")]
            if tables not in ([], [TABLE]):
                raise ValueError("it is of another version or program")
        return bool(tables)

    @contextmanager
    def reading(self) -> Iterator[None]:
        """SweepError where the file is damaged, of another program, or out of reach."""
        try:
            yield
        except FAULTS as reason:
            raise SweepError(
                f"store: {str(self.path)!r:.300} cannot be used ({one_line(str(reason))}): needs a "
                "file that sweeps of this version made, or a new one"
            ) from None

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Be the one process that writes; SweepError if another is."""
        if self.path is not None:
            with self.reading():
                self.path.parent.mkdir(parents=True, exist_ok=True)
        known = self._open()
        try:
            self.base.execute("PRAGMA busy_timeout = 0")
            self.base.execute("BEGIN IMMEDIATE")
        except sqlite3.Error as reason:
            raise SweepError(
                f"store: {str(self.path)!r} cannot be written ({reason}): if another process is "
                "writing it, wait for its end, or look with --status; else name another file"
            ) from None
        try:
            self.base.execute(f"PRAGMA busy_timeout = {1000 * PATIENCE_S}")
            if not known:
                self._write(TABLE, [()])
            self.look()
            yield
        finally:
            if self.base.in_transaction:
                self.base.execute("ROLLBACK")

    def _write(self, sql: str, values: Iterable[Sequence]) -> None:
        """Run a statement with all values, or with none; NotWritten if the system refuses."""
        try:
            self.base.executemany(sql, values)
            self.base.execute("COMMIT")
            self.base.execute("BEGIN IMMEDIATE")  # so that no other process writes
        except sqlite3.Error as reason:
            raise NotWritten(
                f"{str(self.path)!r} is not written ({reason}): make room, or name another file"
            ) from reason

    def look(self) -> None:
        """Find the rows that there are now."""
        there = self.path is None or self.path.exists()
        if not (there and self._open()):
            return
        with self.reading():
            rows = self.base.execute("SELECT rowid, point, error IS NOT NULL FROM rows")
            found = np.fromiter(rows, FOUND)
        _, numbers, k = np.intersect1d(self.keys, found["point"], return_indices=True)
        self.places[:], self.failed[:] = 0, False
        self.places[numbers], self.failed[numbers] = found["place"][k], found["failed"][k]

    def accept(self, rows: Sequence[Row]) -> None:
        """Keep rows of points that have none, all or none; NotWritten if they cannot be written."""
        if not rows:
            return
        numbers = np.array([row.number for row in rows])
        ((last,),) = self.base.execute("SELECT ifnull(max(rowid), 0) FROM rows")
        places = np.arange(last + 1, last + 1 + len(rows))
        pairs = zip(places.tolist(), self.keys[numbers].tolist(), rows, strict=True)
        values = ((place, key, *row[1:]) for place, key, row in pairs)
        self._write(
            "INSERT INTO rows (rowid, point, outcome, error, seconds) VALUES (?, ?, ?, ?, ?)",
            values,
        )
        self.places[numbers] = places
        self.failed[numbers] = [row.error is not None for row in rows]

    def rows(self, numbers: Sequence[int] | None = None) -> Iterator[Row]:
        """Yield the rows of some points, by default of all, in the order of their numbers."""
        asked = np.arange(len(self.keys)) if numbers is None else np.asarray(numbers, np.int64)
        asked = asked[self.done[asked]]
        for part in np.split(asked, range(AT_ONCE, len(asked), AT_ONCE)):
            places = ",".join(map(str, self.places[part]))
            rows = f"SELECT point, outcome, error, seconds FROM rows WHERE rowid IN ({places})"
            with self.reading():
                found = {key: rest for key, *rest in self.base.execute(rows)}
            pairs = zip(part.tolist(), self.keys[part].tolist(), strict=True)
            yield from (Row(number, *found[key]) for number, key in pairs if key in found)

    def forget(self, numbers: Sequence[int] | None = None) -> None:
        """Delete rows, by default those of failures, so that they are made again."""
        gone = np.flatnonzero(self.failed) if numbers is None else np.asarray(numbers, np.int64)
        places = self.places[gone]
        self._write("DELETE FROM rows WHERE rowid = ?", ((place,) for place in places.tolist()))
        self.places[gone], self.failed[gone] = 0, False
