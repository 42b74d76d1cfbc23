"""Runs the points of a sweep on one model: one after another, or flights side by side."""

import json
import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...basics.errors import SerpentailError, SweepError
from ...model.model import Model
from ...motion.numbers import NUMBERS
from ...motion.trajectory import Trajectory
from ...scenes.overrides import changed
from ...scenes.simulate import Scenario, scenario_of
from ...simulation.controllers.controller import Damping, TorqueCurve, TorqueTable
from ...simulation.rollouts import Rollouts
from ...simulation.simulate import simulate
from .axes import Point
from .job import STARTS, Job

ENDS = ("end_s", "q_end", "v_end", "kinetic_end_J", "potential_end_J")  # outputs by default
OUTPUTS = (*ENDS, *(number.name for number in NUMBERS))
FEW = 2  # points that are not worth running side by side
MOST_TEXT = 2000  # characters of an error
SHARED = (type(None), Damping, TorqueTable, TorqueCurve)  # controllers that any parameters suit


class Told(NamedTuple):
    """Result of a point: its place in the block, outcome (JSON) or error, seconds."""

    place: int
    outcome: str | None
    error: str | None
    seconds: float


def run_points(job: Job, model: Model | None, points: Sequence[Point]) -> Iterator[list[Told]]:
    """Yield the results of points, in their order: one at a time, or all at once."""
    if len(points) >= FEW and model is not None and job.run == "simulate":
        begun = time.perf_counter()
        try:
            found = _side_by_side(job, model, points)
        except SerpentailError:  # about one of them; running them one by one shows which
            found = None
        if found is not None:
            each = (time.perf_counter() - begun) / len(points)
            yield [Told(k, *one, each) for k, one in enumerate(found)]
            return
    for k, point in enumerate(points):
        begun = time.perf_counter()
        try:
            outcome, error = as_text(run_point(job, model, point)[0]), None
        except Exception as reason:  # a failure is a row, too
            outcome, error = None, error_text(reason)
        yield [Told(k, outcome, error, time.perf_counter() - begun)]


def run_point(job: Job, model: Model | None, point: Point) -> tuple[dict[str, Any], Any]:
    """Return the outcome of a point, and its motion, plan or other object with a page, or None."""
    if job.run == "simulate":
        assert model is not None
        motion = _simulated(job, model, point)
        return outcome_of(motion, job.outputs), motion
    if job.run == "plan":
        assert model is not None
        found = _planned(job, model, point)
        return found.report | {"warnings": found.warnings}, found
    if job.run == "identify":
        from .identified import identified

        assert model is not None
        return identified(job, model, point)
    assert not isinstance(job.run, str)
    if model is None:
        outcome = job.run(point)
    else:
        outcome = job.run(model.with_parameters(**job.own_parameters(point)), point)
    if not isinstance(outcome, dict):
        raise SweepError(
            f"run: it returned a {type(outcome).__name__}: needs a dict of names and plain data"
        )
    return outcome, outcome.pop("motion", None)


def _simulated(job: Job, model: Model, point: Point) -> Trajectory:
    own = model.with_parameters(**job.own_parameters(point))
    if job.table is not None:
        found = _scenario(job, own, point).simulate(**job.settings)
        assert isinstance(found, Trajectory)
        return found
    arguments = job.settings | job.own_keys(point)
    q0, v0 = (arguments.pop(name) for name in STARTS)
    motion = simulate(own, q0, v0, **arguments)
    assert isinstance(motion, Trajectory)
    return motion


def _planned(job: Job, model: Model, point: Point) -> Any:
    from ...planning.planner import plan
    from ...scenes.plan import arguments_for

    own = model.with_parameters(**job.own_parameters(point))
    if job.table is not None:
        table = changed(job.table, job.own_keys(point))
        return plan(own, **arguments_for(own, table) | job.settings)
    arguments = job.settings | job.own_keys(point)
    start = tuple(arguments.pop(name) for name in STARTS)
    return plan(own, start=start, **arguments)


def _scenario(job: Job, model: Model, point: Point) -> Scenario:
    table = changed(job.table or {}, job.own_keys(point))
    return scenario_of(model, table, Path(job.parent), list(job.phases))


def _side_by_side(
    job: Job, model: Model, points: Sequence[Point]
) -> list[tuple[str | None, str | None]] | None:
    """Return outcomes and errors of flights that differ in parameters and starts alone; None if
    these differ in more.
    """
    parameters = [job.own_parameters(point) for point in points]
    runs: dict[str, Any] = {name: [each[name] for each in parameters] for name in parameters[0]}
    if job.table is None:
        if not job.keys <= set(STARTS):
            return None
        fixed = dict(job.settings)
        if not isinstance(fixed.get("controller"), SHARED):
            return None
        both = {
            name: [p[name] for p in points] if name in job.keys else fixed.pop(name)
            for name in STARTS
        }
        if not job.keys:  # one row for each run, because they are many
            both["q0"] = np.broadcast_to(both["q0"], (len(points), model.nq))
        fixed |= _samples(job, fixed, fixed.get("t_span", (0.0, 1.0)))
        found = simulate(model, both["q0"], both["v0"], parameters=runs, **fixed)
    else:
        start = job.table.get("start")
        settles = isinstance(start, dict) and "settle" in start
        if settles or job.phases or any(key.split(".")[0] != "start" for key in job.keys):
            return None
        scenes = [_scenario(job, model, p) for p in (points if job.keys else points[:1])]
        if not isinstance(scenes[0].controller, SHARED):
            return None
        q0 = np.array([scene.q0 for scene in scenes])
        v0 = np.array([scene.v0 for scene in scenes])
        if not job.keys:
            q0 = np.broadcast_to(q0, (len(points), model.nq))
            v0 = np.broadcast_to(v0, (len(points), model.nv))
        first = Scenario(model, q0, v0, scenes[0].duration, scenes[0].controller, scenes[0].legs)
        fixed = scenes[0].settings | job.settings
        fixed |= _samples(job, fixed, fixed.get("t_span", first.duration))
        found = first.simulate(**fixed | {"parameters": runs})
    assert isinstance(found, Rollouts)
    return _outcomes(found, job.outputs)


def _samples(job: Job, settings: dict[str, Any], t_span: Any) -> dict[str, Any]:
    """Return the setting to sample only the ends, if the outputs need no more."""
    ends = np.asarray(t_span, float)
    if (
        "output_step" in settings
        or not set(job.outputs) <= set(ENDS)
        or ends.shape not in ((), (2,))
    ):
        return {}
    return {"output_step": float(np.ptp(np.append(0.0, ends) if ends.ndim == 0 else ends))}


def _outcomes(found: Rollouts, outputs: Sequence[str]) -> list[tuple[str | None, str | None]]:
    """Return outcomes and errors of runs as text."""
    last = np.maximum(np.isfinite(found.kinetic).sum(axis=1) - 1, 0)
    every = np.arange(len(found))
    arrays = (found.ends, found.q[every, last], found.v[every, last])
    energies = (found.kinetic[every, last], found.potential[every, last])
    ends = dict(zip(ENDS, (x.tolist() for x in (*arrays, *energies)), strict=True))
    of_ends = [name for name in outputs if name in ENDS]
    columns = zip(*(ends[name] for name in of_ends), strict=True) if of_ends else ((),) * len(found)
    told: list[tuple[str | None, str | None]] = []
    for k, (values, error) in enumerate(zip(columns, found.errors, strict=True)):
        if error is not None:
            told.append((None, error_text(error)))
            continue
        outcome = dict(zip(of_ends, values, strict=True))
        if len(of_ends) < len(outputs):
            outcome = outcome_of(found[k], outputs)
        told.append((json.dumps(outcome), None))
    return told


def outcome_of(motion: Trajectory, outputs: Sequence[str]) -> dict[str, Any]:
    """Return the outputs of a motion by name."""
    arrays = (motion.t[-1], motion.q[-1], motion.v[-1], motion.kinetic[-1], motion.potential[-1])
    ends = dict(zip(ENDS, (np.asarray(x).tolist() for x in arrays), strict=True))
    numbers = {number.name: number for number in NUMBERS if number.name in outputs}
    return {
        name: ends[name] if name in ends else numbers[name].of(motion.model, motion)  # type: ignore[arg-type]
        for name in outputs
    }


def as_text(outcome: dict[str, Any]) -> str:
    """Return an outcome as JSON; SweepError if it is not plain data."""
    try:
        return json.dumps(_ready(outcome), allow_nan=False)
    except (TypeError, ValueError) as reason:
        raise SweepError(f"run: its outcome is not plain data ({reason})") from None


def _ready(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(name): _ready(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_ready(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def error_text(reason: BaseException) -> str:
    """Return the text of a failure in a row."""
    return f"{type(reason).__name__}: {reason}"[:MOST_TEXT]
