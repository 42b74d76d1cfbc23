"""``sweep``: makes many runs, keeps each as a row of a store, and resumes where it was stopped."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from ...basics.checks import none_of, number, one_of, refusal
from ...basics.errors import SweepError
from ...model.model import Model
from ...model.state import State
from .axis import Grid, Spread, plain
from .driver import Driver
from .points import axes_of
from .pose import pose
from .result import Sweep
from .runs import ENDS, OUTPUTS, RUNS, STARTS, Job
from .store import Store

WITHOUT = ("watch", "threads", "parameters")  # settings of a run that a sweep has itself


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
    """Run a model at many points; keep a row of each, and resume where a call was stopped.

    Parameters
    ----------
    model : Model, str, path or None
        A model; a scene file or an example's name; None for a function of points alone.
    over : mapping
        Axes by name; see ``grid``, ``random``, ``latin``, ``sobol``. A name is a parameter; with
        a scene also a key of its table, such as "start.pitch" or "duration", or of its model,
        such as "segments" and "links"; with a model also "q0", "v0" or a setting.
    run : {"simulate", "plan", "identify"} or callable, default "simulate"
        What to run. A function f(model, point) or f(point) returns a dict of plain data. It may
        add its Trajectory or Plan as "motion", for pages.
    store : str or path, optional
        File for the rows, of SQLite. Default: in memory. A second call with the same model, run
        and points runs only what is missing.
    points : int, optional
        Number of points of the axes made by ``random``, ``latin`` or ``sobol``.
    seed : int, default 0
        Seed of these points.
    settings : mapping, optional
        Further arguments of ``simulate``, ``plan`` or ``identify``. With a model they include
        "q0" and "v0", or a ``State`` as "q0", or "data" (files of marker tracks) and "markers".
    outputs : sequence of str, optional
        Outputs of "simulate": "end_s", "q_end", "v_end", "kinetic_end_J", "potential_end_J"
        (together the default), or names of ``summary``. The outputs of "plan" and "identify" are
        their reports.
    limit : float, optional
        Processor time that a point may take (s). A point fails if it takes more, if its run raises
        an error, or if its process ends. A point that takes 30 times as long on the clock hangs:
        it gets no row, so that the next call runs it again.
    executor : str or concurrent.futures.Executor, optional
        Where the points run: "processes", "processes:4", "dask" (a cluster on this machine),
        "dask:ADDRESS", "dask:FILE.json", or an executor. They are sent in blocks of one
        second of work or more. Default: worker processes, but flights without a limit run in this
        process for the first 3 s.
    of : plain data, optional
        What else the rows of a function depend on, such as its version.
    retry_failed : bool, default False
        Whether to run failed points again.

    Returns
    -------
    Sweep
        The rows.

    Raises
    ------
    SweepError
        An argument is wrong, or the worker processes are gone.
    NotWritten
        The store cannot be written.
    ModelError, ExtraMissing
        A model cannot be made, or a library is not installed. Failures of single points do not
        raise errors; they are rows.

    Examples
    --------
    >>> import serpentail as st
    >>> over = {"tail_mass": st.grid(["2 g", "3 g"]), "start.pitch": st.random(-1.0, 1.0)}
    >>> sweep = st.sweep("kick", over, points=8, store="kick.rows")  # doctest: +SKIP
    >>> sweep.to_pandas()  # doctest: +SKIP
    """
    rows = posed(
        model, over, run, store, points=points, seed=seed, settings=settings, outputs=outputs, of=of
    )
    limit = None if limit is None else number("limit", limit, SweepError, unit="s", above=0)
    of_function = getattr(run, "__name__", "sweep")
    name = model.name if isinstance(model, Model) else Path(model or of_function).stem
    with rows.store.writing():
        if retry_failed:
            rows.store.forget()
        Driver(rows, limit, name).drive(executor)
    return rows


def posed(  # noqa: PLR0913 - the arguments of ``sweep`` on which rows depend
    model: Any,
    over: Any,
    run: Any = "simulate",
    store: Any = None,
    *,
    points: Any = None,
    seed: Any = 0,
    settings: Any = None,
    outputs: Any = None,
    of: Any = None,
) -> Sweep:
    """Return a sweep with checked points; ``status`` finds the rows of its store. Run nothing."""
    wrong = isinstance(run, str) and none_of("run", run, RUNS)
    if wrong:
        raise SweepError(f"{wrong}, or a function")
    axes = axes_of(over, points, seed)
    job = Job(run, _settings(settings, run), _outputs(outputs, run))
    try:
        job.identity(), job.pickled()
    except SweepError:
        raise
    except Exception as reason:  # whatever a part of it raises
        raise SweepError(
            f"run, settings: they cannot be sent to another process ({reason}): take a function at "
            "the top of a module, and settings that can be pickled"
        ) from None
    problem = pose(model, axes, job, of)
    return Sweep(problem, Store(store, problem.keys))


def _settings(settings: Any, run: Any) -> dict[str, Any]:
    """Return the settings of a run."""
    if not isinstance(settings, Mapping | None):
        raise refusal("settings", settings, "a table of arguments by name", SweepError)
    checked = dict(settings or {})
    if checked and not isinstance(run, str):
        raise SweepError("settings: a function has none: pass what it needs by functools.partial")
    watched = getattr(checked.get("solver"), "watch", None) is not None  # of a plan
    for name in WITHOUT:
        if name in checked or (watched and name == "watch"):
            raise SweepError(f"settings: {name}: is set by the sweep: leave it out")
    if isinstance(checked.get("q0"), State):
        checked |= dict(zip(STARTS, checked["q0"], strict=True))
    return checked | {n: plain(f"settings: {n}", checked[n]) for n in STARTS if n in checked}


def _outputs(outputs: Any, run: Any) -> tuple[str, ...]:
    """Return the names of the outputs of a simulation; none for other runs."""
    if outputs is None:
        return ENDS if run == "simulate" else ()
    if run != "simulate":
        raise refusal("outputs", outputs, "run='simulate', or nothing here", SweepError)
    if isinstance(outputs, str) or not isinstance(outputs, Sequence) or not outputs:
        raise refusal("outputs", outputs, "a list of names", SweepError)
    return tuple(one_of("outputs", name, OUTPUTS, SweepError) for name in outputs)
