"""The points of a sweep by their models, each with the key of its row."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from serpentail_scene.keys import Key

from ... import __version__
from ...basics.checks import Refusals, did_you_mean, numbers_in, shown
from ...basics.errors import IdentificationError, PlanningError, SimulationError, SweepError
from ...building.build import built
from ...building.options import Parameters
from ...model.model import Model
from ...model.parameters import independent
from ...scenes.file import MADE_OF, read_scene, subtable
from ...scenes.identify import IDENTIFY
from ...scenes.keys import read
from ...scenes.overrides import changed
from ...scenes.plan import PLAN
from ...scenes.simulate_keys import SIMULATE
from .axes import Axes, Point
from .axis import as_json, plain
from .bundles import Bundle
from .job import DATA, STARTS, Job
from .measures import Units, unit_at, units_of
from .recordings import digest_of

TABLES: Mapping[str, tuple[Key, type[Exception]]] = {
    "simulate": (SIMULATE, SimulationError),
    "plan": (PLAN, PlanningError),
    "identify": (IDENTIFY, IdentificationError),
}
NEEDED = {  # of a run of a model: settings, and what they are
    "simulate": (STARTS, "where a motion starts"),
    "plan": (STARTS, "where a motion starts"),
    "identify": ((DATA, "markers"), "tracks, and where the markers are"),
}
NO_SHAPE = "the shape of a model is fixed: give the sweep a scene, or a function without a model"


@dataclass(frozen=True)
class Posed:
    """A sweep that is well posed: its axes in SI, its job, and its models.

    varied: the axes whose places, raveled, tell which model a point has; None of these: one model.
    spec: plain data that tells this sweep from others, see ``Store``.
    """

    axes: Axes
    job: Job
    bundles: list[Bundle | None]
    varied: list[int]
    spec: dict[str, Any]

    def models(self, numbers: np.ndarray) -> np.ndarray:
        """Return which of the bundles the points of some numbers have."""
        if not self.varied:
            return np.zeros(len(numbers), int)
        places = self.axes.places(numbers)
        sizes = [self.axes.sizes[k] for k in self.varied]
        return np.ravel_multi_index(tuple(places[k] for k in self.varied), sizes)


def pose(what: Any, axes: Axes, job: Job, of: Any) -> Posed:
    """Return the axes with numbers in SI, the job and the models of a sweep.

    SweepError if two points are the same.

    what: a model, a scene's path or example, or None for a function of points alone. of: what else
    rows depend on.
    """
    if isinstance(what, Model):
        own, find, units = _of_model(what, axes, job)
    elif what is not None:
        own, find, units = _of_scene(what, axes, job)
    else:
        own, find, units = _without_model(job), lambda _: None, {}
    axes = axes.measured(units)
    if isinstance(what, Model):
        _refuse_shapes(what, axes)
    told = [_told(names, axis.values, own) for names, axis in axes.grids.items()]
    _refuse_twice(axes, told)
    varied = _varied(axes, own.built)
    bundles = [find(point) for point in axes.at(_first_of_each(axes, varied))]
    files = digest_of(own, {}) if own.run == "identify" and DATA not in axes.names else ""
    spec = {
        "family": [__version__, own.identity(), plain("of", of), files, sorted(own.built)],
        "grids": list(zip(axes.grids, told, strict=True)),
        "spreads": [
            [name, [each.way, each.low.tolist(), each.high.tolist(), each.law]]
            for name, each in axes.spreads.items()
        ],
        "points": axes.points,
        "seed": axes.seed,
        "models": [each.manifest_hash if each else "" for each in bundles],
        "varied": varied,
    }
    return Posed(axes, own, bundles, varied, spec)


def _told(names: tuple[str, ...], values: Sequence, job: Job) -> list[str]:
    """Return what tells each value of a grid from others; of a file, also its content."""
    told = [as_json(value) for value in values]
    if job.run != "identify" or DATA not in names:
        return told
    files = [value[names.index(DATA)] if len(names) > 1 else value for value in values]
    digests = [digest_of(job, {DATA: file}) for file in files]
    return [f"{one}\n{digest}" for one, digest in zip(told, digests, strict=True)]


def _refuse_twice(axes: Axes, told: Sequence[Sequence[str]]) -> None:
    """SweepError for a grid that has a value twice."""
    for k, values in enumerate(told):
        if len(set(values)) < len(values):
            place = next(i for i, value in enumerate(values) if value in values[:i])
            number = place * int(np.prod(axes.sizes[k + 1 :]))
            point = shown(axes.at([number])[0])
            raise SweepError(f"over: point {number} occurs twice, {point}: needs each once")


def _varied(axes: Axes, built: Collection[str]) -> list[int]:
    """Return the axes that decide on the model of a point; the last one has all random ones."""
    own = [k for k, names in enumerate(axes.grids) if set(names) & set(built)]
    return [*own, len(axes.grids)] if set(axes.spreads) & set(built) else own


def _first_of_each(axes: Axes, varied: list[int]) -> np.ndarray:
    """Return the number of the first point of each model."""
    sizes = [axes.sizes[k] if k in varied else 1 for k in range(len(axes.sizes))]
    return np.ravel_multi_index(np.unravel_index(np.arange(np.prod(sizes)), sizes), axes.sizes)


Find = Callable[[Point], Bundle | None]  # the model of a point


def _without_model(job: Job) -> Job:
    """Return the job of a function that takes nothing else."""
    if isinstance(job.run, str):
        raise SweepError(f"model: None: run = {job.run!r} needs a model or a scene")
    return job


def _of_model(model: Model, axes: Axes, job: Job) -> tuple[Job, Find, Units]:
    """Points that change parameters, the start or settings of one model."""
    known = {entry["name"] for entry in model.manifest["parameters"]}
    others = frozenset(name for name in axes.names if name not in known)
    for name in others:
        if name in MADE_OF:
            raise SweepError(f"over: {name}: {NO_SHAPE}")
    units = units_of(model.manifest, axes.names)
    if isinstance(job.run, str):
        needed, what = NEEDED[job.run]
        missing = [name for name in needed if name not in {*job.settings, *others}]
        if missing:
            raise SweepError(
                f"settings: no {' and no '.join(missing)}: needs {what}, here or in over"
            )
        units |= dict.fromkeys(others - {DATA})
    baked = model.manifest["scene"]["baked"]
    parameters = {} if baked else independent(model.manifest, model.parameters)
    own = replace(
        job, keys=others, parameters=parameters, profile=model.profile, parent=str(Path.cwd())
    )
    bundle = Bundle.of(model.checked)
    return own, lambda _: bundle, units


def _of_scene(scene: Any, axes: Axes, job: Job) -> tuple[Job, Find, Units]:
    """Return points that change parameters, keys of the model, or keys of the scene's table."""
    tables, path = read_scene(scene, SweepError)
    first = axes.at([0])[0]
    shape = [name for name in axes.names if name in MADE_OF]
    keys: list[str] = []
    units: Units = {}
    if isinstance(job.run, str):
        key, error = TABLES[job.run]
        job = replace(job, table=subtable(tables, job.run, path, error))
        keys = [name for name in axes.names if name.split(".")[0] in key.keys]
        _refuse_keys(job, {name: first[name] for name in keys})
        units = {name: unit_at(key, name) for name in keys}
    if job.run == "identify":
        from ...scenes.identify import with_functions

        tables = with_functions(tables)
        if DATA not in {*axes.names, *job.settings}:
            raise SweepError(f"over: no {DATA}: needs files of marker tracks, here or in settings")
        keys += [DATA] if DATA in axes.names else []

    # which other names are parameters, and which of these need other code
    others = [name for name in axes.names if name not in {*keys, *shape}]
    _refuse_misspelt(others, job.run)
    made = tables | {name: first[name] for name in shape}
    checked, left = built(made, path.stem, {name: first[name] for name in others})
    known = {entry["name"] for entry in checked.manifest["parameters"]}
    units |= units_of(checked.manifest, others)
    if isinstance(job.run, str):
        _refuse_unknown([name for name in others if name not in known], job.run, known)
    else:
        keys = [name for name in others if name not in known]
    making = [name for name in others if name not in keys and name not in (left or {})]

    own = replace(
        job,
        phases=tables.get("phase", []) if job.run == "simulate" else (),
        parent=str(path.parent.absolute()),
        keys=frozenset(keys),
        built=frozenset((*shape, *making)),
    )

    def find(point: Point) -> Bundle:
        made = tables | {each: point[each] for each in shape}
        checked, _ = built(made, path.stem, {each: point[each] for each in making})
        return Bundle.of(checked)

    return own, find, units


def _refuse_keys(job: Job, values: Mapping[str, Any]) -> None:
    """SweepError for an unknown key of the table, before a model is built."""
    assert isinstance(job.run, str) and job.table is not None
    refused = Refusals(SweepError)
    read(changed(job.table, values), TABLES[job.run][0], job.run, refused)
    refused.tell()


def _refuse_shapes(model: Model, axes: Axes) -> None:
    """SweepError for a start whose values at the first point have a wrong shape."""
    first = axes.at([0])[0]
    for name, size in zip(STARTS, (model.nq, model.nv), strict=True):
        given = numbers_in(first.get(name))
        if name in first and (given is None or given.shape != (size,)):
            what = "not numbers" if given is None else f"of shape {given.shape}"
            raise SweepError(
                f"over: {name}: values are {what}: needs {size} numbers at each point, such as "
                f"st.random([-1] * {size}, [1] * {size})"
            )


def _refuse_misspelt(names: list[str], run: Any) -> None:
    """SweepError for a name that no model has as a parameter, before a model is made."""
    known = Parameters.__annotations__
    if isinstance(run, str):
        _refuse_unknown([name for name in names if name not in known], run, known)


def _refuse_unknown(names: list[str], run: str, known: Collection[str]) -> None:
    """SweepError for a name that is neither a parameter nor a key of the table."""
    for name in names:
        near = did_you_mean(name.split(".")[0], [*known, *MADE_OF, *TABLES[run][0].keys])
        remedy = near or f"the parameters are {', '.join(sorted(known))}"
        raise SweepError(f"over: {shown(name)}: no parameter and no key of [{run}]; {remedy}")
