"""``Sweep``: the rows of a sweep, from its store."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...basics.errors import SweepError
from ...basics.extras import needed
from ...basics.near_names import NearNames
from ...basics.short_repr import brief
from .points import Axes, checked_row
from .pose import Posed
from .processes import model_of
from .runs import run_point
from .store import AT_ONCE, Store
from .tables import dataset, flat, write

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


@dataclass
class Spent:
    """What a sweep took: elapsed seconds, seconds of all workers, blocks, points, workers; and how
    many points hung.
    """

    wall_s: float = 0.0
    busy_s: float = 0.0
    blocks: int = 0
    points: int = 0
    workers: int = 1
    hung: int = 0


@dataclass(frozen=True, eq=False)
class Sweep(NearNames):
    """The rows of a sweep; ``sweep[k]`` is the row of point k, and ``len(sweep)`` their number.

    A row is a dict of the point's values and the run's outputs. Rows are read when they are asked
    for: ``for row in sweep`` holds some thousands of them at a time, ``rows()`` all.

    Attributes
    ----------
    posed : Posed
        The checked axes, job and models.
    store : Store
        Where the rows are kept.
    spent : Spent
        What this call took: ``wall_s`` and ``busy_s`` (s, of all workers), ``blocks``, ``points``,
        ``workers``, and ``hung``: the number of points that were given up without a row.
    """

    posed: Posed = field(repr=False)
    store: Store = field(repr=False)
    spent: Spent = field(default_factory=Spent)
    __repr__ = brief

    @property
    def axes(self) -> Axes:
        """Return the axes of the sweep, in SI."""
        return self.posed.axes

    def __len__(self) -> int:
        return len(self.axes)

    def __getitem__(self, k: int) -> dict[str, Any]:
        """Return the row of point k; KeyError if it has none yet, IndexError if k is no point."""
        for row in self._rows([range(len(self))[k]]):
            return row
        raise KeyError(f"point {k} has no row yet")

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield all rows that exist, in the order of their points."""
        return self._rows(None)

    def _rows(self, numbers: Sequence[int] | None) -> Iterator[dict[str, Any]]:
        """Yield the rows of some points, by default of all; SweepError if one is damaged."""
        rows = self.store.rows(numbers)
        while some := list(islice(rows, AT_ONCE)):
            pairs = zip(some, self.axes.at([row.number for row in some]), strict=True)
            with self.store.reading():
                for row, point in pairs:
                    outcome = json.loads(row.outcome or "{}")
                    told = {"error": row.error, "seconds": row.seconds}
                    yield {"number": row.number} | point | outcome | told

    def rows(self) -> list[dict[str, Any]]:
        """Return all rows that exist, in the order of their points.

        Each has "number", the point's values, the run's outputs, "error" (None for success) and
        "seconds" (s).
        """
        return list(self)

    def status(self) -> Status:
        """Return how far the sweep is, from the store's present content."""
        self.store.look()
        return Status(len(self), int(self.store.done.sum()), int(self.store.failed.sum()))

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
        number = checked_row(k, len(self))
        model = model_of(self.posed.bundles[self.posed.models.flat[number]])
        _, motion = run_point(self.posed.job, model, self.axes.at([number])[0])
        if motion is None:
            raise SweepError(
                f"point {k}: its run returned no motion: let the function return it as "
                '"motion", besides its outputs'
            )
        return motion

    def view(self, k: int, path: str | PathLike[str] = "run.html") -> Path:
        """Run a point again, write a page of its motion (.html), and return the file's path.

        SweepError as of ``motion``, ViewError as of ``serpentail.view``.
        """
        page: Path = self.motion(k).view(path)
        return page

    def to_pandas(self) -> "pandas.DataFrame":
        """Return the rows as a pandas table with one row for each point.

        ExtraMissing unless the extra "pandas" is installed.
        """
        pandas = needed("pandas", "pandas")
        return pandas.DataFrame([flat(row) for row in self])

    def to_xarray(self) -> "xarray.Dataset":
        """Return the rows as an xarray dataset.

        It has a dimension for each grid, and "sample" for all other axes together. Points that
        failed or have no row are NaN. ExtraMissing unless the extra "xarray" is installed.
        """
        return dataset(self)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the rows to a .parquet, .csv or .nc file, whole or not at all; return its path.

        A .nc file is made in memory, others are not. SweepError if the suffix is another one,
        ExtraMissing if the library for this file is not installed, NotWritten if it cannot be
        written.
        """
        return write(self, path)
