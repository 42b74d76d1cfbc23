"""What a sweep runs at its points: one after another, or flights side by side."""

import hashlib
import json
import pickle
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np

from ...basics.checks import refusal, shown
from ...basics.errors import SerpentailError, SweepError
from ...model.model import Model
from ...motion.numbers import UNITS, finite_json, numbers_of
from ...motion.trajectory import Trajectory
from ...scenes.file import size_of
from ...scenes.overrides import changed
from ...scenes.scenario import Scenario
from ...scenes.simulate import scenario_of
from ...simulation.controllers.controller import Damping, TorqueCurve, TorqueTable
from ...simulation.rollouts import Rollouts
from ...simulation.start import INTERVALS
from .points import Point
from .store import Row

RUNS = ("simulate", "plan", "identify")
STARTS = ("q0", "v0")
DATA = "data"  # of an identification: its files of marker tracks
ENDS = ("end_s", "q_end", "v_end", "kinetic_end_J", "potential_end_J")  # outputs by default
OUTPUTS = (*ENDS, *UNITS)
TOGETHER = 2048  # flights at once, whose motions are held
MOST_TEXT = 2000  # characters of an error
SHARED = (type(None), Damping, TorqueTable, TorqueCurve)  # controllers that any parameters suit
Outcome = tuple[str | None, str | None]  # JSON, or the error in place of it


@dataclass(frozen=True)
class Job:
    """What is run: one of RUNS, or a function of a model and a point, or of a point alone.

    settings: of st.simulate, st.plan or st.identify. outputs: names of a simulation's outputs.
    table, phases, parent: of a scene; a model has no table. parent is the folder of the files that
    are named: the scene's, or the one where the sweep was called. built: names that the model was
    built with. keys: names of keys of the table, or of settings.
    """

    run: str | Callable[..., Any]
    settings: Mapping[str, Any] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    table: Mapping[str, Any] | None = None
    phases: Sequence[Mapping] = ()
    parent: str = ""
    built: frozenset[str] = frozenset()
    keys: frozenset[str] = frozenset()

    def parameters_of(self, point: Point) -> Point:
        """Return the parameters of the model that a point has."""
        return {k: value for k, value in point.items() if k not in self.built | self.keys}

    def arguments_of(self, point: Point) -> dict[str, Any]:
        """Return the table of a point, or the settings of one where the job has no table."""
        keys = {name: value for name, value in point.items() if name in self.keys}
        return {**self.settings, **keys} if self.table is None else changed(self.table, keys)

    def recordings(self, point: Point) -> list[Any]:
        """Return the trials of a point: paths of files, whole, and tracks as they were given."""
        data = point.get(DATA, self.settings.get(DATA))
        trials = data if isinstance(data, list | tuple) else [data]
        return [Path(self.parent, x) if isinstance(x, str | PathLike) else x for x in trials]

    def digest_of(self, point: Point) -> str:
        """Return a hash of the content of a point's files; SweepError if one cannot be read."""
        content = hashlib.sha256()
        for path in self.recordings(point):
            if isinstance(path, Path):
                try:
                    content.update(hashlib.sha256(path.read_bytes()).digest())
                except OSError as reason:
                    raise SweepError(
                        f"{DATA}: {shown(str(path))}: it cannot be read ({reason.strerror}): needs "
                        "files of marker tracks"
                    ) from None
        return content.hexdigest()

    def pickled(self) -> bytes:
        """Return it as bytes, with functions of the main program."""
        content: bytes = cloudpickle.dumps(self)
        return content

    def identity(self) -> str:
        """Return what rows depend on besides the model and the point; objects as digests."""
        told = [_name_of(self.run), self.settings, self.outputs, self.table, self.phases]
        return json.dumps(
            told, sort_keys=True, default=lambda x: hashlib.sha256(pickle.dumps(x)).hexdigest()
        )


def _name_of(run: Any) -> Any:
    """Return the name of a run; of a partial function, with its arguments."""
    if isinstance(run, str):
        return run
    if isinstance(run, partial):
        return [_name_of(run.func), run.args, run.keywords]
    where = run if hasattr(run, "__qualname__") else type(run)  # an object that is called
    if not callable(run) or "<" in where.__qualname__:  # a lambda, or a function in a function
        needs = f"{', '.join(map(repr, RUNS))}, or a function at the top of a module"
        raise refusal("run", run, needs, SweepError)
    return f"{where.__module__}.{where.__qualname__}"


def run_points(job: Job, model: Model | None, points: Mapping[int, Point]) -> Iterator[list[Row]]:
    """Yield the rows of points by their numbers, in their order: one at a time, or many at once."""
    left = iter(points.items())
    while part := dict(islice(left, TOGETHER)):
        begun, outcomes = time.perf_counter(), None
        if len(part) > 1 and model is not None and job.run == "simulate":
            # where this fails, the point at fault shows one by one
            with suppress(SerpentailError, TypeError, ValueError):
                outcomes = _side_by_side(job, model, list(part.values()))
        if outcomes is not None:
            seconds = (time.perf_counter() - begun) / len(part)
            pairs = zip(part, outcomes, strict=True)
            yield [Row(number, *outcome, seconds) for number, outcome in pairs]
            continue
        for number, point in part.items():
            begun = time.perf_counter()
            try:
                outcome, error = _as_text(run_point(job, model, point)[0]), None
            except Exception as reason:  # a failure is a row, too
                outcome, error = None, _error_text(reason)
            yield [Row(number, outcome, error, time.perf_counter() - begun)]


def run_point(job: Job, model: Model | None, point: Point) -> tuple[dict[str, Any], Any]:
    """Return the outcome of a point, and its motion, plan or other object with a page, or None."""
    if model is not None:
        model = model.with_parameters(**job.parameters_of(point))
    if not isinstance(job.run, str):
        outcome = job.run(point) if model is None else job.run(model, point)
        if not isinstance(outcome, dict):
            raise SweepError(
                f"run: it returned a {type(outcome).__name__}: needs a dict of names and plain data"
            )
        return outcome, outcome.pop("motion", None)
    assert model is not None
    return {"simulate": _simulated, "plan": _planned, "identify": _identified}[job.run](
        job, model, point
    )


def _simulated(job: Job, model: Model, point: Point) -> tuple[dict[str, Any], Trajectory]:
    flight, changes = _flight(job, model, point)
    motion = flight.simulate(**changes)
    assert isinstance(motion, Trajectory)
    return _outputs(motion, job.outputs), motion


def _planned(job: Job, model: Model, point: Point) -> tuple[dict[str, Any], Any]:
    from ...planning.planner import plan
    from ...planning.settings import joined
    from ...scenes.plan import arguments_for

    arguments = job.arguments_of(point)
    if job.table is not None:
        arguments = joined(job.settings, arguments_for(model, arguments))
    else:
        arguments = joined(arguments, {})
        arguments["start"] = tuple(arguments.pop(name) for name in STARTS)
    solution = plan(model, **arguments)
    return solution.report | {"warnings": solution.warnings}, solution


def _identified(job: Job, model: Model, point: Point) -> tuple[dict[str, Any], Any]:
    from ...identification.identify import identify
    from ...scenes.identify import identify_arguments

    arguments = job.arguments_of({name: x for name, x in point.items() if name != DATA})
    if job.table is not None:
        arguments = {**identify_arguments(arguments, size_of(model)), **job.settings}
    arguments = {"estimate": (), **arguments, DATA: job.recordings(point)}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = identify(model, arguments.pop(DATA), **arguments)
    report = result.report | {"warnings": [str(warning.message) for warning in caught]}
    del report["seconds"]  # which each row has
    return report, result


def _flight(job: Job, model: Model, point: Point) -> tuple[Scenario, dict[str, Any]]:
    """Return the scenario of a point, and changes of its settings."""
    arguments = job.arguments_of(point)
    if job.table is None:
        q0, v0 = (arguments.pop(name) for name in STARTS)
        return Scenario(model, q0, v0, 1.0, settings=arguments), {}
    scenario = scenario_of(model, arguments, Path(job.parent), list(job.phases))
    return scenario, dict(job.settings)


def _side_by_side(job: Job, model: Model, points: Sequence[Point]) -> list[Outcome] | None:
    """Return the outcomes of flights that differ in parameters and starts alone; else None."""
    start = (job.table or {}).get("start")
    settles = isinstance(start, dict) and "settle" in start
    others = {key.split(".")[0] for key in job.keys} - {"start", *STARTS}
    if settles or others or job.phases:
        return None
    flights = [_flight(job, model, p) for p in (points if job.keys else points[:1])]
    flight, settings = flights[0]
    settings = {"controller": flight.controller, "t_span": flight.duration} | (
        flight.settings | settings
    )
    if not isinstance(settings["controller"], SHARED):
        return None
    span = float(np.ptp([0.0, *np.atleast_1d(settings["t_span"])][-2:]))
    ends_alone = set(job.outputs) <= set(ENDS)  # which need no other sample
    settings.setdefault("output_step", span / (1 if ends_alone else INTERVALS))
    q0, v0 = (
        np.broadcast_to([getattr(each, name) for each, _ in flights], (len(points), size))
        for name, size in zip(STARTS, (model.nq, model.nv), strict=True)
    )
    parameters = [job.parameters_of(point) for point in points]
    runs = {name: [each[name] for each in parameters] for name in parameters[0]}
    rollouts = replace(flight, q0=q0, v0=v0).simulate(**settings, parameters=runs)
    assert isinstance(rollouts, Rollouts)

    # the last sample of each run
    last = np.maximum(np.isfinite(rollouts.kinetic).sum(axis=1) - 1, 0)
    every = np.arange(len(rollouts))
    arrays = (rollouts.q, rollouts.v, rollouts.kinetic, rollouts.potential)
    columns = [rollouts.ends.tolist(), *(x[every, last].tolist() for x in arrays)]
    outcomes: list[Outcome] = []
    for k, row in enumerate(zip(*columns, strict=True)):
        if rollouts.errors[k] is not None:
            outcomes.append((None, _error_text(rollouts.errors[k])))
        elif ends_alone:
            ends = dict(zip(ENDS, row, strict=True))
            outcomes.append((json.dumps({name: ends[name] for name in job.outputs}), None))
        else:
            outcomes.append((_as_text(_outputs(rollouts[k], job.outputs)), None))
    return outcomes


def _outputs(motion: Trajectory, outputs: Sequence[str]) -> dict[str, Any]:
    """Return the outputs of a motion by name."""
    arrays = (motion.t[-1], motion.q[-1], motion.v[-1], motion.kinetic[-1], motion.potential[-1])
    found = dict(zip(ENDS, arrays, strict=True))
    found |= numbers_of(motion.model, motion, outputs)  # type: ignore[arg-type]
    return {name: found[name] for name in outputs}


def _as_text(outcome: dict[str, Any]) -> str:
    """Return an outcome as JSON, with null for what is not finite; SweepError if it is no data."""
    try:
        return json.dumps(finite_json(outcome), allow_nan=False)
    except (TypeError, ValueError) as reason:
        raise SweepError(f"run: its outcome is not plain data ({reason})") from None


def _error_text(reason: BaseException | None) -> str:
    """Return the text of a failure in a row."""
    return f"{type(reason).__name__}: {reason}"[:MOST_TEXT]
