"""The sizes of a tail, by which arrays are declared and the shapes of arguments are known."""

from dataclasses import dataclass
from math import pi

from ..ir.program import padded
from ..scene.parameters import Parameter
from ..scene.resolve import parameters_of
from ..scene.scene import Scene
from .layout import LOAD, Layout

SPRING = 18  # numbers of a point's linearised contact


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
    def tail_points(self) -> int:
        """N + 1 tail points."""
        return self.total + 1

    @property
    def loads(self) -> int:
        """Scalars of loads: a force and a moment at B, a force at each tail point."""
        return LOAD + 3 * self.tail_points

    @property
    def parameter_numbers(self) -> int:
        """Numbers in the parameter struct."""
        return sum(p.size for p in struct_parameters(self))

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

    @property
    def bristles(self) -> int:
        """Stretches of the points' friction springs, along x and y."""
        return 2 * self.points

    @property
    def leg_numbers(self) -> int:
        """Angles and rates of both legs."""
        return 8 if "feet" in self.contacts else 0

    @property
    def weights(self) -> int:
        """Numbers that weight an implicit method's Jacobian: with contacts one more for friction's
        bound.
        """
        return 2 if self.points else 1

    @property
    def factor_blocks(self) -> dict[str, tuple[int, int]]:
        """Size and count of what factoring hands to solving, S first."""
        blocks = {"S": (padded(self.nv), self.nv)}
        if self.contacts:
            blocks |= {"S_turned": (padded(self.nv), self.nv)}
        blocks |= {"H_tail": (self.nt, self.nt), "damped": (1, self.nt)}
        blocks |= dict.fromkeys(["gain_q", "gain_v", "weight"], (1, 1))
        if self.contacts:
            blocks |= {"R": (9, 1), "relax": (1, 1), "depth": (1, self.points)}
            blocks |= {"arm": (3, self.points), "spring": (SPRING, self.points)}
            blocks |= {"J": (3 * self.nt, self.groups.get("tail", 0))}
        return blocks

    @property
    def factors(self) -> int:
        """Numbers that factoring hands to solving."""
        return sum(size * count for size, count in self.factor_blocks.values())

    @property
    def rotational(self) -> int:
        """Rows of H without translation."""
        return 3 + self.nt

    @property
    def rotational_row(self) -> int:
        """Reals from one row of H without translation to the next."""
        return padded(self.rotational)


def struct_parameters(model: Tail | Scene) -> tuple[Parameter, ...]:
    """Return the parameters that the functions of a model read: the fields of its struct."""
    return tuple(p for p in parameters_of(model.kind, model.contacts) if p.name != "link_radius")
