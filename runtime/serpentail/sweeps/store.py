"""The rows of a sweep in an SQLite file; each has a key made of all that it depends on."""

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock, Timeout

from ..checks import one_line
from ..errors import NotWritten, SweepError
from ..files import refuse_unwritable

FORMAT = 0x53525031  # of this file, in its header
TABLE = (
    "create table if not exists rows (key text primary key, point text not null, outcome text, "
    "error text, seconds real not null) without rowid"
)
STORED = TABLE.replace("create table if not exists", "CREATE TABLE")  # as SQLite keeps it
INSERT = "insert into rows values (?, ?, ?, ?, ?) on conflict (key) do nothing"
IN_ONE_QUERY = 500


class Row(NamedTuple):
    """Result of a point: its outcome, or the error in place of it; seconds that it took."""

    key: str
    point: str  # JSON
    outcome: str | None  # JSON
    error: str | None
    seconds: float


class Store:
    """Rows in a file, or in memory if the path is None.

    One process writes at a time, any number may read. An existing row is never replaced.
    """

    def __init__(self, path: str | PathLike[str] | None):
        self.path = None if path is None else Path(path)
        if self.path is not None:
            try:
                refuse_unwritable(self.path)
                self.path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as reason:
                raise SweepError(f"store: {reason}: name another file") from None
        with self._told():
            # blocks finish in any thread, but one thread at a time writes
            self.base = sqlite3.connect(self.path or ":memory:", check_same_thread=False)
            (found,) = self.base.execute("pragma application_id").fetchone()
            tables = self.base.execute("select sql from sqlite_master").fetchall()
            if tables and found != FORMAT:
                raise SweepError(f"store: {self.path} is another program's: name another file")
            if not tables:
                self._begin()
            elif tables != [(STORED,)]:  # a view or a trigger would run its own statements
                raise self.damaged("it has other tables")

    def _begin(self) -> None:
        """Make an empty store."""
        self.base.execute("pragma journal_mode = wal")
        with self.base:
            self.base.execute(TABLE)
            self.base.execute(f"pragma application_id = {FORMAT}")

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Be the one process that writes; SweepError if another is."""
        if self.path is None:
            yield
            return
        try:
            with FileLock(self.path.with_name(f".{self.path.name}.lock"), timeout=0):
                self.base.execute("pragma synchronous = normal")
                yield
        except Timeout:
            raise SweepError(
                f"store: another process is writing {self.path}: wait for its end, look with "
                "--status, or name another file"
            ) from None

    def add(self, rows: Iterable[Row]) -> None:
        """Write rows, all or none of them; NotWritten if the disk refuses."""
        with self._told(), self.base:
            self.base.executemany(INSERT, rows)

    def known(self, keys: Iterable[str]) -> dict[str, bool]:
        """Return which of the keys have rows, and whether each went well."""
        wanted = set(keys)
        with self._told():
            rows = self.base.execute("select key, error is null from rows")
            return {key: bool(good) for key, good in rows if key in wanted}

    def rows(self, keys: Iterable[str]) -> dict[str, Row]:
        """Return the rows that there are of some keys."""
        wanted = list(keys)
        found: dict[str, Row] = {}
        for first in range(0, len(wanted), IN_ONE_QUERY):
            part = wanted[first : first + IN_ONE_QUERY]
            marks = ",".join("?" * len(part))
            query = f"select key, point, outcome, error, seconds from rows where key in ({marks})"
            with self._told():
                found |= {row[0]: Row(*row) for row in self.base.execute(query, part)}
        return found

    def forget(self, keys: Iterable[str]) -> None:
        """Delete rows, so that they are made again."""
        with self._told(), self.base:
            self.base.executemany("delete from rows where key = ?", [(key,) for key in keys])

    def close(self) -> None:
        """Close the file, after writing SQLite's log into it."""
        self.base.close()

    def damaged(self, reason: str) -> SweepError:
        """Return the error about a file that holds what no sweep has written."""
        remedy = "restore a copy, or name another file"
        return SweepError(f"store: {self.path} is damaged ({one_line(reason)}): {remedy}")

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Turn errors of SQLite into one line."""
        try:
            yield
        except (sqlite3.DatabaseError, UnicodeDecodeError) as reason:
            name = getattr(reason, "sqlite_errorname", "")
            if name == "SQLITE_NOTADB":
                raise SweepError(f"store: {self.path} is not a store: name another file") from None
            if name.startswith("SQLITE_CORRUPT") or not name:  # none: texts that are not UTF-8
                raise self.damaged(f"{reason}") from None
            raise NotWritten(
                f"store: {self.path} is not written ({reason}): make room, or mend the disk; its "
                "rows are intact, and the same call resumes from them"
            ) from reason


def as_json(value: Any) -> str:
    """Return plain data as JSON, the same text for the same data."""
    return _ENCODER.encode(value)


_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"))
