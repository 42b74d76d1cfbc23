"""Drafts: a tail's sizes go in; a builder comes out that finds the vectors its steps read by their
names.
"""

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Tail:
    """Sizes of a tail of m segments: n links each, or a continuum with n samples each, bent by
    bend_range at most.
    """

    segments: int
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
    def nt(self) -> int:
        """Tail coordinates."""
        return 2 * self.segments

    @property
    def nq(self) -> int:
        """Scalars of a configuration."""
        return 7 + self.nt

    @property
    def nv(self) -> int:
        """Scalars of a velocity."""
        return 6 + self.nt

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
