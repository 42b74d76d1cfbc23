"""The name and unit of each number of q, v and tau, for models, motions, tables and errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from serpentail_scene.layout import Layout

TORSO_Q = dict.fromkeys(("x", "y", "z"), "m") | dict.fromkeys(("qw", "qx", "qy", "qz"), "1")
TORSO_V = dict.fromkeys(("vx", "vy", "vz"), "m/s")
TORSO_V |= dict.fromkeys(("omega_x", "omega_y", "omega_z"), "rad/s")
WITHOUT_MODEL = ("pitch", "yaw")  # coordinates of a segment, by bend


@dataclass(frozen=True)
class Names:
    """The unit of each number of q, v and tau by its name, in their order.

    tail: the names of the tail's coordinates alone.
    """

    q: dict[str, str]
    v: dict[str, str]
    tau: dict[str, str]
    tail: tuple[str, ...]

    @classmethod
    def of(cls, layout: Layout, own: Sequence[str]) -> Names:
        """Return the names of a layout with its tail's ``own``, if these are as many; else such as
        those of a motion without model, whose tail is of no kind.
        """
        each = (f"{name}_{i + 1}" for i in range(layout.segments) for name in WITHOUT_MODEL)
        tail = tuple(own) if len(own) == layout.nt else tuple(each)[: layout.nt]
        torso_q, torso_v = ({}, {}) if layout.fixed else (TORSO_Q, TORSO_V)
        return cls(
            torso_q | dict.fromkeys(tail, "rad"),
            torso_v | dict.fromkeys([f"{name}_dot" for name in tail], "rad/s"),
            dict.fromkeys([f"tau_{name}" for name in tail], "N m"),
            tail,
        )

    def place(self, name: str) -> tuple[str, int] | None:
        """Return the array, "q", "v" or "tau", and the column of a name; None if it is unknown."""
        for array in ("q", "v", "tau"):
            if name in getattr(self, array):
                return array, [*getattr(self, array)].index(name)
        return None

    def all(self) -> tuple[str, ...]:
        """Return all names."""
        return (*self.q, *self.v, *self.tau)
