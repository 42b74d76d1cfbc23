"""The physical parameters of a model: what each is, its default and its rule."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Any

SINGLE = (2.0**-126, (2 - 2.0**-23) * 2.0**127)  # least normal and largest number of a float
Value = float | tuple[float, ...]


@dataclass(frozen=True)
class Rule:
    """A condition on a value: as words that complete "needs ...", as a test, and as JSON Schema."""

    text: str
    holds: Callable[[Any], bool]
    schema: Mapping[str, Any] = field(default_factory=dict, compare=False)


ANY = Rule("", lambda _: True)
# Rules for the numbers of a parameter; 1e-12 lets a flat body, with equal sums, pass in spite of
# rounding.
POSITIVE = Rule(" above 0", lambda x: min(x) > 0, {"exclusiveMinimum": 0})
NOT_NEGATIVE = Rule(", 0 or above", lambda x: min(x) >= 0, {"minimum": 0})
BODY_INERTIA = Rule(
    " above 0, none above the sum of the other two",
    lambda x: min(x) > 0 and 2 * max(x) <= sum(x) * (1 + 1e-12),
    {"exclusiveMinimum": 0},
)


@dataclass(frozen=True)
class Parameter:
    """One physical parameter: `size` numbers in `unit`; without a default it is computed from the
    others.

    ``needs`` is a group of contact points, or "contacts" for any of them; empty: every scene has
    the parameter.  ``tail`` says which tails have it: "equal", tails of equal pieces; "link" or
    "arc", tails whose pieces have their own values, ``size`` numbers each; "tilted", tails on
    turned axes; "free", tails of a torso that moves; "weight", all but weightless ones; empty: all.
    """

    name: str
    size: int
    default: Value | None
    unit: str
    check: Rule
    meaning: str
    needs: str = ""
    tail: str = ""


# The defaults are the kangaroo rat of the paper's Table 1. B is the torso frame, at the torso COM.
PARAMETERS = (
    Parameter(
        "gravity",
        1,
        9.8,
        "m/s^2",
        NOT_NEGATIVE,
        "gravitational acceleration, along -z of the world",
        tail="weight",
    ),
    Parameter("torso_mass", 1, 0.10572, "kg", POSITIVE, "mass of the torso", tail="free"),
    Parameter(
        "torso_inertia",
        3,
        (6.722e-05, 3.639e-05, 7.279e-05),
        "kg m^2",
        BODY_INERTIA,
        "principal moments of inertia of the torso about its COM, axes of B",
        tail="free",
    ),
    Parameter(
        "tail_mount",
        3,
        (0.0, -0.0405, 0.0045),
        "m",
        ANY,
        "position of the tail's root relative to the torso COM, in B",
    ),
    Parameter(
        "mount_angles",
        3,
        None,
        "rad",
        ANY,
        "pitch, roll and yaw of the axes at the tail's root, in B; the tail begins along their -y",
        tail="tilted",
    ),
    Parameter("tail_mass", 1, 0.00351, "kg", POSITIVE, "mass of the whole tail", tail="equal"),
    Parameter("tail_length", 1, 0.19466, "m", POSITIVE, "length of the whole tail", tail="equal"),
    Parameter(
        "link_radius",
        1,
        0.0029,
        "m",
        NOT_NEGATIVE,
        "radius of the ellipsoid that gives link_inertia",
        tail="equal",
    ),
    Parameter(
        "link_inertia",
        3,
        None,
        "kg m^2",
        NOT_NEGATIVE,
        "principal moments of inertia of one link about its COM, y along the link",
        tail="equal",
    ),
    Parameter("link_masses", 1, None, "kg", POSITIVE, "mass of each link", tail="link"),
    Parameter("link_lengths", 1, None, "m", POSITIVE, "length of each link", tail="link"),
    Parameter(
        "link_centers",
        1,
        None,
        "m",
        ANY,
        "distance of each link's COM from its joint, along the link",
        tail="link",
    ),
    Parameter(
        "link_inertias",
        3,
        None,
        "kg m^2",
        NOT_NEGATIVE,
        "principal moments of inertia of each link about its COM, y along the link",
        tail="link",
    ),
    Parameter("arc_masses", 1, None, "kg", POSITIVE, "mass of each segment", tail="arc"),
    Parameter("arc_lengths", 1, None, "m", POSITIVE, "length of each segment", tail="arc"),
    Parameter(
        "K_n", 1, 1000.0, "N/m^1.5", POSITIVE, "stiffness K_n of the ground, Eq. 36", "contacts"
    ),
    Parameter(
        "D_n",
        1,
        0.75,
        "s",
        NOT_NEGATIVE,
        "damping of the ground divided by its stiffness, Eq. 36",
        "contacts",
    ),
    Parameter(
        "K_f", 1, 600.0, "N/m", POSITIVE, "stiffness of a friction bristle, Eq. 37", "contacts"
    ),
    Parameter(
        "D_f",
        1,
        0.01,
        "s",
        POSITIVE,
        "damping of a friction bristle divided by its stiffness, Eq. 37",
        "contacts",
    ),
    Parameter("mu", 1, 1.0, "1", NOT_NEGATIVE, "coefficient of friction", "contacts"),
    Parameter(
        "L_h2d", 1, 0.008, "m", NOT_NEGATIVE, "length of the leg link from the hip H to D", "feet"
    ),
    Parameter(
        "L_d2k", 1, 0.024, "m", NOT_NEGATIVE, "length of the leg link from D to the knee K", "feet"
    ),
    Parameter(
        "L_k2a",
        1,
        0.032,
        "m",
        NOT_NEGATIVE,
        "length of the leg link from the knee K to the ankle A",
        "feet",
    ),
    Parameter(
        "L_a2m",
        1,
        0.035,
        "m",
        NOT_NEGATIVE,
        "length of the leg link from the ankle A to the metatarsal M",
        "feet",
    ),
    Parameter(
        "L_m2t",
        1,
        0.016,
        "m",
        NOT_NEGATIVE,
        "length of the leg link from the metatarsal M to the toe T",
        "feet",
    ),
    Parameter(
        "delta_m",
        1,
        pi / 6,
        "rad",
        ANY,
        "constant angle delta_m between sole and thigh, Eq. 8",
        "feet",
    ),
    Parameter(
        "hip",
        3,
        (0.0225, -0.018, 0.01125),
        "m",
        ANY,
        "position p_b2h of the right hip, in B; the left hip has the opposite x",
        "feet",
    ),
    Parameter(
        "torso_semi_axes",
        3,
        (0.0315, 0.0495, 0.027),
        "m",
        POSITIVE,
        "semi-axes of the torso, an ellipsoid centred at B",
        "torso",
    ),
)


@dataclass(frozen=True, eq=False)
class Parameters(Mapping[str, Value]):
    """Parameters with values, in the order of PARAMETERS; without link_radius if a scene names
    link_inertia.
    """

    entries: tuple[tuple[str, Value], ...]

    def __getitem__(self, name: str) -> Value:
        return dict(self.entries)[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict(self.entries))

    def __len__(self) -> int:
        return len(self.entries)

    def __hash__(self) -> int:
        return hash(frozenset(self.entries))
