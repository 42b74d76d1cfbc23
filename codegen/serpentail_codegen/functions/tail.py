"""The sizes that decide what a model's functions look like."""

from dataclasses import dataclass
from math import pi

from .layout import Layout


@dataclass(frozen=True)
class Tail(Layout):
    """Sizes of a tail of m segments: n links each, or a continuum with n samples each, bent by
    bend_range at most.
    """

    links: int
    kind: str = "articulated"
    bend_range: float = 2 * pi
    polar: bool = False  # a continuum in the paper's coordinates
    contacts: tuple[str, ...] = ()  # groups of points that can touch the ground
    friction: str = "cone"

    @property
    def total(self) -> int:
        """N = m n links or samples: tail points but the first."""
        return self.segments * self.links

    @property
    def groups(self) -> dict[str, int]:
        """How many points each group has that can touch the ground: A, M and T of both feet, tail,
        torso.
        """
        count = {"feet": 6, "tail": self.total, "torso": 1}
        return {name: count[name] for name in self.contacts}

    @property
    def points(self) -> int:
        """Points that can touch the ground."""
        return sum(self.groups.values())
