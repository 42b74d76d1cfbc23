"""`sweep` makes many runs, keeps each as a row of a store, and goes on where it was stopped."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..brief import brief
from ..checks import none_of, number, refusal, shown
from ..errors import SweepError
from ..model.model import Model
from .axes import Grid, Spread, plain
from .driver import Driver, Spent
from .groups import Entry, entries_of, groups_of
from .job import RUNS, STARTS, Job
from .points import Axes, axes_of
from .store import Row, Store

if TYPE_CHECKING:
    import pandas
    import xarray

WITHOUT = ("watch", "threads", "parameters")  # settings of a run that a sweep has itself


@dataclass(frozen=True)
class Status:
    """How far a sweep is: points in all, of these with rows, and those whose run failed."""

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
    """The rows of a sweep: ``sweep[k]`` is that of point k, a dict of its values and outputs.

    spent: what this call took: wall_s and busy_s (of all workers) in s, blocks, points, workers.
    """

    axes: Axes = field(repr=False)
    entries: Sequence[Entry] = field(repr=False)
    store: Store = field(repr=False)
    spent: Spent
    __repr__ = brief

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, k: int) -> dict[str, Any]:
        """Return the row of point k; KeyError where it has none yet."""
        entry = self.entries[range(len(self))[k]]
        found = self.store.rows([entry.key])
        if not found:
            raise KeyError(f"point {k} has no row yet")
        return row_of(k, entry, found[entry.key])

    def rows(self) -> list[dict[str, Any]]:
        """Return all rows that there are, by their points' order.

        Each has number, the point's values, the run's outputs, error (None where it went well) and
        seconds (s).
        """
        found = self.store.rows(entry.key for entry in self.entries)
        return [
            row_of(k, entry, found[entry.key])
            for k, entry in enumerate(self.entries)
            if entry.key in found
        ]

    def status(self) -> Status:
        """Return how far it is, as the store tells now."""
        known = self.store.known(entry.key for entry in self.entries)
        return Status(len(self), len(known), sum(not good for good in known.values()))

    def motion(self, k: int) -> Any:
        """Return the Trajectory, Plan or Identification of point k, run again; of a function, its
        "motion".

        Raises what the run raises, SweepError where a function has no motion.
        """
        from .bundles import model_of
        from .runs import run_point

        entry = self.entries[range(len(self))[k]]
        _, motion = run_point(entry.job, model_of(entry.bundle, entry.job), entry.point)
        if motion is None:
            raise SweepError(
                f"point {k}: its run returned no motion: let the function return it as "
                '"motion", besides its outputs'
            )
        return motion

    def view(self, k: int, path: str | PathLike[str] = "run.html") -> Path:
        """Write the page of point k, whose motion is made again; return its path."""
        page: Path = self.motion(k).view(path)
        return page

    def to_pandas(self) -> "pandas.DataFrame":
        """Return the rows as a table, a row a point; ExtraMissing without pandas."""
        from .tables import frame

        return frame(self.rows())

    def to_xarray(self) -> "xarray.Dataset":
        """Return the rows as a dataset: a dimension for each grid, "sample" for what is spread.

        Points without a row, and failed ones, are NaN.  ExtraMissing without xarray.
        """
        from .tables import dataset

        return dataset(self.axes, len(self), self.rows())

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the rows to a .parquet, .csv or .nc file, whole or not at all; return its path.

        Raises SweepError (another ending), ExtraMissing, NotWritten.
        """
        from .tables import write

        return write(self, path)


def row_of(k: int, entry: Entry, row: Row) -> dict[str, Any]:
    """Return a row as a dict."""
    outcome = {} if row.outcome is None else json.loads(row.outcome)
    told = {"error": row.error, "seconds": row.seconds}
    return {"number": k} | entry.point | outcome | told


def sweep(  # noqa: PLR0913 - the public face names all that it takes
    model: Model | str | PathLike[str] | None,
    over: Mapping[Any, Grid | Spread],
    run: str | Callable[..., Mapping[str, Any]] = "simulate",
    *,
    store: str | PathLike[str] | None = None,
    points: int | None = None,
    seed: int = 0,
    settings: Mapping[str, Any] | None = None,
    outputs: Sequence[str] | None = None,
    limit: float | None = None,
    executor: Any = None,
    of: Any = None,
    retry_failed: bool = False,
) -> Sweep:
    """Run a model at many points, keep a row of each, and go on where a call was stopped.

    model: a model, or a scene file or an example's name, or None for a function of points alone.
    over: axes by name, see ``grid``, ``random``, ``latin``, ``sobol``: of parameters; of a scene
    also keys of its table, such as "start.pitch" or "duration", and what its model is made of, such
    as "segments" and "links"; of a model also "q0", "v0" and settings.  points, seed: of the axes
    that are spread.
    run: "simulate", "plan", "identify", or a function of a module, f(model, point) or f(point) ->
    dict of plain data, to which it may add its Trajectory or Plan as "motion", for pages.
    settings: what else ``simulate``, ``plan`` or ``identify`` is to take, "q0" and "v0", or "data"
    and "markers", of a model included.
    outputs: of "simulate": "end_s", "q_end", "v_end", "kinetic_end_J", "potential_end_J", which are
    the default, and names of ``st.summary``; plans and identifications have their report.
    store: a file of SQLite on a local disk; None: in memory.  A row is known by the hash of model,
    run and point: a second call runs what is missing, and ``retry_failed`` what failed.
    limit: s that a point may take; it then fails, as one does that raises or whose process ends.
    executor: None, "processes", "processes:4", "dask" (a cluster on this machine), "dask:ADDRESS",
    "dask:FILE.json", or an executor of concurrent.futures.  Blocks of about a second are sent to
    it.  With None, flights without a limit run in this process for the first 3 s.
    of: plain data that a function's rows depend on besides, such as its version.

    Raises SweepError (what cannot be, workers that are gone), NotWritten (a full disk), ModelError,
    ExtraMissing.  All but failures of single points, which are rows.
    """
    found = _posed(model, over, run, (points, seed, settings, outputs, of), store)
    limit = None if limit is None else number("limit", limit, SweepError, above=0)
    with found.store.writing():
        known = found.store.known(entry.key for entry in found.entries)
        if retry_failed:
            found.store.forget(key for key, good in known.items() if not good)
            known = {key: good for key, good in known.items() if good}
        failed = sum(not good for good in known.values())
        name = model.name if isinstance(model, Model) else Path(model or _function(run)).stem
        driver = Driver(
            found.store,
            groups_of(list(found.entries), known),
            limit,
            _script(found.entries[0].job.pickled()),
            name,
            total=len(found),
            done=len(known),
            failed=failed,
            spent=found.spent,
        )
        driver.drive(executor)
    return found


def posed(model: Any, over: Any, run: Any, store: Any, **rest: Any) -> Sweep:
    """Return the rows that a store has of a sweep, and run nothing."""
    names = ("points", "seed", "settings", "outputs", "of")
    given = {"seed": 0} | rest
    return _posed(model, over, run, tuple(given.get(name) for name in names), store)


def _posed(model: Any, over: Any, run: Any, rest: tuple, store: Any) -> Sweep:
    """Return a sweep whose points are checked, on its store."""
    points, seed, settings, outputs, of = rest
    if isinstance(run, str):
        wrong = none_of("run", run, RUNS)
        if wrong:
            raise SweepError(f"{wrong}, or a function")
    axes = axes_of(over, points, seed)
    own = _settings(settings, run)
    job = Job(run, own, _outputs(outputs, run))
    job.identity()  # refuses functions that nobody else could find
    job.pickled()
    axes, entries = entries_of(model, axes, job, plain("of", of))
    return Sweep(axes, entries, Store(store), Spent())


def _settings(settings: Any, run: Any) -> dict[str, Any]:
    """Return the settings of a run."""
    if not isinstance(settings, Mapping | None):
        raise refusal("settings", settings, "a table of arguments by name", SweepError)
    own = dict(settings or {})
    if own and not isinstance(run, str):
        raise SweepError(
            "settings: a function takes none: give it what it needs by functools.partial"
        )
    for name in WITHOUT:
        if name in own:
            raise SweepError(f"settings: {name}: the sweep's own to give: leave it out")
    for name in STARTS:
        if name in own:
            own[name] = plain(f"settings: {name}", own[name])
    return own


def _outputs(outputs: Any, run: Any) -> tuple[str, ...]:
    """Return the names of what a simulation is asked for."""
    from .runs import ENDS, OUTPUTS

    if run != "simulate":
        if outputs is not None:
            raise SweepError(
                f"outputs: value {shown(outputs)}: only simulations choose: leave it out"
            )
        return ()
    if outputs is None:
        return ENDS
    if isinstance(outputs, str) or not isinstance(outputs, Sequence) or not outputs:
        raise refusal("outputs", outputs, "a list of names", SweepError)
    for name in outputs:
        wrong = none_of("outputs", name, OUTPUTS)
        if wrong:
            raise SweepError(wrong)
    return tuple(outputs)


def _function(run: Any) -> str:
    """Return the name of a function."""
    while isinstance(run, partial):
        run = run.func
    return str(getattr(run, "__name__", type(run).__name__))


def _script(data: bytes) -> str | None:
    """Return the main program where a pickled job has functions of it, else None."""
    if b"__main__" not in data:
        return None
    script = getattr(sys.modules["__main__"], "__file__", None)
    if script is None:
        raise SweepError(
            "run: a function of an interactive session: write it to a module that other processes "
            "can import"
        )
    return str(Path(script).absolute())
