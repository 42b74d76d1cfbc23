"""One axis of a sweep: a grid of values, or numbers that are spread between bounds."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from serpentail_scene.units import MEASURES, in_unit

from ...basics.checks import finite_array, measured, one_of, refusal, shown
from ...basics.errors import SweepError

LAWS = ("uniform", "log")


@dataclass(frozen=True)
class Grid:
    """Values that a sweep takes one after another; ``grid`` makes it."""

    values: tuple[Any, ...]


@dataclass(frozen=True)
class Spread:
    """Numbers between two bounds, of any shape; ``random``, ``latin`` and ``sobol`` make it.

    bounds: low and high as the caller wrote them.
    """

    kind: str
    low: np.ndarray
    high: np.ndarray
    law: str
    bounds: tuple[Any, Any]

    def at(self, places: np.ndarray) -> np.ndarray:
        """Return the numbers (k, ...) at places (k, size) from 0 to 1 between the bounds."""
        places = places.reshape(-1, *self.low.shape)
        if self.law == "log":
            return np.exp(np.log(self.low) + places * (np.log(self.high) - np.log(self.low)))
        return self.low + places * (self.high - self.low)


def grid(values: Any) -> Grid:
    """Make an axis of a sweep that takes each of some values.

    Several grids give all their combinations. A grid may set several names at once; then each
    value has one entry for each name.

    Parameters
    ----------
    values : sequence
        Numbers, texts with units such as "2 g", other texts, arrays, or tables. A text that gives
        a number for a parameter or a key is converted to SI by the sweep.

    Returns
    -------
    Grid
        The axis.

    Raises
    ------
    SweepError
        There are no values, or one is not plain data.

    Examples
    --------
    >>> import serpentail as st
    >>> over = {"tail_mass": st.grid(["2 g", 0.003])}
    >>> over = {("segments", "links"): st.grid([(1, 6), (2, 3)])}
    """
    if isinstance(values, str | Mapping) or not hasattr(values, "__iter__"):
        raise refusal("grid", values, "a list of values", SweepError)
    rows = tuple(plain("grid", value) for value in values)
    if not rows:
        raise SweepError("grid: no values: needs one or more")
    return Grid(rows)


def random(low: Any, high: Any, law: str = "uniform") -> Spread:
    """Make an axis of independent random numbers between two bounds.

    The number of points and their seed are arguments of ``sweep``. All axes made by ``random``,
    ``latin`` or ``sobol`` together give these points, which are combined with all grids.

    Parameters
    ----------
    low, high : float, str or array_like
        Bounds, in SI or as text with a unit.
    law : {"uniform", "log"}, default "uniform"
        "log" draws logarithms uniformly, of numbers above 0.

    Returns
    -------
    Spread
        The axis.

    Raises
    ------
    SweepError
        The bounds or the law are wrong.
    """
    return spread("random", low, high, law)


def latin(low: Any, high: Any, law: str = "uniform") -> Spread:
    """Make an axis whose points are a Latin hypercube: each of k equal parts has one point.

    Another number of points gives other points. scipy.stats.qmc.LatinHypercube makes the points.
    Arguments and errors are those of ``random``.
    """
    return spread("latin", low, high, law)


def sobol(low: Any, high: Any, law: str = "uniform") -> Spread:
    """Make an axis whose points are a scrambled Sobol sequence, even in all axes together.

    The number of points should be a power of two. scipy.stats.qmc.Sobol makes the points.
    Arguments and errors are those of ``random``.
    """
    return spread("sobol", low, high, law)


def spread(kind: str, low: Any, high: Any, law: str) -> Spread:
    """Return an axis between checked bounds."""
    lows, highs = (
        finite_array(f"{kind}: {name}", in_units(f"{kind}: {name}", x), SweepError)
        for name, x in (("low", low), ("high", high))
    )
    one_of(f"{kind}: law", law, LAWS, SweepError)
    if lows.shape != highs.shape:
        raise SweepError(
            f"{kind}: low is {lows.shape}, high is {highs.shape}: needs bounds of one shape"
        )
    if (lows > highs).any() or (law == "log" and (lows <= 0).any()):
        least = "above 0 and " if law == "log" else ""
        needs = f"numbers {least}not above high, {shown(high)}"
        raise refusal(f"{kind}: low", low, needs, SweepError)
    return Spread(kind, lows, highs, law, (low, high))


def in_units(field: str, value: Any, unit: str | Sequence[str] | None = None) -> Any:
    """Return a value with each text such as "2 g", also in lists, as a number in a unit.

    None stands for SI, whatever the text measures.
    """
    if unit is not None:
        return measured(field, value, unit, SweepError)
    if isinstance(value, list | tuple):
        return [in_units(field, each) for each in value]
    if not isinstance(value, str):
        return value
    for each in MEASURES:
        with suppress(ValueError):
            return in_unit(value, each)
    raise refusal(field, value, "a unit that a scene may have, such as g, cm or deg", SweepError)


def plain(field: str, value: Any) -> Any:
    """Return a value as JSON represents it: numbers, texts, lists and tables."""
    try:
        return json.loads(json.dumps(value, allow_nan=False, default=lambda x: x.tolist()))
    except (AttributeError, TypeError, ValueError):
        raise refusal(field, value, "numbers, texts, lists or tables", SweepError) from None


# plain data as JSON, the same text for the same data
as_json = json.JSONEncoder(sort_keys=True, separators=(",", ":")).encode
