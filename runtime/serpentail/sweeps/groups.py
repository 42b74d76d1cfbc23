"""The points of a sweep by their models, each with the key of its row."""

import hashlib
from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..building.build import built
from ..building.options import Parameters
from ..checks import Refusals, did_you_mean, numbers_in, shown
from ..errors import IdentificationError, PlanningError, SimulationError, SweepError
from ..model.model import Model
from ..model.parameters import independent
from ..scenes.file import MADE_OF, read_scene, subtable
from ..scenes.identify_keys import IDENTIFY
from ..scenes.keys import Key, read
from ..scenes.overrides import changed
from ..scenes.plan_keys import PLAN
from ..scenes.simulate_keys import SIMULATE
from .axes import Axes, Point
from .bundles import Bundle
from .driver import Group, Task
from .job import DATA, STARTS, Job
from .measures import Units, unit_at, units_of
from .recordings import digest_of
from .store import as_json

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
class Entry:
    """A point, also as JSON, the key of its row, and which job and model it is of."""

    key: str
    text: str
    point: Point
    job: Job
    bundle: Bundle | None


def entries_of(what: Any, axes: Axes, job: Job, of: Any) -> tuple[Axes, list[Entry]]:
    """Return the axes, with numbers in SI, and all points with their keys, in order.

    SweepError if two points are the same.

    what: a model, a scene's path or example, or None for a function of points alone. of: what else
    rows depend on.
    """
    if isinstance(what, Model):
        find, units = _of_model(what, axes, job)
    elif what is not None:
        find, units = _of_scene(what, axes, job)
    else:
        find, units = _without_model(job), {}
    axes = axes.measured(units)
    if isinstance(what, Model):
        _refuse_shapes(what, axes)
    found: dict[str, Entry] = {}
    besides = as_json(of)
    for number, point in enumerate(axes):
        own, bundle, told = find(point)
        text = as_json(point)
        if own.run == "identify":
            told += digest_of(own, point)
        key = hashlib.sha256(f"{told}\n{besides}\n{text}".encode()).hexdigest()[:32]
        if key in found:
            raise SweepError(f"over: point {number} occurs twice, {shown(point)}: needs each once")
        found[key] = Entry(key, text, point, own, bundle)
    return axes, list(found.values())


def groups_of(entries: list[Entry], done: Mapping[str, bool]) -> list[Group]:
    """Return the points that are still to be run, by model."""
    groups: dict[tuple[str, int], Group] = {}
    for each in entries:
        if each.key in done:
            continue
        name = each.bundle.manifest_hash if each.bundle else ""
        group = groups.setdefault((name, id(each.job)), Group(each.bundle, each.job, deque()))
        group.left.append(Task(each.key, each.text, each.point))
    return list(groups.values())


Find = Callable[[Point], tuple[Job, Bundle | None, str]]  # job, model, and what the key is made of


def _without_model(job: Job) -> Find:
    """Points of a function that takes nothing else."""
    if isinstance(job.run, str):
        raise SweepError(f"model: None: run = {job.run!r} needs a model or a scene")
    told = f"{__version__}\n{job.identity()}"
    return lambda point: (job, None, told)


def _of_model(model: Model, axes: Axes, job: Job) -> tuple[Find, Units]:
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
    told = f"{__version__}\n{bundle.manifest_hash}\n{own.identity()}"
    return (lambda point: (own, bundle, told)), units


def _of_scene(scene: Any, axes: Axes, job: Job) -> tuple[Find, Units]:
    """Return points that change parameters, keys of the model, or keys of the scene's table."""
    tables, path = read_scene(scene, SweepError)
    first = next(iter(axes))
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
        from ..scenes.identify import with_functions

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
    models: dict[str, tuple[Job, Bundle, str]] = {}

    def find(point: Point) -> tuple[Job, Bundle, str]:
        name = as_json([point[each] for each in (*shape, *making)])
        if name not in models:
            made = tables | {each: point[each] for each in shape}
            checked, _ = built(made, path.stem, {each: point[each] for each in making})
            bundle = Bundle.of(checked)
            told = f"{__version__}\n{bundle.manifest_hash}\n{own.identity()}"
            models[name] = own, bundle, told
        return models[name]

    return find, units


def _refuse_keys(job: Job, values: Mapping[str, Any]) -> None:
    """SweepError for an unknown key of the table, before a model is built."""
    assert isinstance(job.run, str) and job.table is not None
    refused = Refusals(SweepError)
    read(changed(job.table, values), TABLES[job.run][0], job.run, refused)
    refused.tell()


def _refuse_shapes(model: Model, axes: Axes) -> None:
    """SweepError for a start whose values at the first point have a wrong shape."""
    first = next(iter(axes))
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
