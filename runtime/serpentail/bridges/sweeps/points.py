"""The points of a sweep: all combinations of its grids, and of the samples between bounds.

Each point is computed from its number, so that a sweep of millions needs no list of them.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ...basics.checks import refusal, shown, whole_number
from ...basics.errors import SweepError
from .axis import Grid, Spread, in_units, spread

FEW_VALUES = 1000  # of a grid, which travel with every block
MOST_POINTS = 10_000_000
MOST_SEED = 2**63 - 1
PART = 1024  # samples that are drawn together
ROUNDS = 6  # of the permutation of a Latin hypercube
Point = dict[str, Any]  # name -> plain data
Names = tuple[str, ...]
Units = Mapping[str, str | Sequence[str] | None]  # by name; None: any unit, in SI


@dataclass(frozen=True)
class Axes:
    """The axes of a sweep.

    grids: by the names that change together, the values of each. spreads: numbers between bounds.
    points, seed: of the samples that all spreads together give.
    """

    grids: Mapping[Names, Sequence[Sequence]]
    spreads: Mapping[str, Spread]
    points: int
    seed: int

    @property
    def names(self) -> Names:
        """Names that a point has, grids first."""
        return (*(name for names in self.grids for name in names), *self.spreads)

    @property
    def sizes(self) -> tuple[int, ...]:
        """How many places each grid has, and last, how many samples all spreads together."""
        grids = tuple(len(columns[0]) for columns in self.grids.values())
        return (*grids, self.points) if self.spreads else grids

    def __len__(self) -> int:
        return math.prod(self.sizes)

    def __iter__(self) -> Iterator[Point]:
        """Yield the points in order."""
        for first in range(0, len(self), FEW_VALUES):
            yield from self.at(range(first, min(first + FEW_VALUES, len(self))))

    def measured(self, units: Units) -> "Axes":
        """Return the axes with texts such as "2 g" as numbers, for the names that have a unit."""
        grids, spreads = {}, {}
        for names, columns in self.grids.items():
            grids[names] = [
                [in_units(f"over: {name}", value, units[name]) for value in column]
                if name in units
                else column
                for name, column in zip(names, columns, strict=True)
            ]
        for name, axis in self.spreads.items():
            spreads[name] = axis
            if name in units:
                low, high = (in_units(f"over: {name}", x, units[name]) for x in axis.bounds)
                spreads[name] = replace(spread(axis.kind, low, high, axis.law), bounds=axis.bounds)
        return replace(self, grids=grids, spreads=spreads)

    def places(self, numbers: Sequence[int] | np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the place on each grid, and among the samples, of the points of some numbers."""
        return np.unravel_index(np.asarray(numbers, np.int64), self.sizes)

    def samples(self, places: np.ndarray) -> dict[str, list]:
        """Return the numbers of each spread at some places among the samples."""
        if not self.spreads:
            return {}
        sizes = [axis.low.size for axis in self.spreads.values()]
        kind = next(iter(self.spreads.values())).kind  # which all have
        unit = drawn(kind, places, sum(sizes), self.seed, self.points)
        parts = np.split(unit, np.cumsum(sizes)[:-1], axis=1)
        pairs = zip(self.spreads.items(), parts, strict=True)
        return {name: axis.at(part).tolist() for (name, axis), part in pairs}

    def at(self, numbers: Sequence[int] | np.ndarray) -> list[Point]:
        """Return the points of some numbers: the last axis changes first, spreads together."""
        places = self.places(numbers)
        points: dict[str, list] = {}
        for (names, columns), where in zip(self.grids.items(), places, strict=False):
            for name, column in zip(names, columns, strict=True):
                points[name] = [column[k] for k in where]
        points |= self.samples(places[-1])
        return [dict(zip(points, row, strict=True)) for row in zip(*points.values(), strict=True)]

    def part(self, numbers: np.ndarray) -> tuple["Axes", np.ndarray]:
        """Return axes with the values that some points need, and the points' numbers there.

        Grids of few values stay whole.
        """
        if max(self.sizes[: len(self.grids)], default=0) <= FEW_VALUES:
            return self, numbers
        places, grids = list(self.places(numbers)), {}
        for k, (names, columns) in enumerate(self.grids.items()):
            used, places[k] = np.unique(places[k], return_inverse=True)
            grids[names] = [[column[i] for i in used] for column in columns]
        axes = replace(self, grids=grids)
        return axes, np.ravel_multi_index(tuple(places), axes.sizes)


def axes_of(over: Any, points: Any, seed: Any) -> Axes:
    """Return the axes of a sweep; SweepError if one is wrong, or there are too many points."""
    if not isinstance(over, Mapping) or not over:
        needs = 'a table of axes by name, such as {"tail_mass": st.grid([0.002, 0.003])}'
        raise refusal("over", over, needs, SweepError)
    grids: dict[Names, Sequence[Sequence]] = {}
    spreads: dict[str, Spread] = {}
    taken: set[str] = set()
    for key, axis in over.items():
        names = _names(key)
        for name in names:
            if name in taken:
                raise SweepError(f"over: {name!r} twice: needs one axis for each name")
            taken.add(name)
        if isinstance(axis, Grid):
            grids[names] = _columns(names, axis.values)
        elif isinstance(axis, Spread) and len(names) == 1:
            spreads[names[0]] = axis
        else:
            one = "st.grid(values), or st.random, st.latin or st.sobol (low, high)"
            raise refusal(f"over[{key!r}]", axis, one if len(names) == 1 else "st.grid", SweepError)
    kinds = sorted({axis.kind for axis in spreads.values()})
    if len(kinds) > 1:
        raise SweepError(f"over: {' and '.join(kinds)} together: needs one of them for all axes")
    seed = whole_number("seed", seed, SweepError, least=0, most=MOST_SEED)
    axes = Axes(grids, spreads, _samples(spreads, points), seed)
    if len(axes) > MOST_POINTS:
        raise SweepError(
            f"over: {len(axes)} points: needs at most {MOST_POINTS}: make several sweeps"
        )
    return axes


def checked_row(k: Any, points: int) -> int:
    """Return the number of one of some points; SweepError if there is no such point."""
    return whole_number("row", k, SweepError, least=0, most=points - 1)


def _samples(spreads: Mapping, points: Any) -> int:
    """Return the number of samples; 1 without spreads."""
    if spreads and points is None:
        raise SweepError("points: no value: needs the number of points of the random axes")
    if spreads:
        return whole_number("points", points, SweepError, least=1, most=MOST_POINTS)
    if points is not None:
        raise SweepError(
            f"points: value {shown(points)}: no axis is random: leave it out, or give st.random, "
            "st.latin or st.sobol"
        )
    return 1


def _names(key: Any) -> Names:
    """Return the names of an axis, given as a tuple or as a text with commas."""
    names = tuple(part.strip() for part in key.split(",")) if isinstance(key, str) else key
    if (
        not isinstance(names, tuple)
        or not names
        or not all(isinstance(n, str) and n for n in names)
    ):
        raise refusal("over", key, "a name, or several as a tuple", SweepError)
    return names


def _columns(names: Names, values: Sequence) -> Sequence[Sequence]:
    """Return the values of a grid by its names."""
    if len(names) == 1:
        return [values]
    for value in values:
        if not isinstance(value, list) or len(value) != len(names):
            needs = f"{len(names)} entries each"
            raise refusal(f"over: {', '.join(names)}", value, needs, SweepError)
    return list(zip(*values, strict=True))


def drawn(kind: str, places: np.ndarray, size: int, seed: int, points: int) -> np.ndarray:
    """Return numbers (k, size) from 0 to 1 at places (k,) from 0 to points - 1."""
    parts, inside = np.divmod(places, PART)
    numbers = np.empty((len(places), size))
    for part in np.unique(parts):
        here = parts == part
        numbers[here] = _part(kind, int(part), size, seed, points)[inside[here]]
    return numbers


@lru_cache(maxsize=16)
def _part(kind: str, part: int, size: int, seed: int, points: int) -> np.ndarray:
    """Return the numbers (PART, size) of one part of the places."""
    if kind == "sobol":
        from scipy.stats import qmc

        engine = qmc.Sobol(size, seed=np.random.default_rng(seed))
        if part:
            engine.fast_forward(part * PART)
        return engine.random(PART)
    bits = np.random.PCG64(seed)
    bits.advance(part * PART * size)
    numbers = np.random.Generator(bits).random((PART, size))
    if kind == "latin":
        places = np.arange(part * PART, min((part + 1) * PART, points))
        for k in range(size):
            numbers[: len(places), k] += permuted(places, points, [seed, k])
        numbers /= points
    return numbers


def permuted(places: np.ndarray, points: int, seed: list[int]) -> np.ndarray:
    """Return where places go in a permutation of 0 to points - 1 that depends on a seed.

    A Feistel network permutes the numbers below a power of 4; what falls outside goes through it
    again until it is inside.
    """
    half = np.uint64(max(1, (max(points - 1, 1).bit_length() + 1) // 2))
    mask = (np.uint64(1) << half) - np.uint64(1)
    keys = np.random.default_rng(seed).integers(0, 2**64, ROUNDS, np.uint64)
    numbers = places.astype(np.uint64)
    outside = np.ones(len(numbers), bool)
    while outside.any():
        left, right = numbers[outside] >> half, numbers[outside] & mask
        for key in keys:
            left, right = right, left ^ (_mixed(right ^ key) & mask)
        numbers[outside] = (left << half) | right
        outside = numbers >= points
    return numbers.astype(np.int64)


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """Return numbers of 64 bits of which each bit depends on all bits of the given ones."""
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        numbers = (numbers ^ (numbers >> np.uint64(shift))) * np.uint64(factor)
    return numbers ^ (numbers >> np.uint64(31))
