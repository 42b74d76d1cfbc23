"""The physical parameters of a model: their names, sizes, units, defaults and rules, and a set of checked values."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

SINGLE = (2.0**-126, (2 - 2.0**-23) * 2.0**127)  # least normal and largest number of a float
Value = float | tuple[float, ...]


@dataclass(frozen=True)
class Rule:
    """What a value must fulfil: in words that complete "needs ...", and as a test."""

    text: str
    holds: Callable[[Any], bool]


ANY = Rule("", lambda _: True)
# Rules for the numbers of a parameter; 1e-12 lets a flat body, with equal sums, pass in spite of rounding.
POSITIVE = Rule(" above 0", lambda x: min(x) > 0)
NOT_NEGATIVE = Rule(", 0 or above", lambda x: min(x) >= 0)
BODY_INERTIA = Rule(
    " above 0, none above the sum of the other two",
    lambda x: min(x) > 0 and 2 * max(x) <= sum(x) * (1 + 1e-12),
)


@dataclass(frozen=True)
class Parameter:
    """One physical parameter: `size` numbers in `unit`; a default of None is computed from the others."""

    name: str
    size: int
    default: Value | None
    unit: str
    check: Rule
    meaning: str


# The defaults are the kangaroo rat of the paper's Table 1. B is the torso frame, at the torso COM.
# fmt: off
PARAMETERS = (
    Parameter("gravity", 1, 9.8, "m/s^2", NOT_NEGATIVE, "gravitational acceleration, along -z of the world"),
    Parameter("torso_mass", 1, 0.10572, "kg", POSITIVE, "mass of the torso"),
    Parameter("torso_inertia", 3, (6.722e-05, 3.639e-05, 7.279e-05), "kg m^2", BODY_INERTIA,
              "principal moments of inertia of the torso about its COM, axes of B"),
    Parameter("tail_mount", 3, (0.0, -0.0405, 0.0045), "m", ANY, "root of the tail from the torso COM, in B"),
    Parameter("tail_mass", 1, 0.00351, "kg", POSITIVE, "mass of the whole tail"),
    Parameter("tail_length", 1, 0.19466, "m", POSITIVE, "length of the whole tail"),
    Parameter("link_radius", 1, 0.0029, "m", NOT_NEGATIVE, "radius of the ellipsoid that gives link_inertia"),
    Parameter("link_inertia", 3, None, "kg m^2", NOT_NEGATIVE,
              "principal moments of inertia of one link about its COM, y along the link"),
)
# fmt: on


@dataclass(frozen=True, eq=False)
class Parameters(Mapping[str, Value]):
    """Resolved parameters by name, in PARAMETERS' order; no link_radius where link_inertia was given."""

    entries: tuple[tuple[str, Value], ...]

    def __getitem__(self, name: str) -> Value:
        return dict(self.entries)[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict(self.entries))

    def __len__(self) -> int:
        return len(self.entries)

    def __hash__(self) -> int:
        return hash(frozenset(self.entries))
