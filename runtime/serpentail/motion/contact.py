"""``Contact``: points on the ground along a motion, their forces and friction springs."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..basics.checks import shown
from ..basics.near_names import NearNames
from ..basics.short_repr import brief

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Contact(NearNames):
    """Points of a motion that can touch the ground, and the ground's forces on them.

    There are K samples of P points: A, M and T of the right foot, then of the left; the tail's,
    then those of other chains, joint after joint; the torso's.

    Attributes
    ----------
    points : ndarray, shape (K, P, 3)
        Positions (m, world).
    forces : ndarray, shape (K, P, 3)
        Forces of the ground (N, world).
    bristles : ndarray, shape (K, P, 2)
        Stretch of the friction springs (m, world x and y).
    groups : dict of str to int
        Number of points of each group in this order: "feet", "tail", other chains such as
        "hind_left", "torso".
    legs : ndarray, shape (K, 4), or None
        gamma and delta of the right leg, then of the left (rad); None without feet.
    """

    points: Array
    forces: Array
    bristles: Array
    groups: dict[str, int]
    legs: Array | None = None

    def __post_init__(self) -> None:
        """Check the fields, and keep read-only copies."""
        for name, value in self.arrays.items():
            array = np.array(value, float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        known = isinstance(self.groups, dict) and all(isinstance(n, str) for n in self.groups)
        if not known or not all(type(n) is int and n > 0 for n in self.groups.values()):
            raise ValueError(
                f"contact.groups: value {shown(self.groups)}: needs a count of points of each "
                'group, such as {"feet": 6, "tail": 3}'
            )
        samples, count = len(self.points), sum(self.groups.values())
        widths = {"points": (count, 3), "forces": (count, 3), "bristles": (count, 2), "legs": (4,)}
        for name, array in self.arrays.items():
            if array.shape != (samples, *widths[name]):
                raise ValueError(
                    f"contact.{name} has shape {array.shape}: give {(samples, *widths[name])}, as "
                    "its groups say"
                )

    __repr__ = brief

    @property
    def arrays(self) -> dict[str, Array]:
        """The arrays that have one row for each sample, by name."""
        legs = {} if self.legs is None else {"legs": self.legs}
        return {name: getattr(self, name) for name in OF_POINTS} | legs

    @property
    def depth(self) -> Array:
        """Depth of the points below the ground, (K, P), m; negative above it."""
        return -self.points[..., 2]

    @property
    def total(self) -> Array:
        """Size of the ground's force on all points together, (K,), N."""
        return np.asarray(np.linalg.norm(self.forces.sum(axis=1), axis=1))

    def of(self, group: str) -> "Contact":
        """Return the points of one group.

        Parameters
        ----------
        group : str
            "feet", "tail", "torso" or a chain, such as "hind_left".

        Returns
        -------
        Contact
            The points of that group.

        Raises
        ------
        KeyError
            The motion has no such group.
        """
        if group not in self.groups:
            raise KeyError(f"no group {group!r}: this motion has {', '.join(self.groups)}")
        count = self.groups[group]
        first = sum(list(self.groups.values())[: list(self.groups).index(group)])
        arrays: dict[str, Any] = {
            name: getattr(self, name)[:, first : first + count] for name in OF_POINTS
        }
        return replace(self, **arrays, groups={group: count})

    def mapped(self, change: Callable[[Array], Array]) -> "Contact":
        """Return this contact with a function applied to every array, each as (K, columns)."""
        changed: dict[str, Any] = {}
        for name, array in self.arrays.items():
            rows = change(array.reshape(len(array), -1))
            changed[name] = rows.reshape(len(rows), *array.shape[1:])
        return replace(self, **changed)


OF_POINTS = ("points", "forces", "bristles")
