"""The points of a sweep: all combinations of its grids, and of the samples between bounds.

Each point is taken from the axes by its number, so that a sweep of millions needs no list of them.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...basics.checks import refusal, whole_number
from ...basics.errors import SweepError
from .axis import Grid, Spread, in_units, spread

AT_ONCE = 1000  # points that are made together
MOST_POINTS = 10_000_000
MOST_SEED = 2**63 - 1
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
        for first in range(0, len(self), AT_ONCE):
            yield from self.at(range(first, min(first + AT_ONCE, len(self))))

    def measured(self, units: Units) -> "Axes":
        """Return the axes with texts such as "2 g" as numbers, for the names that have a unit."""

        def numbers(name: str, value: Any) -> Any:
            return in_units(f"over: {name}", value, units[name]) if name in units else value

        grids = {
            names: [
                [numbers(name, value) for value in column]
                for name, column in zip(names, columns, strict=True)
            ]
            for names, columns in self.grids.items()
        }
        spreads = {}
        for name, axis in self.spreads.items():
            low, high = (numbers(name, bound) for bound in axis.bounds)
            spreads[name] = spread(axis.kind, low, high, axis.law)
        return replace(self, grids=grids, spreads=spreads)

    def places(self, numbers: Sequence[int] | np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the place on each grid, and among the samples, of the points of some numbers."""
        return np.unravel_index(np.asarray(numbers, np.int64), self.sizes)

    @cached_property
    def samples(self) -> dict[str, np.ndarray]:
        """Return all samples (points, ...) of each spread."""
        if not self.spreads:
            return {}
        ends = np.cumsum([axis.low.size for axis in self.spreads.values()])
        kind = next(iter(self.spreads.values())).kind  # which all have
        parts = np.split(drawn(kind, self.points, int(ends[-1]), self.seed), ends[:-1], axis=1)
        pairs = zip(self.spreads.items(), parts, strict=True)
        return {name: axis.at(part) for (name, axis), part in pairs}

    def at(self, numbers: Sequence[int] | np.ndarray) -> list[Point]:
        """Return the points of some numbers: the last axis changes first."""
        places, found = self.places(numbers), {}
        for (names, columns), where in zip(self.grids.items(), places, strict=False):
            for name, column in zip(names, columns, strict=True):
                found[name] = [column[k] for k in where.tolist()]
        found |= {name: array[places[-1]].tolist() for name, array in self.samples.items()}
        return [dict(zip(found, row, strict=True)) for row in zip(*found.values(), strict=True)]


def drawn(kind: str, points: int, size: int, seed: int) -> np.ndarray:
    """Return numbers (points, size) from 0 to 1."""
    rng = np.random.default_rng(seed)
    if kind == "random":
        return rng.random((points, size))
    from scipy.stats import qmc

    if kind == "latin":
        return qmc.LatinHypercube(size, seed=rng).random(points)
    return qmc.Sobol(size, seed=rng).random_base2(math.ceil(math.log2(points)))[:points]


def axes_of(over: Any, points: Any, seed: Any) -> Axes:
    """Return the axes of a sweep; SweepError if one is wrong, or there are too many points."""
    if not isinstance(over, Mapping) or not over:
        needs = 'a table of axes by name, such as {"tail_mass": st.grid([0.002, 0.003])}'
        raise refusal("over", over, needs, SweepError)
    grids: dict[Names, Sequence[Sequence]] = {}
    spreads: dict[str, Spread] = {}
    taken: set[str] = set()
    for key, axis in over.items():
        names = tuple(part.strip() for part in key.split(",")) if isinstance(key, str) else key
        texts = isinstance(names, tuple) and all(isinstance(name, str) and name for name in names)
        if not names or not texts:
            raise refusal("over", key, "a name, or several as a tuple", SweepError)
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


def _samples(spreads: Mapping, points: Any) -> int:
    """Return the number of samples; 1 without spreads."""
    if spreads:
        return whole_number("points", points, SweepError, least=1, most=MOST_POINTS)
    if points is not None:
        none = "none, because no axis is made by st.random, st.latin or st.sobol"
        raise refusal("points", points, none, SweepError)
    return 1


def _columns(names: Names, values: Sequence) -> Sequence[Sequence]:
    """Return the values of a grid by its names."""
    if len(names) == 1:
        return [values]
    for value in values:
        if not isinstance(value, list) or len(value) != len(names):
            needs = f"{len(names)} entries each"
            raise refusal(f"over: {', '.join(names)}", value, needs, SweepError)
    return list(zip(*values, strict=True))


def checked_row(k: Any, points: int) -> int:
    """Return the number of one of some points; SweepError if there is no such point."""
    return whole_number("row", k, SweepError, least=0, most=points - 1)
