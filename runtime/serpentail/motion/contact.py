"""What touched the ground along a motion: points, forces and friction springs by groups."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..brief import brief

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Contact:
    """K samples of P points: the feet's A, M and T (right, then left), the tail's, the torso's.

    points (K, P, 3) m, world; forces (K, P, 3) N of the ground, world; bristles (K, P, 2) m,
    stretch of the friction springs; groups: how many of the points are feet, tail and torso, in
    that order; legs (K, 4) rad, gamma and delta of the right leg, then of the left, None without
    feet.
    """

    points: Array
    forces: Array
    bristles: Array
    groups: dict[str, int]
    legs: Array | None = None

    def __post_init__(self) -> None:
        """Keep read-only copies."""
        for name, value in self.arrays.items():
            array = np.array(value, float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    __repr__ = brief

    @property
    def arrays(self) -> dict[str, Array]:
        """What it has at every sample, by name."""
        legs = {} if self.legs is None else {"legs": self.legs}
        return {name: getattr(self, name) for name in OF_POINTS} | legs

    @property
    def depth(self) -> Array:
        """Depth (K, P) in m of the points below the ground; negative above it."""
        return -self.points[..., 2]

    @property
    def total(self) -> Array:
        """Size (K,) in N of the ground's force on all points together."""
        return np.asarray(np.linalg.norm(self.forces.sum(axis=1), axis=1))

    def of(self, group: str) -> "Contact":
        """Return the points of one group; KeyError where the motion has none."""
        if group not in self.groups:
            raise KeyError(f"no group {group!r}: this motion has {', '.join(self.groups)}")
        count = self.groups[group]
        first = sum(list(self.groups.values())[: list(self.groups).index(group)])
        arrays: dict[str, Any] = {
            name: getattr(self, name)[:, first : first + count] for name in OF_POINTS
        }
        return replace(self, **arrays, groups={group: count})

    def mapped(self, change: Callable[[Array], Array]) -> "Contact":
        """Return this contact with a function applied to every array (K, columns)."""
        changed: dict[str, Any] = {}
        for name, array in self.arrays.items():
            rows = change(array.reshape(len(array), -1))
            changed[name] = rows.reshape(len(rows), *array.shape[1:])
        return replace(self, **changed)


OF_POINTS = ("points", "forces", "bristles")
