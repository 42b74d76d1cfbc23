"""Shards: parts of a sweep's rows in Parquet files, whose names tell which rows they have."""

import os
import re
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from serpentail_scene.messages import one_line

from ...basics.errors import SweepError
from ...basics.extras import needed
from ...basics.files import replacing

NAME = re.compile(r"(\d{8})-(\d{8})-(\d+)-(\d+)-[0-9a-f]{8}\.parquet")
IN_FOLDER = 100_000  # numbers of points whose shards share a folder, so that folders stay small
AT_ONCE = 4096  # rows that are read together


class Row(NamedTuple):
    """Result of a point: its number, outcome (JSON) or the error in place of it, seconds."""

    number: int
    outcome: str | None
    error: str | None
    seconds: float


class Shard(NamedTuple):
    """Rows that were written together: their first and last number, how many, how many failed."""

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

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "Shard":
        """Return rows, in the order of their numbers, as a shard in memory."""
        failed = sum(row.error is not None for row in rows)
        return cls(rows[0].number, rows[-1].number, len(rows), failed, rows)

    def written(self, folder: Path) -> "Shard":
        """Return it as a file, which is there whole or not at all; NotWritten if it cannot be."""
        arrow, parquet = parquet_library()
        schema = _schema(arrow)
        columns = list(zip(*self.where, strict=True))
        arrays = [arrow.array(x, kind.type) for x, kind in zip(columns, schema, strict=True)]
        check = zlib.crc32(np.array(columns[0], np.int64).tobytes())
        name = f"{self.first:08d}-{self.last:08d}-{self.size}-{self.failed}-{check:08x}.parquet"
        path = folder / f"{self.first // IN_FOLDER:03d}" / name
        with replacing(path) as part:
            table = arrow.Table.from_arrays(arrays, schema=schema)
            parquet.write_table(table, part, compression="zstd")
        return self._replace(where=str(path))

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
        arrow, parquet = parquet_library()
        try:
            with parquet.ParquetFile(self.where) as file:
                if not file.schema_arrow.equals(_schema(arrow)):
                    raise ValueError("it has other columns")
                for batch in file.iter_batches(AT_ONCE):
                    columns = (column.to_pylist() for column in batch.columns)
                    for row in map(Row, *columns):
                        if not (self.first <= row.number <= self.last and row.seconds >= 0):
                            raise ValueError(f"it has a row {row.number} of {row.seconds} s")
                        yield row
        except (OSError, ValueError, TypeError, arrow.ArrowException) as reason:
            raise SweepError(
                f"store: {self.where} cannot be read ({one_line(str(reason))}): delete it, and the "
                "same call makes its rows again"
            ) from None


@dataclass(frozen=True)
class ShardFolder:
    """Where workers write shards: a sweep's folder, and a file that tells its store from others.

    A worker that does not find this very store returns the rows to the driver.
    """

    folder: Path
    marked: Path
    mark: bytes

    def is_here(self) -> bool:
        """Tell if this process sees the store."""
        try:
            return self.marked.read_bytes() == self.mark
        except OSError:
            return False


def parquet_library() -> tuple[Any, Any]:
    """Return the modules that read and write shards; ExtraMissing if they are not installed."""
    return needed("pyarrow", "parquet"), needed("pyarrow.parquet", "parquet")


def _schema(arrow: Any) -> Any:
    """Return the names and types of a shard's columns."""
    kinds = (arrow.int64(), arrow.string(), arrow.string(), arrow.float64())
    return arrow.schema(list(zip(Row._fields, kinds, strict=True)))


def in_order(shards: Sequence[Shard]) -> Iterator[Row]:
    """Yield the rows of shards in order of their numbers; few files are open at a time."""
    opened: list[tuple[Row, Iterator[Row]]] = []  # a heap of the next row of each

    def push(rows: Iterator[Row]) -> None:
        row = next(rows, None)
        if row is not None:
            heappush(opened, (row, rows))

    for shard in [*sorted(shards, key=lambda shard: shard[:4]), None]:
        while opened and (shard is None or opened[0][0].number < shard.first):
            row, rows = heappop(opened)
            yield row
            push(rows)
        if shard is not None:
            push(shard.rows())
