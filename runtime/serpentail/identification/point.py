"""A point of the search: values of the shared unknowns, and an iterate of each trial."""

from dataclasses import dataclass

import numpy as np

from ..basics.errors import ModelError
from . import trial as trials
from .trial import Iterate, Trial
from .unknowns import Unknowns


@dataclass(frozen=True, eq=False)
class Point:
    """Values of the unknowns (P,) and an iterate of each trial."""

    values: np.ndarray
    iterates: tuple[Iterate, ...]


def integrated(unknowns: Unknowns, each: tuple[Trial, ...], point: Point) -> Point | None:
    """Return a point with its intervals integrated; None if that fails."""
    try:
        model = unknowns.model_at(point.values)
    except ModelError:
        return None
    found = []
    for trial, iterate in zip(each, point.iterates, strict=True):
        solved = trials.solved(model, trial, iterate)
        if solved is None:
            return None
        found.append(solved)
    return Point(point.values, tuple(found))


def prior_rows(unknowns: Unknowns, values: np.ndarray) -> np.ndarray:
    """Return the rows of priors on shared unknowns, right-hand side last."""
    spread = [
        (k, each.size / each.spread, (unknowns.start[k] - values[k]) / each.spread)
        for k, each in enumerate(unknowns.each)
        if each.spread is not None
    ]
    rows = np.zeros((len(spread), len(unknowns.each) + 1))
    for row, (k, weight, off) in zip(rows, spread, strict=True):
        row[k], row[-1] = weight, off
    return rows
