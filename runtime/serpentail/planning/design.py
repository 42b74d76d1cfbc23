"""Design parameters of a plan: numbers of the model that the planner chooses, with its motion."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ..basics.checks import number, refusal, shown
from ..basics.errors import ModelError, PlanningError
from ..model.model import Model
from ..model.parameters import checked_value

NEEDS = "a mapping of parameters, such as {'tail_length': (0.08, 0.25)}"
STOPS = ("tail_stop_lower", "tail_stop_upper", "tail_stop_width")  # they decide what may start
PAIR = 2
CORNERS_OF = 3  # numbers of an inertia, whose ranges are checked in all combinations


def _none() -> np.ndarray:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Design:
    """Parameters that are unknowns: names, how many numbers each has, and ranges (size,), SI.

    totals: fixed sums of the numbers of some of them, by name.
    """

    names: tuple[str, ...] = ()
    sizes: tuple[int, ...] = ()
    least: np.ndarray = field(default_factory=_none)
    most: np.ndarray = field(default_factory=_none)
    totals: Mapping[str, float] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return sum(self.sizes)

    @property
    def units(self) -> np.ndarray:
        """Units (size,) that make them of the order of 1."""
        largest = np.maximum(np.abs(self.least), np.abs(self.most))
        return np.where(largest > 0, largest, 1.0)

    @property
    def key(self) -> tuple:
        """All that it consists of."""
        return (*self.names, *self.sizes, *self.least, *self.most, *self.totals.items())

    def split(self, values: Any) -> dict[str, Any]:
        """Return numbers (size,) or CasADi symbols by name: one number, or the numbers of one."""
        ends = np.cumsum(self.sizes).tolist()
        return {
            name: values[end - size : end] if size > 1 else values[end - 1]
            for name, size, end in zip(self.names, self.sizes, ends, strict=True)
        }

    def of(self, parameters: Mapping[str, Any]) -> np.ndarray:
        """Return the numbers (size,) that parameters give, moved into the ranges."""
        parts = [np.atleast_1d(parameters[name]) for name in self.names]
        return np.clip(np.concatenate([_none(), *parts]), self.least, self.most)


def with_totals(model: Model, design: Design, totals: Any) -> Design:
    """Return a checked design with fixed sums; PlanningError names the parameter and the remedy."""
    if not isinstance(totals, Mapping | None):
        needs = "a mapping of parameters, such as {'link_lengths': 0.195}"
        raise refusal("design_totals", totals, needs, PlanningError)
    units, found = {p["name"]: p["unit"] for p in model.manifest["parameters"]}, {}
    least, most = design.split(design.least), design.split(design.most)
    for name, value in (totals or {}).items():
        field = f"design_totals.{name}"
        if np.size(least.get(name, 0.0)) < PAIR:
            needs = "a parameter of the design that has several numbers"
            raise refusal(field, value, needs, PlanningError)
        found[name] = number(field, value, PlanningError, unit=units[name])
        low, high = float(np.sum(least[name])), float(np.sum(most[name]))
        if not low <= found[name] <= high:
            needs = f"a sum that the ranges of {name} allow: {low:.6g} to {high:.6g}"
            raise refusal(field, value, needs, PlanningError)
    return replace(design, totals=found)


def checked_design(model: Model, value: Any) -> Design:
    """Return a checked design; PlanningError names the parameter, its value and the remedy."""
    if not isinstance(value, Mapping | None):
        raise refusal("design", value, NEEDS, PlanningError)
    if not value:
        return Design()
    ranges = {str(name): _range(model, str(name), pair) for name, pair in value.items()}
    try:
        for k in range(2):  # all together; this also warns of unusual sizes
            model.with_parameters(**{name: pair[k] for name, pair in ranges.items()})
    except ModelError as error:
        raise PlanningError(f"design: {error}") from error
    least, most = (np.concatenate([np.atleast_1d(p[k]) for p in ranges.values()]) for k in range(2))
    return Design(tuple(ranges), tuple(np.size(p[0]) for p in ranges.values()), least, most)


def _range(model: Model, name: str, pair: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return least and most of a parameter."""
    fields = {p["name"]: p for p in model.manifest["parameters"]}
    if name in STOPS:
        raise PlanningError(f"design.{name}: stops decide where a tail may start: leave it out")
    if not isinstance(pair, tuple | list | np.ndarray) or len(pair) != 2:
        if name in fields:
            raise refusal(f"design.{name}", pair, "(least, most)", PlanningError)
        pair = (0.0, 0.0)  # what follows refuses the name
    least, most = (_checked(fields, name, value) for value in pair)
    if (least > most).any() or (least == most).all():
        needs = "least below most"
        raise refusal(f"design.{name}", (least.tolist(), most.tolist()), needs, PlanningError)
    # where three numbers have to fit each other, all combinations do
    if least.size == CORNERS_OF:
        for corner in product(*zip(least.tolist(), most.tolist(), strict=True)):
            _checked(fields, name, corner)
    return least, most


def _checked(fields: dict[str, dict], name: str, value: Any) -> np.ndarray:
    """Return the value of a parameter; PlanningError if the model does not allow it."""
    checked = checked_value(fields, name, value)
    if isinstance(checked, str):
        raise PlanningError(f"design.{checked}")
    return checked


def refuse_unused(design: Design, used: np.ndarray) -> None:
    """PlanningError if a plan does not depend on a parameter; used (size,): by its numbers."""
    for name, each in design.split(used).items():
        if not np.any(each):
            raise PlanningError(
                f"design: value {shown(name)}: nothing in this plan depends on it, leave it out"
            )
