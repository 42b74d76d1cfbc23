"""What is estimated besides the motion: parameters of the model and offsets of markers."""

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..basics.checks import did_you_mean, needed, number, refusal
from ..basics.errors import IdentificationError, UnlikeBodies, UnusualSize
from ..model.model import Model
from ..model.parameters import flat, independent, link_inertia
from .placement import STEP, Placements

MARKER = "marker:"
SAME = "same"
GEOMETRY = ("tail_mount", "mount_angles", "tail_length", "link_lengths", "arc_lengths")
LEAST = 1e-3  # of its size: bound of a positive number
TINY = 1e-30  # of complex steps
NAME = re.compile(r"([A-Za-z_]\w*)(?:\[(\d+|same)\])?")


@dataclass(frozen=True)
class Unknown:
    """One estimated number: a name, its unit, the parameter or the marker that it is of, which
    entries of that it sets, its value at the start, its size for relative changes, and the spread
    of a prior on it.
    """

    name: str
    unit: str
    of: str
    entries: tuple[int, ...]
    start: float
    size: float
    spread: float | None = None

    @property
    def is_offset(self) -> bool:
        """Tell whether it is of a marker."""
        return self.of.startswith(MARKER)


@dataclass(frozen=True, eq=False)
class Unknowns:
    """All estimated numbers of a model and its markers."""

    placed: Placements
    each: tuple[Unknown, ...]

    @property
    def model(self) -> Model:
        """The model to begin with."""
        return self.placed.model

    @property
    def start(self) -> np.ndarray:
        """The value of each at the start, (P,)."""
        return np.array([each.start for each in self.each], float)

    @property
    def sizes(self) -> np.ndarray:
        """The size of each, by which changes of different units are compared, (P,)."""
        return np.array([each.size for each in self.each])

    @property
    def least(self) -> np.ndarray:
        """The bound of each (P,): 0, almost 0 if it must be positive, -inf if it has a sign."""
        checks = {p["name"]: p["check"] for p in self.model.manifest["parameters"]}
        bounds = {"not_negative": 0.0, "positive": LEAST, "body_inertia": LEAST}
        each = [bounds.get(checks.get(each.of, ""), -np.inf) for each in self.each]
        return np.array(each, float) * self.sizes

    def model_at(self, values: np.ndarray) -> Model:
        """Return the model with these parameters; ModelError if they are unphysical."""
        begin = independent(self.model.manifest, self.model.parameters)
        changes: dict[str, Any] = {}
        for each, value in zip(self.each, values, strict=True):
            if not each.is_offset:
                array = np.array(changes.get(each.of, begin[each.of]), float)
                changes[each.of] = _with(array, each.entries, value)
        return _changed(self.model, changes) if changes else self.model

    def placed_at(self, values: np.ndarray) -> Placements:
        """Return the markers with these offsets, on the model with these parameters."""
        offset = self.placed.offset.copy()
        for marker, axis, k in self.offsets():
            offset[marker, axis] = values[k]
        return replace(self.placed, model=self.model_at(values), offset=offset)

    def offsets(self) -> list[tuple[int, int, int]]:
        """Return marker, axis and index of each number that is an offset."""
        return [
            (self.placed.names.index(each.of[len(MARKER) :]), each.entries[0], k)
            for k, each in enumerate(self.each)
            if each.is_offset
        ]

    def prior_rows(self, values: np.ndarray) -> np.ndarray:
        """Return the rows (R, P + 1) of the priors over relative changes, right-hand side last."""
        spread = np.array([np.inf if each.spread is None else each.spread for each in self.each])
        rows = np.column_stack([np.diag(self.sizes / spread), (self.start - values) / spread])
        return rows[np.isfinite(spread)]

    def struct_jacobian(self, model: Model) -> np.ndarray:
        """Return d(parameter struct) / d(unknowns), (scalars, P), at a model's parameters."""
        jacobian = np.zeros((len(model.parameter_vector), len(self.each)))
        for k, each in enumerate(self.each):
            if not each.is_offset:
                jacobian[:, k] = _struct_direction(model, each)
        return jacobian

    def neighbours(self, placed: Placements) -> dict[int, list[Placements]]:
        """Return the markers a small step above and below, by index of what moves the tail."""
        model, steps = placed.model, dict[int, list[Placements]]()
        for k, each in enumerate(self.each):
            if each.of in GEOMETRY:
                values = np.array(model.parameters[each.of], float)
                value = np.atleast_1d(values)[each.entries[0]]
                ends = (value + STEP * each.size, value - STEP * each.size)
                changes = [{each.of: _with(values, each.entries, end)} for end in ends]
                steps[k] = [replace(placed, model=_changed(model, change)) for change in changes]
        return steps


def _changed(model: Model, changes: dict[str, Any]) -> Model:
    """Return a model with other parameters, which may be unusual; only the result is checked."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualSize)
        warnings.simplefilter("ignore", UnlikeBodies)
        return model.with_parameters(**changes)


def _with(values: np.ndarray, entries: tuple[int, ...], value: float) -> Any:
    """Return a parameter with entries of another value."""
    if values.ndim == 0:
        return float(value)
    values = values.copy()
    values[list(entries)] = value
    return values


def _struct_direction(model: Model, unknown: Unknown) -> np.ndarray:
    """Return how the parameter struct moves with a number, by a complex step."""
    values: dict[str, Any] = dict(model.parameters)
    moved = np.array(values[unknown.of], complex)
    moved[list(unknown.entries) if moved.ndim else ...] += 1j * TINY
    values[unknown.of] = moved

    # the inertia of links that are ellipsoids follows from their other parameters
    if "link_radius" in values:
        pieces = int(np.sum(model.joints_each))
        values["link_inertia"] = np.array(link_inertia(values, pieces))
    as_tuples = {name: tuple(np.atleast_1d(x)) for name, x in values.items()}
    return np.array(flat(model.manifest, as_tuples)).imag / TINY


def unknowns(placed: Placements, estimate: Any) -> Unknowns:
    """Return what is to be estimated; IdentificationError with each wrong name.

    estimate: names, or name -> spread of a prior about the first value.
    """
    if isinstance(estimate, Mapping):
        wanted = dict(estimate)
    elif isinstance(estimate, Sequence) and not isinstance(estimate, str):
        wanted = dict.fromkeys(estimate)
    else:
        needs = 'names of parameters and markers, such as ["tail_mass", "marker:head"]'
        raise refusal("estimate", estimate, needs, IdentificationError)
    each: list[Unknown] = []
    for name, spread in wanted.items():
        for unknown in _of_name(placed, name, spread):
            named = {entry for x in each if x.of == unknown.of for entry in x.entries}
            if not named.isdisjoint(unknown.entries):
                raise IdentificationError(f"estimate: {unknown.name} is named twice")
            each.append(unknown)
    model = placed.model
    if not all(unknown.is_offset for unknown in each) and model.manifest["scene"]["baked"]:
        raise IdentificationError(
            f"estimate: the parameters are baked into {model.name}: set `baked = false` in its "
            "scene and generate it again"
        )
    return Unknowns(placed, tuple(each))


def _of_name(placed: Placements, name: Any, spread: Any) -> list[Unknown]:
    """Return the unknowns that a name stands for."""
    if spread is not None:
        spread = number(f"estimate.{name}", spread, IdentificationError, above=0)
    if isinstance(name, str) and name.startswith(MARKER):
        return _of_marker(placed, name, spread)
    model = placed.model
    fields = independent(model.manifest, model.parameters)
    match = NAME.fullmatch(name) if isinstance(name, str) else None
    if match is None or match[1] not in fields:
        remedy = did_you_mean(match[1] if match else name, fields)
        remedy = remedy or f"needs marker:NAME, or one of {', '.join(fields)}"
        raise IdentificationError(f"estimate: value {name!r:.80}: {remedy}")
    field, chosen = match.groups()
    values = np.atleast_1d(np.asarray(fields[field], float))
    (unit,) = (p["unit"] for p in model.manifest["parameters"] if p["name"] == field)
    # a part that is zero is as large as the largest
    sizes = np.where(values != 0, np.abs(values), np.abs(values).max(initial=0.0) or 1.0)
    return [
        Unknown(word, unit, field, entries, float(values[k]), float(sizes[k]), spread)
        for word, entries in _entries(name, chosen, values)
        for k in entries[:1]
    ]


def _entries(
    name: str, chosen: str | None, values: np.ndarray
) -> list[tuple[str, tuple[int, ...]]]:
    """Return names of numbers and the entries of a parameter that each sets."""
    if chosen == SAME:
        if len(set(values.tolist())) > 1:
            needs = "entries that are equal to begin with"
            raise IdentificationError(needed(f"estimate: {name}", values.tolist(), needs))
        return [(name, tuple(range(len(values))))]
    if chosen is not None:
        if int(chosen) >= len(values):
            raise IdentificationError(f"estimate: {name}: there are entries 0 to {len(values) - 1}")
        return [(name, (int(chosen),))]
    if len(values) == 1:
        return [(name, (0,))]
    return [(f"{name}[{k}]", (k,)) for k in range(len(values))]


def _of_marker(placed: Placements, name: str, spread: float | None) -> list[Unknown]:
    """Return the three offsets of a marker."""
    marker = name[len(MARKER) :]
    if marker not in placed.names:
        remedy = did_you_mean(marker, placed.names) or f"there are {', '.join(placed.names)}"
        raise IdentificationError(f"estimate: {name}: no such marker; {remedy}")
    offset = placed.offset[placed.names.index(marker)]
    size = 0.1 * float(placed.model.parameters["tail_length"])
    return [
        Unknown(f"{name}.{axis}", "m", name, (k,), float(offset[k]), size, spread)
        for k, axis in enumerate("xyz")
    ]
