"""Runs the points of a sweep on one model: one after another, or flights side by side."""

import json
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

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
from ...simulation.simulate import simulate
from ...simulation.start import INTERVALS
from .job import DATA, STARTS, Job
from .points import Point
from .store import Row

ENDS = ("end_s", "q_end", "v_end", "kinetic_end_J", "potential_end_J")  # outputs by default
OUTPUTS = (*ENDS, *UNITS)
MOST_TEXT = 2000  # characters of an error
SHARED = (type(None), Damping, TorqueTable, TorqueCurve)  # controllers that any parameters suit
Outcome = tuple[str | None, str | None]  # JSON, or the error in place of it


def run_points(job: Job, model: Model | None, points: Mapping[int, Point]) -> Iterator[list[Row]]:
    """Yield the rows of points by their numbers, in their order: one at a time, or all at once."""
    if len(points) > 1 and model is not None and job.run == "simulate":
        begun = time.perf_counter()
        try:
            outcomes = _side_by_side(job, model, list(points.values()))
        except (SerpentailError, TypeError, ValueError):  # one by one, the point at fault shows
            outcomes = None
        if outcomes is not None:
            seconds = (time.perf_counter() - begun) / len(points)
            pairs = zip(points, outcomes, strict=True)
            yield [Row(number, *outcome, seconds) for number, outcome in pairs]
            return
    for number, point in points.items():
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
    if job.table is not None:
        motion = _scenario(job, model, point).simulate(**job.settings)
    else:
        motion = simulate(model, **{**job.settings, **job.keys_of(point)})
    assert isinstance(motion, Trajectory)
    return _outputs(motion, job.outputs), motion


def _planned(job: Job, model: Model, point: Point) -> tuple[dict[str, Any], Any]:
    from ...planning.planner import plan
    from ...planning.settings import joined
    from ...scenes.plan import arguments_for

    if job.table is not None:
        table = changed(job.table, job.keys_of(point))
        solution = plan(model, **joined(job.settings, arguments_for(model, table)))
    else:
        arguments = joined(job.keys_of(point), joined(job.settings, {}))
        start = tuple(arguments.pop(name) for name in STARTS)
        solution = plan(model, start=start, **arguments)
    return solution.report | {"warnings": solution.warnings}, solution


def _identified(job: Job, model: Model, point: Point) -> tuple[dict[str, Any], Any]:
    from ...identification.identify import identify
    from ...scenes.identify import identify_arguments

    keys = {name: value for name, value in job.keys_of(point).items() if name != DATA}
    if job.table is not None:
        table = changed(job.table, keys)
        arguments = {**identify_arguments(table, size_of(model)), **job.settings}
    else:
        arguments = {**job.settings, **keys}
    arguments.pop(DATA, None)
    markers, estimate = arguments.pop("markers"), arguments.pop("estimate", ())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = identify(model, job.recordings(point), markers, estimate, **arguments)
    report = result.report | {"warnings": [str(warning.message) for warning in caught]}
    del report["seconds"]  # which each row has
    return report, result


def _scenario(job: Job, model: Model, point: Point) -> Scenario:
    table = changed(job.table or {}, job.keys_of(point))
    return scenario_of(model, table, Path(job.parent), list(job.phases))


def _side_by_side(job: Job, model: Model, points: Sequence[Point]) -> list[Outcome] | None:
    """Return the outcomes of flights that differ in parameters and starts alone; else None."""
    settings = dict(job.settings)
    if job.table is None:
        if not job.keys <= set(STARTS):
            return None
        q0, v0 = (
            np.array([p[name] for p in points] if name in job.keys else settings.pop(name), float)
            for name in STARTS
        )
        flight = Scenario(model, q0, v0, 1.0)
    else:
        start = job.table.get("start")
        settles = isinstance(start, dict) and "settle" in start
        if settles or job.phases or any(key.split(".")[0] != "start" for key in job.keys):
            return None
        flights = [_scenario(job, model, p) for p in (points if job.keys else points[:1])]
        flight = flights[0]
        q0, v0 = (np.array([getattr(each, name) for each in flights]) for name in STARTS)
    settings = {"controller": flight.controller, "t_span": flight.duration} | (
        flight.settings | settings
    )
    if not isinstance(settings["controller"], SHARED):
        return None
    span = float(np.ptp([0.0, *np.atleast_1d(settings["t_span"])][-2:]))
    ends_alone = set(job.outputs) <= set(ENDS)  # which need no other sample
    settings.setdefault("output_step", span / (1 if ends_alone else INTERVALS))
    flight = replace(
        flight,
        q0=np.broadcast_to(q0, (len(points), model.nq)),
        v0=np.broadcast_to(v0, (len(points), model.nv)),
    )
    parameters = [job.parameters_of(point) for point in points]
    runs = {name: [each[name] for each in parameters] for name in parameters[0]}
    rollouts = flight.simulate(**settings, parameters=runs)
    assert isinstance(rollouts, Rollouts)
    return _outcomes(rollouts, job.outputs)


def _outcomes(rollouts: Rollouts, outputs: Sequence[str]) -> list[Outcome]:
    """Return the outcomes of runs."""
    last = np.maximum(np.isfinite(rollouts.kinetic).sum(axis=1) - 1, 0)
    every = np.arange(len(rollouts))
    arrays = (rollouts.q, rollouts.v, rollouts.kinetic, rollouts.potential)
    columns = [rollouts.ends.tolist(), *(x[every, last].tolist() for x in arrays)]
    ends = dict(zip(ENDS, columns, strict=True))
    outcomes: list[Outcome] = []
    for k, error in enumerate(rollouts.errors):
        if error is not None:
            outcomes.append((None, _error_text(error)))
        elif ends.keys() >= set(outputs):
            outcomes.append((json.dumps({name: ends[name][k] for name in outputs}), None))
        else:
            outcomes.append((json.dumps(_outputs(rollouts[k], outputs)), None))
    return outcomes


def _outputs(motion: Trajectory, outputs: Sequence[str]) -> dict[str, Any]:
    """Return the outputs of a motion by name."""
    arrays = (motion.t[-1], motion.q[-1], motion.v[-1], motion.kinetic[-1], motion.potential[-1])
    found = dict(zip(ENDS, (np.asarray(x).tolist() for x in arrays), strict=True))
    found |= numbers_of(motion.model, motion, outputs)  # type: ignore[arg-type]
    return {name: found[name] for name in outputs}


def _as_text(outcome: dict[str, Any]) -> str:
    """Return an outcome as JSON, with null for what is not finite; SweepError if it is no data."""
    try:
        return json.dumps(finite_json(outcome), allow_nan=False)
    except (TypeError, ValueError) as reason:
        raise SweepError(f"run: its outcome is not plain data ({reason})") from None


def _error_text(reason: BaseException) -> str:
    """Return the text of a failure in a row."""
    return f"{type(reason).__name__}: {reason}"[:MOST_TEXT]
