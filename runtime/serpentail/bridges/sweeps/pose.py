"""What a sweep is of: a model or a scene, with its axes in SI and the models of its points."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...basics.checks import Refusals, did_you_mean, numbers_in, shown
from ...basics.errors import IdentificationError, PlanningError, SimulationError, SweepError
from ...building.build import built
from ...building.options import ParameterOptions
from ...model.model import Model
from ...model.parameters import independent
from ...scenes.file import MADE_OF, read_scene, subtable
from ...scenes.identify import IDENTIFY
from ...scenes.keys import Key, read
from ...scenes.overrides import changed
from ...scenes.plan import PLAN
from ...scenes.simulate_keys import SIMULATE
from .axis import as_json, plain
from .points import Axes, Point, Units
from .processes import Bundle
from .runs import DATA, STARTS, Job

STARTED = (STARTS, "where a motion starts")
# of each run: its table of a scene; of one of a model, the settings that it needs, and in words
RUN_KEYS: Mapping[str, tuple[Key, type[Exception], tuple[tuple[str, ...], str]]] = {
    "simulate": (SIMULATE, SimulationError, STARTED),
    "plan": (PLAN, PlanningError, STARTED),
    "identify": (
        IDENTIFY,
        IdentificationError,
        ((DATA, "markers"), "tracks, and where the markers are"),
    ),
}
BundleOf = Callable[[Point], Bundle | None]
NO_SHAPE = "the shape of a model is fixed: give the sweep a scene, or a function without a model"


@dataclass(frozen=True)
class Posed:
    """A sweep that is well posed: its axes in SI, its job, and its models.

    models: which of the bundles each point has, by its place on the axes. keys: a number for each
    point, of all that its row depends on.
    """

    axes: Axes
    job: Job
    bundles: list[Bundle | None]
    models: np.ndarray
    keys: np.ndarray


def pose(what: Any, axes: Axes, job: Job, of: Any) -> Posed:
    """Return the axes with numbers in SI, the job and the models of a sweep.

    SweepError if two points are the same.

    what: a model, a scene's path or example, or None for a function of points alone. of: what else
    rows depend on.
    """
    units: Units = {}
    bundle: BundleOf = lambda _: None  # noqa: E731
    if isinstance(what, Model):
        job, units, bundle = _of_model(what, axes, job)
    elif what is not None:
        job, units, bundle = _of_scene(what, axes, job)
    elif isinstance(job.run, str):
        raise SweepError(f"model: None: run = {job.run!r} needs a model or a scene")
    axes = axes.measured(units)
    if isinstance(what, Model):
        _refuse_shapes(what, axes)

    # one model for each place on the axes that decide on it; the last axis has all spreads
    decides = [not job.built.isdisjoint(names) for names in axes.grids]
    decides += [not job.built.isdisjoint(axes.spreads)] if axes.spreads else []
    shape = [size if several else 1 for several, size in zip(decides, axes.sizes, strict=True)]
    models = np.arange(np.prod(shape))
    firsts = np.ravel_multi_index(np.unravel_index(models, shape), axes.sizes)
    bundles = [bundle(point) for point in axes.at(firsts)]

    files = job.digest_of({}) if job.run == "identify" and DATA not in axes.names else ""
    family = [__version__, job.identity(), plain("of", of), files, sorted(job.built)]
    hashes = [_hash([*family, bundle.identity if bundle else ""]) for bundle in bundles]
    keys = np.reshape(np.array(hashes, np.uint64), shape) + _places_hashed(axes, job)
    _, firsts = np.unique(keys, return_index=True)
    if len(firsts) < len(axes):
        number = int(np.setdiff1d(np.arange(len(axes)), firsts)[0])
        point = shown(axes.at([number])[0])
        raise SweepError(f"over: point {number} occurs twice, {point}: needs each once")
    models = np.broadcast_to(models.reshape(shape), axes.sizes)
    return Posed(axes, job, bundles, models, keys.view(np.int64).ravel())


def _hash(told: Any) -> int:
    """Return a number of 64 bits of plain data."""
    return int.from_bytes(blake2b(as_json(told).encode(), digest_size=8).digest(), "little")


def _places_hashed(axes: Axes, job: Job) -> np.ndarray:
    """Return a number for each point of the axes: a sum, so that the order of these is no matter.

    Of fewer or more samples the first ones are the same, but not those of a Latin hypercube.
    """
    summed = np.zeros((), np.uint64)
    for names, columns in axes.grids.items():
        rows = [_hash([names, text]) for text in _row_texts(names, columns, job)]
        summed = np.add.outer(summed, np.array(rows, np.uint64))
    if axes.spreads:
        told: list[Any] = [
            [name, axis.kind, axis.low.tolist(), axis.high.tolist(), axis.law]
            for name, axis in axes.spreads.items()
        ]
        latin = any(axis.kind == "latin" for axis in axes.spreads.values())
        told += [axes.seed, axes.points if latin else None]
        samples = np.uint64(_hash(told)) + np.arange(axes.points, dtype=np.uint64)
        summed = np.add.outer(summed, samples)
    return summed


def _row_texts(names: tuple[str, ...], columns: Sequence[Sequence], job: Job) -> list[str]:
    """Return what tells each place of a grid from others; of a file, also its content."""
    texts = [as_json(values) for values in zip(*columns, strict=True)]
    if job.run != "identify" or DATA not in names:
        return texts
    digests = [job.digest_of({DATA: file}) for file in columns[names.index(DATA)]]
    return [f"{text}\n{digest}" for text, digest in zip(texts, digests, strict=True)]


def _of_model(model: Model, axes: Axes, job: Job) -> tuple[Job, Units, BundleOf]:
    """Points that change parameters, the start or settings of one model."""
    known = _parameter_units(model.manifest)
    others = frozenset(axes.names) - known.keys()
    for name in others & frozenset(MADE_OF):
        raise SweepError(f"over: {name}: {NO_SHAPE}")
    units: dict[str, Any] = {name: known[name] for name in axes.names if name in known}
    if isinstance(job.run, str):
        model.serve(job.run)  # workers add no functions
        units |= dict.fromkeys(others - {DATA})
        needed, words = RUN_KEYS[job.run][2]
        missing = [name for name in needed if name not in {*job.settings, *others}]
        if missing:
            raise SweepError(
                f"settings: no {' and no '.join(missing)}: needs {words}, here or in over"
            )
    baked = model.manifest["scene"]["baked"]
    parameters = {} if baked else independent(model.manifest, model.parameters)
    bundle = Bundle.of(model.checked, parameters or None, model.profile)
    return replace(job, keys=others, parent=str(Path.cwd())), units, lambda _: bundle


def _of_scene(scene: Any, axes: Axes, job: Job) -> tuple[Job, Units, BundleOf]:
    """Points that change parameters, keys of the model, or keys of the scene's table."""
    tables, path = read_scene(scene, SweepError)
    first = axes.at([0])[0]
    shape = [name for name in axes.names if name in MADE_OF]
    keys: list[str] = []
    units: dict[str, Any] = {}
    if isinstance(job.run, str):
        key, error, _ = RUN_KEYS[job.run]
        table = subtable(tables, job.run, path, error)
        keys = [name for name in axes.names if name.split(".")[0] in key.keys]
        units = {name: _unit_at(key, name) for name in keys}
        # an unknown key is refused before a model is built
        refused = Refusals(SweepError)
        read(changed(table, {name: first[name] for name in keys}), key, job.run, refused)
        refused.tell()
        job = replace(job, table=table)
        asked = tables.get("purpose", [])
        if isinstance(asked, list) and job.run not in asked:
            tables = {**tables, "purpose": [*asked, job.run]}
    if job.run == "identify":
        if DATA not in {*axes.names, *job.settings}:
            raise SweepError(f"over: no {DATA}: needs files of marker tracks, here or in settings")
        keys += [DATA] if DATA in axes.names else []

    # which other names are parameters, and which of these need other code
    others = [name for name in axes.names if name not in {*keys, *shape}]
    if isinstance(job.run, str):
        _refuse_unknown(others, job.run, ParameterOptions.__annotations__)  # before a model is made

    def made(point: Point, names: Sequence[str]) -> Any:
        scene = tables | {name: point[name] for name in shape}
        return built(scene, path.stem, {name: point[name] for name in names})

    checked, left, _ = made(first, others)
    known = _parameter_units(checked.manifest)
    units |= {name: known[name] for name in others if name in known}
    if isinstance(job.run, str):
        _refuse_unknown(others, job.run, known)
    else:
        keys = [name for name in others if name not in known]
    making = [name for name in others if name not in keys and name not in (left or {})]
    job = replace(
        job,
        phases=tables.get("phase", []) if job.run == "simulate" else (),
        parent=str(path.parent.absolute()),
        keys=frozenset(keys),
        built=frozenset((*shape, *making)),
    )
    return job, units, lambda point: Bundle.of(made(point, making)[0])


def _parameter_units(manifest: Mapping[str, Any]) -> dict[str, str]:
    """Return the units of a model's parameters by name."""
    return {entry["name"]: entry["unit"] for entry in manifest["parameters"]}


def _unit_at(key: Key, name: str) -> str | Sequence[str]:
    """Return the unit of a name such as "start.pitch" below a table's key; "" where it has none."""
    for part in name.split("."):
        if part.isdecimal():
            key = key.each or key  # a table in an array, or a number in one
            continue
        tables = [key, *key.kinds.values()]
        key = next((table.keys[part] for table in tables if part in table.keys), Key())
    return key.unit


def _refuse_shapes(model: Model, axes: Axes) -> None:
    """SweepError for a start whose values at the first point have a wrong shape."""
    first = axes.at([0])[0]
    for name, size in zip(STARTS, (model.nq, model.nv), strict=True):
        start = numbers_in(first.get(name))
        if name in first and (start is None or start.shape != (size,)):
            what = "not numbers" if start is None else f"of shape {start.shape}"
            raise SweepError(
                f"over: {name}: values are {what}: needs {size} numbers at each point, such as "
                f"st.random([-1] * {size}, [1] * {size})"
            )


def _refuse_unknown(names: Collection[str], run: str, known: Collection[str]) -> None:
    """SweepError for a name that is neither a parameter nor a key of the table."""
    for name in names:
        if name not in known:
            near = did_you_mean(name.split(".")[0], [*known, *MADE_OF, *RUN_KEYS[run][0].keys])
            remedy = near or f"the parameters are {', '.join(sorted(known))}"
            raise SweepError(f"over: {shown(name)}: no parameter and no key of [{run}]; {remedy}")
