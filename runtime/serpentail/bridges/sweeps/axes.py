"""The axes of a sweep together: which points they give."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...basics.checks import needed, refusal, shown
from ...basics.errors import SweepError
from .axis import Grid, Spread, in_units
from .draws import drawn

FEW_VALUES = 1000  # of a grid, which travel with every block
MOST_POINTS = 10_000_000
MOST_SEED = 2**63 - 1
Point = dict[str, Any]  # name -> plain data


def whole(field: str, value: Any, least: int, most: int) -> int:
    """Return a whole number within bounds; SweepError otherwise."""
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if is_whole and least <= value <= most:
        return int(value)
    raise refusal(field, value, f"a whole number from {least} to {most}", SweepError)


def checked_row(k: Any, points: int) -> int:
    """Return the number of one of some points; SweepError if there is no such point."""
    is_whole = isinstance(k, int | np.integer) and not isinstance(k, bool)
    if is_whole and 0 <= k < points:
        return int(k)
    raise SweepError(f"row {shown(k)}: there are {points}, 0 to {points - 1}")


@dataclass(frozen=True)
class Axes:
    """The axes of a sweep by their names; points, seed: of those that are spread."""

    grids: dict[tuple[str, ...], Grid]
    spreads: dict[str, Spread]
    points: int
    seed: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names that a point has, grids first."""
        return (*(name for names in self.grids for name in names), *self.spreads)

    @property
    def sizes(self) -> tuple[int, ...]:
        """How many values each grid has, and last, how many samples all spreads together."""
        grids = (len(each.values) for each in self.grids.values())
        return (*grids, self.points) if self.spreads else tuple(grids)

    def __len__(self) -> int:
        return math.prod(self.sizes)

    def measured(self, units: Mapping[str, str | Sequence[str] | None]) -> "Axes":
        """Return the axes with texts such as "2 g" as numbers, for the names that have a unit."""
        grids = {names: _measured(names, axis, units) for names, axis in self.grids.items()}
        spreads = {
            name: axis.measured(f"over: {name}", units[name]) if name in units else axis
            for name, axis in self.spreads.items()
        }
        return replace(self, grids=grids, spreads=spreads)

    def places(self, numbers: Sequence[int] | np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the place on each grid, and among the samples, of the points of some numbers."""
        return np.unravel_index(np.asarray(numbers, np.int64), self.sizes)

    def samples(self, places: np.ndarray) -> dict[str, list]:
        """Return the numbers of each random axis at some places among the samples."""
        if not self.spreads:
            return {}
        sizes = [each.low.size for each in self.spreads.values()]
        (way,) = {each.way for each in self.spreads.values()}
        unit = drawn(way, places, sum(sizes), self.seed, self.points)
        parts = np.split(unit, np.cumsum(sizes)[:-1], axis=1)
        pairs = zip(self.spreads.items(), parts, strict=True)
        return {name: each.at(part).tolist() for (name, each), part in pairs}

    def at(self, numbers: Sequence[int] | np.ndarray) -> list[Point]:
        """Return the points of some numbers: the last axis changes first, random ones together."""
        places = self.places(numbers)
        columns: dict[str, Iterable] = {}
        for (names, axis), where in zip(self.grids.items(), places, strict=False):
            if len(names) == 1:
                columns[names[0]] = [axis.values[k] for k in where]
            else:
                columns |= {
                    name: [axis.values[k][i] for k in where] for i, name in enumerate(names)
                }
        columns |= self.samples(places[-1])
        rows = zip(*columns.values(), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in rows]

    def part(self, numbers: np.ndarray) -> tuple["Axes", np.ndarray]:
        """Return axes without values of long grids that some points have not, and their numbers
        there.
        """
        if all(len(axis.values) <= FEW_VALUES for axis in self.grids.values()):
            return self, numbers
        places, grids = list(self.places(numbers)), {}
        for k, (names, axis) in enumerate(self.grids.items()):
            used, places[k] = np.unique(places[k], return_inverse=True)
            grids[names] = Grid(tuple(axis.values[i] for i in used))
        own = replace(self, grids=grids)
        return own, np.ravel_multi_index(tuple(places), own.sizes)

    def __iter__(self) -> Iterator[Point]:
        """Yield the points in order."""
        for first in range(0, len(self), FEW_VALUES):
            yield from self.at(range(first, min(first + FEW_VALUES, len(self))))


def axes_of(over: Any, points: Any, seed: Any) -> Axes:
    """Return the axes of a sweep; SweepError if one is wrong, or there are too many points."""
    if not isinstance(over, Mapping) or not over:
        needs = 'a table of axes by name, such as {"tail_mass": st.grid([0.002, 0.003])}'
        raise refusal("over", over, needs, SweepError)
    grids: dict[tuple[str, ...], Grid] = {}
    spreads: dict[str, Spread] = {}
    for names, axis in over.items():
        key = _names(names)
        if key in grids or key[0] in spreads:
            raise SweepError(f"over: {key[0]!r} twice: needs one axis for each name")
        if isinstance(axis, Grid):
            for value in axis.values:
                _entries(key, value)
            grids[key] = axis
        elif isinstance(axis, Spread) and len(key) == 1:
            spreads[key[0]] = axis
        else:
            one = "st.grid(values), or st.random, st.latin or st.sobol (low, high)"
            raise refusal(f"over[{names!r}]", axis, one if len(key) == 1 else "st.grid", SweepError)
    return _checked(Axes(grids, spreads, *_numbers(spreads, points, seed)))


def _checked(axes: Axes) -> Axes:
    """Return axes after checking their names, their kinds and the number of points."""
    ways = {each.way for each in axes.spreads.values()}
    if len(ways) > 1:
        raise SweepError(
            f"over: {' and '.join(sorted(ways))} together: needs one of them for all axes"
        )
    twice = {name for name in axes.names if axes.names.count(name) > 1}
    if twice:
        raise SweepError(f"over: {min(twice)!r} twice: needs one axis for each name")
    if len(axes) > MOST_POINTS:
        raise SweepError(
            f"over: {len(axes)} points: needs at most {MOST_POINTS}: make several sweeps"
        )
    return axes


def _numbers(spreads: Mapping, points: Any, seed: Any) -> tuple[int, int]:
    """Return the number of points of the random axes, 1 without any, and their seed."""
    if not spreads and points is not None:
        raise SweepError(
            f"points: value {shown(points)}: no axis is random: leave it out, or give st.random, "
            "st.latin or st.sobol"
        )
    if spreads and points is None:
        raise SweepError("points: no value: needs the number of points of the random axes")
    return (
        whole("points", points, 1, MOST_POINTS) if spreads else 1,
        whole("seed", seed, 0, MOST_SEED),
    )


def _names(names: Any) -> tuple[str, ...]:
    """Return the names of an axis, given as a tuple or as a text with commas."""
    key = tuple(part.strip() for part in names.split(",")) if isinstance(names, str) else names
    if not isinstance(key, tuple) or not key or not all(isinstance(n, str) and n for n in key):
        raise refusal("over", names, "a name, or several as a tuple", SweepError)
    return key


def _measured(names: tuple[str, ...], axis: Grid, units: Mapping) -> Grid:
    """Return a grid with numbers in the units of its names."""
    if len(names) == 1:
        return axis.measured(f"over: {names[0]}", units[names[0]]) if names[0] in units else axis
    rows = [
        [
            in_units(f"over: {name}", value, units[name]) if name in units else value
            for name, value in zip(names, row, strict=True)
        ]
        for row in axis.values
    ]
    return Grid(tuple(rows))


def _entries(names: Sequence[str], value: Any) -> list:
    """Return the values of one or several names at one place of a grid."""
    if len(names) == 1:
        return [value]
    if not isinstance(value, list) or len(value) != len(names):
        raise SweepError(needed(f"over: {', '.join(names)}", value, f"{len(names)} entries each"))
    return value
