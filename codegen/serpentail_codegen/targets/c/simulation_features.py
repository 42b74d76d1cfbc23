"""The abilities of a scene's simulation, which decide the parts of its C and of its records."""

from collections.abc import Collection
from dataclasses import dataclass

from ...functions.tail import Tail

# The methods' numbers in C, in order, and what a scene needs for them.
METHODS = {
    "rk4": (),
    "tsit5": (),
    "ros34pw2": ("implicit",),
    "implicit_euler": ("implicit",),
    "switching": ("implicit", "contacts"),
    "dp8": ("free_of_contacts",),
}


@dataclass(frozen=True)
class SimulationFeatures:
    """The abilities of a scene's simulation."""

    pfl: bool  # partial feedback linearisation
    factors: int  # reals of implicit_factor's, 0 without
    contacts: int  # points that can touch the ground
    groups: tuple[tuple[str, int], ...]  # of these points: name and count
    legs: bool
    given: int  # prescribed coordinates
    air: bool
    gradients: bool  # derivatives of whole runs
    tendons: int
    loads: int  # numbers of forces from outside, 0 without

    @property
    def ledger(self) -> tuple[tuple[str, int], ...]:
        """Return the sums that a run keeps, and how many numbers each has: works (J), impulses of
        groups (N s), work and impulse of loads, of the air.
        """
        works = ["torques", "damping"] + ["ground"] * bool(self.contacts) + ["legs"] * self.legs
        works += ["prescribed"] * bool(self.given)
        sums = tuple((name, 1) for name in works) + tuple((name, 3) for name, _ in self.groups)
        sums += (("loads", 1), ("loads", 3)) * bool(self.loads)
        return sums + (("air", 1), ("air", 3)) * self.air

    @property
    def schedule(self) -> tuple[str, int, int]:
        """Return what follows a schedule: its name in C, its angles, numbers with their rates."""
        return ("given", self.given, 3 * self.given) if self.given else ("legs", 4 * self.legs, 8)

    @property
    def parts(self) -> tuple[tuple[str, int, int], ...]:
        """Return what a run keeps the largest force of: all points, groups, feet; their limits."""
        found, first = [("all", 0, self.contacts)], 0
        for name, count in self.groups:
            found.append((name, first, first + count))
            first += count
        half = dict(self.groups).get("feet", 0) // 2  # they come first
        feet = [("right_foot", 0, half), ("left_foot", half, 2 * half)]
        return tuple(found + feet * bool(half))

    @property
    def implicit(self) -> bool:
        """Tell if it can take implicit steps."""
        return self.factors > 0

    @property
    def free_of_contacts(self) -> bool:
        """Tell if it is a model of flights, or of a tail on a fixed base."""
        return not self.contacts

    @property
    def tracked(self) -> bool:
        """Tell if feedback linearisation gives v_dot, too: only without forces of the ground."""
        return self.pfl and not self.contacts

    @property
    def methods(self) -> list[str]:
        """Return the methods that it has."""
        return [
            name for name, needs in METHODS.items() if all(getattr(self, each) for each in needs)
        ]


def simulation_features(tail: Tail, names: Collection[str], factors: int) -> SimulationFeatures:
    """Return the abilities of a simulation of these functions, given the length of implicit
    factors.
    """
    groups, legs = tuple(tail.groups.items()), "feet" in tail.contacts
    more = tail.given, tail.widths > 0, "rates_vjp" in names, tail.tendons
    loads = tail.pushes * ("push_rates" in names)
    return SimulationFeatures("pfl" in names, factors, tail.points, groups, legs, *more, loads)
