"""Contact of a motion: sampled points, forces and bristles go in; depths and groups by name come
out.
"""

from dataclasses import dataclass, fields, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Contact:
    """What touches the ground in K samples of P points: the feet's A, M and T (right, then left),
    the tail, the torso.

    points (K, P, 3) m, world; forces (K, P, 3) N of the ground, world; bristles (K, P, 2) m,
    stretch of the friction springs; groups: how many of the points are feet, tail and torso, in
    that order.
    """

    points: np.ndarray
    forces: np.ndarray
    bristles: np.ndarray
    groups: dict[str, int]

    def __post_init__(self) -> None:
        """Keep read-only copies."""
        for name in ARRAYS:
            array = np.array(getattr(self, name), float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def depth(self) -> np.ndarray:
        """Depth (K, P) in m of the points below the ground; negative above it."""
        return -self.points[..., 2]

    def of(self, group: str) -> "Contact":
        """Return the points of one group; KeyError where the motion has none."""
        first = sum(list(self.groups.values())[: self._place(group)])
        rows = slice(first, first + self.groups[group])
        return Contact(
            self.points[:, rows],
            self.forces[:, rows],
            self.bristles[:, rows],
            {group: self.groups[group]},
        )

    def _place(self, group: str) -> int:
        if group not in self.groups:
            raise KeyError(f"no group {group!r}: this motion has {', '.join(self.groups)}")
        return list(self.groups).index(group)

    def mapped(self, change) -> "Contact":
        """Return this contact with a function applied to every array (K, columns)."""
        arrays = {name: getattr(self, name) for name in ARRAYS}
        flat = {name: change(a.reshape(len(a), -1)) for name, a in arrays.items()}
        return replace(
            self, **{name: a.reshape(len(a), *arrays[name].shape[1:]) for name, a in flat.items()}
        )


ARRAYS = tuple(entry.name for entry in fields(Contact) if entry.name != "groups")
