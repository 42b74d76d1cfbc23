"""``Sweep``: the rows of a sweep, from its store."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..brief import brief
from ..errors import SweepError
from .axes import Axes, checked_row
from .driver import Spent
from .groups import Entry
from .store import Row, Store

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True)
class Status:
    """How far a sweep is: points in all, points with rows, and points whose run failed."""

    points: int
    done: int
    failed: int

    def __str__(self) -> str:
        left = self.points - self.done
        return (
            f"{self.done} of {self.points} points done, {self.failed} of them failed, {left} left"
        )


@dataclass(frozen=True, eq=False)
class Sweep:
    """The rows of a sweep; ``sweep[k]`` is the row of point k, and ``len(sweep)`` their number.

    A row is a dict of the point's values and the run's outputs.

    Attributes
    ----------
    axes : Axes
        The axes of the sweep.
    entries : sequence of Entry
        The points, with the keys of their rows.
    store : Store
        Where the rows are kept.
    spent : Spent
        What this call took: ``wall_s`` and ``busy_s`` (s, of all workers), ``blocks``, ``points``
        and ``workers``.
    """

    axes: Axes = field(repr=False)
    entries: Sequence[Entry] = field(repr=False)
    store: Store = field(repr=False)
    spent: Spent
    __repr__ = brief

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, k: int) -> dict[str, Any]:
        """Return the row of point k; KeyError if it has none yet, IndexError if k is no point."""
        entry = self.entries[range(len(self))[k]]
        found = self.store.rows([entry.key])
        if not found:
            raise KeyError(f"point {k} has no row yet")
        return self._row(k, found[entry.key])

    def rows(self) -> list[dict[str, Any]]:
        """Return all rows that exist, in the order of their points.

        Returns
        -------
        list of dict
            Each has "number", the point's values, the run's outputs, "error" (None for success) and
            "seconds" (s).
        """
        found = self.store.rows(entry.key for entry in self.entries)
        return [
            self._row(k, found[entry.key])
            for k, entry in enumerate(self.entries)
            if entry.key in found
        ]

    def status(self) -> Status:
        """Return how far the sweep is, from the store's present content.

        Returns
        -------
        Status
            ``points``, ``done`` and ``failed``.
        """
        known = self.store.known(entry.key for entry in self.entries)
        return Status(len(self), len(known), sum(not good for good in known.values()))

    def motion(self, k: int) -> Any:
        """Run a point again and return its motion.

        Parameters
        ----------
        k : int
            Number of the point, from 0.

        Returns
        -------
        Trajectory, Plan or Identification
            The motion; of a function, what it returned as "motion".

        Raises
        ------
        SweepError
            There is no such point, or the function returned no motion.
        SerpentailError
            What the run raises.
        """
        from .bundles import model_of
        from .runs import run_point

        entry = self.entries[checked_row(k, len(self))]
        _, motion = run_point(entry.job, model_of(entry.bundle, entry.job), entry.point)
        if motion is None:
            raise SweepError(
                f"point {k}: its run returned no motion: let the function return it as "
                '"motion", besides its outputs'
            )
        return motion

    def view(self, k: int, path: str | PathLike[str] = "run.html") -> Path:
        """Run a point again and write a page of its motion.

        Parameters
        ----------
        k : int
            Number of the point, from 0.
        path : str or path, default "run.html"
            The .html file.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        SweepError, ViewError
            As of ``motion`` and ``serpentail.view``.
        """
        page: Path = self.motion(k).view(path)
        return page

    def to_pandas(self) -> "pandas.DataFrame":
        """Convert the rows to a pandas table with one row for each point; needs the extra "pandas".

        Returns
        -------
        pandas.DataFrame
            The table.

        Raises
        ------
        ExtraMissing
            pandas is not installed.
        """
        from .tables import frame

        return frame(self.rows())

    def to_xarray(self) -> "xarray.Dataset":
        """Convert the rows to an xarray dataset; needs the extra "xarray".

        Returns
        -------
        xarray.Dataset
            It has a dimension for each grid, and "sample" for all other axes together. Points that
            failed or have no row are NaN.

        Raises
        ------
        ExtraMissing
            xarray is not installed.
        """
        from .tables import dataset

        return dataset(self.axes, len(self), self.rows())

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the rows to a file, whole or not at all.

        Parameters
        ----------
        path : str or path
            A .parquet, .csv or .nc file.

        Returns
        -------
        Path
            The path of the file.

        Raises
        ------
        SweepError
            The suffix is another one.
        ExtraMissing
            The library for this file is not installed.
        NotWritten
            The file cannot be written.
        """
        from .tables import write

        return write(self, path)

    def _row(self, k: int, row: Row) -> dict[str, Any]:
        """Return the stored row of a point as a dict; SweepError if it is damaged."""
        try:
            outcome = {} if row.outcome is None else json.loads(row.outcome)
            told = {"error": row.error, "seconds": float(row.seconds)}
            return {"number": k} | self.entries[k].point | outcome | told
        except (RecursionError, TypeError, ValueError) as reason:
            raise self.store.damaged(f"the row of point {k}: {reason}") from None
