"""The axes of a sweep together: which points they give."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from ..checks import needed, refusal, shown
from ..errors import SweepError
from .axis import Grid, Spread, in_units

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

    def __len__(self) -> int:
        return math.prod(len(each.values) for each in self.grids.values()) * self.points

    def measured(self, units: Mapping[str, str | Sequence[str] | None]) -> "Axes":
        """Return the axes with texts such as "2 g" as numbers, for the names that have a unit."""
        grids = {names: _measured(names, axis, units) for names, axis in self.grids.items()}
        spreads = {
            name: axis.measured(f"over: {name}", units[name]) if name in units else axis
            for name, axis in self.spreads.items()
        }
        return replace(self, grids=grids, spreads=spreads)

    def samples(self) -> dict[str, list]:
        """Return the numbers of each random axis, one for each point."""
        if not self.spreads:
            return {}
        sizes = [each.low.size for each in self.spreads.values()]
        (way,) = {each.way for each in self.spreads.values()}
        unit = _unit(way, self.points, sum(sizes), self.seed)
        parts = np.split(unit, np.cumsum(sizes)[:-1], axis=1)
        pairs = zip(self.spreads.items(), parts, strict=True)
        return {name: each.at(part).tolist() for (name, each), part in pairs}

    def __iter__(self) -> Iterator[Point]:
        """Yield the points: the last axis changes first, those that are spread together."""
        samples = self.samples()
        drawn: list[Point] = [
            dict(zip(samples, each, strict=True)) for each in zip(*samples.values(), strict=True)
        ] or [{}]
        rows = [
            [dict(zip(names, _entries(names, value), strict=True)) for value in each.values]
            for names, each in self.grids.items()
        ]
        for chosen in product(*rows):
            fixed: Point = {}
            for part in chosen:
                fixed |= part
            for sample in drawn:
                yield fixed | sample


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


def _unit(way: str, points: int, size: int, seed: int) -> np.ndarray:
    """Return points (points, size) from 0 to 1."""
    if way == "random":
        return np.random.default_rng(seed).random((points, size))
    from scipy.stats import qmc

    kind = {"latin": qmc.LatinHypercube, "sobol": qmc.Sobol}[way]
    generator = kind(size, seed=np.random.default_rng(seed))
    if way == "sobol":  # SciPy warns where points are no power of two: take some of one
        return generator.random_base2(max(points - 1, 0).bit_length())[:points]
    return generator.random(points)
