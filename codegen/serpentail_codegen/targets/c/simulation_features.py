"""What a scene's simulation can do, and so which parts its C and its records have."""

from collections.abc import Collection
from dataclasses import dataclass

from ...functions.tail import Tail

# The methods' numbers in C, in order; those with True need `implicit`.
METHODS = {"rk4": False, "tsit5": False, "ros34pw2": True, "implicit_euler": True}


@dataclass(frozen=True)
class SimulationFeatures:
    """What a scene's simulation can do."""

    pfl: bool  # partial feedback linearisation
    factors: int  # reals of implicit_factor's, 0 without
    contacts: int  # points that can touch the ground
    groups: tuple[tuple[str, int], ...]  # of these points: name and count
    legs: bool

    @property
    def ledger(self) -> tuple[tuple[str, int], ...]:
        """What a run adds up, and in how many numbers: works (J), impulses of groups (N s)."""
        works = ["torques", "damping"] + ["ground"] * bool(self.contacts) + ["legs"] * self.legs
        return tuple((name, 1) for name in works) + tuple((name, 3) for name, _ in self.groups)

    @property
    def implicit(self) -> bool:
        """Whether it can take implicit steps."""
        return self.factors > 0

    @property
    def tracked(self) -> bool:
        """Whether feedback linearisation gives v_dot, too: where the ground adds nothing to it."""
        return self.pfl and not self.contacts

    @property
    def methods(self) -> list[str]:
        """The methods it has."""
        return [name for name, implicit in METHODS.items() if self.implicit or not implicit]


def simulation_features(tail: Tail, names: Collection[str], factors: int) -> SimulationFeatures:
    """Return what a simulation of these functions can do, given the length of implicit factors."""
    groups, legs = tuple(tail.groups.items()), "feet" in tail.contacts
    return SimulationFeatures("pfl" in names, factors, tail.points, groups, legs)
