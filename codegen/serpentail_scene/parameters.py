"""The physical parameters of a model: what each is, its default and its rule."""

import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from math import pi
from typing import Any

from .rules import BODY_INERTIA, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, NumberRule

Value = float | tuple[float, ...]


@dataclass(frozen=True)
class Parameter:
    """One physical parameter: `size` numbers in `unit`; without a default it is computed from the
    others.

    ``needs`` is a group of contact points, "contacts" for any of them, a part of the passive tail,
    or "air"; empty: every scene has the parameter.  ``tail`` says which tails have it: "equal",
    tails of equal pieces; "link" or "arc", tails whose pieces have their own values, ``size``
    numbers each; "ratio", those whose joints turn unequally; "geared", limbs with rotors; "tendon",
    tails with tendons; "guided", those whose guides differ; "tilted", tails on turned axes; "free",
    tails of a torso that moves; "weight", all but weightless ones and those of "sloped" scenes;
    empty: all.
    """

    name: str
    size: int
    default: Value | None
    unit: str
    rule: NumberRule
    meaning: str
    needs: str = ""
    tail: str = ""

    @property
    def of_pieces(self) -> bool:
        """Tell if each link, arc or tendon has its own values."""
        return self.tail in ("link", "arc", "ratio", "geared", *OF_TENDONS)

    @property
    def of_chain(self) -> bool:
        """Tell if each chain of a tree has this parameter, as the tail does."""
        return self.needs in ("", *PARTS) and self.tail not in OF_ANIMAL

    @property
    def spread(self) -> bool:
        """Tell if one number may stand for all tail coordinates, or for all pieces."""
        return self.needs in EACH or self.name == WIDTHS

    def owned(self, chain: str) -> "Parameter":
        """Return this parameter of another chain; without a name that of the tail."""
        if not chain:
            return self
        meaning = re.sub(r"\btail\b", f"chain {chain}", self.meaning)
        return replace(
            self,
            name=name_in(chain, self.name),
            meaning=meaning.replace("tail_", f"{chain}_"),
        )


OF_TENDONS = ("tendon", "guided")  # tails whose tendons have their own values
OF_ANIMAL = ("free", "weight", "sloped", *OF_TENDONS)
Row = tuple[str, int, Value | None, str, NumberRule, str]


def _rows(*rows: Row, needs: str = "", tail: str = "") -> tuple[Parameter, ...]:
    """Return parameters that the same scenes have."""
    return tuple(Parameter(*row, needs, tail) for row in rows)


# fmt: off
# The defaults are the kangaroo rat of the paper's Table 1. B is the torso frame, at the torso COM.
PARAMETERS = (
    *_rows(
        ("gravity", 1, 9.8, "m/s^2", NOT_NEGATIVE,
         "gravitational acceleration, along -z of the world"),
        tail="weight",
    ),
    *_rows(
        ("gravity_vector", 3, None, "m/s^2", FINITE,
         "gravitational acceleration, axes of the world; it replaces gravity"),
        tail="sloped",
    ),
    *_rows(
        ("torso_mass", 1, 0.10572, "kg", POSITIVE, "mass of the torso"),
        ("torso_inertia", 3, (6.722e-05, 3.639e-05, 7.279e-05), "kg m^2", BODY_INERTIA,
         "principal moments of inertia of the torso about its COM, axes of B"),
        tail="free",
    ),
    *_rows(
        ("tail_mount", 3, (0.0, -0.0405, 0.0045), "m", FINITE,
         "position of the tail's root relative to the torso COM, in B"),
    ),
    *_rows(
        ("mount_angles", 3, None, "rad", FINITE,
         "pitch, roll and yaw of the axes at the tail's root, in B; the tail begins along "
         "their -y"),
        tail="tilted",
    ),
    *_rows(
        ("tail_mass", 1, 0.00351, "kg", POSITIVE, "mass of the whole tail"),
        ("tail_length", 1, 0.19466, "m", POSITIVE, "length of the whole tail"),
        ("link_radius", 1, 0.0029, "m", NOT_NEGATIVE,
         "radius of the ellipsoid that gives link_inertia"),
        ("link_inertia", 3, None, "kg m^2", NOT_NEGATIVE,
         "principal moments of inertia of one link about its COM, y along the link"),
        tail="equal",
    ),
    *_rows(
        ("link_masses", 1, None, "kg", POSITIVE, "mass of each link"),
        ("link_lengths", 1, None, "m", POSITIVE, "length of each link"),
        ("link_centers", 1, None, "m", FINITE,
         "distance of each link's COM from its joint, along the link"),
        ("link_inertias", 3, None, "kg m^2", NOT_NEGATIVE,
         "principal moments of inertia of each link about its COM, y along the link"),
        tail="link",
    ),
    *_rows(
        ("link_tips", 3, None, "m", FINITE, "place of the next joint, from each joint"),
        ("link_offsets", 3, None, "m", FINITE, "place of each link's COM, from its joint"),
        tail="link",
    ),
    *_rows(
        ("joint_ratios", 1, None, "1", FINITE,
         "by how many times its segment's angles each joint turns"),
        tail="ratio",
    ),
    *_rows(
        ("rotors", 1, None, "kg m^2", NOT_NEGATIVE,
         "inertia of each hinge's rotor, times the square of the gear ratio"),
        tail="geared",
    ),
    *_rows(
        ("arc_masses", 1, None, "kg", POSITIVE, "mass of each segment"),
        ("arc_lengths", 1, None, "m", POSITIVE, "length of each segment"),
        tail="arc",
    ),
    *_rows(
        ("K_n", 1, 1000.0, "N/m^1.5", POSITIVE, "stiffness K_n of the ground, Eq. 36"),
        ("D_n", 1, 0.75, "s", NOT_NEGATIVE,
         "damping of the ground divided by its stiffness, Eq. 36"),
        ("K_f", 1, 600.0, "N/m", POSITIVE, "stiffness of a friction bristle, Eq. 37"),
        ("D_f", 1, 0.01, "s", POSITIVE,
         "damping of a friction bristle divided by its stiffness, Eq. 37"),
        ("mu", 1, 1.0, "1", NOT_NEGATIVE, "coefficient of friction"),
        needs="contacts",
    ),
    *_rows(
        ("L_h2d", 1, 0.008, "m", NOT_NEGATIVE, "length of the leg link from the hip H to D"),
        ("L_d2k", 1, 0.024, "m", NOT_NEGATIVE, "length of the leg link from D to the knee K"),
        ("L_k2a", 1, 0.032, "m", NOT_NEGATIVE,
         "length of the leg link from the knee K to the ankle A"),
        ("L_a2m", 1, 0.035, "m", NOT_NEGATIVE,
         "length of the leg link from the ankle A to the metatarsal M"),
        ("L_m2t", 1, 0.016, "m", NOT_NEGATIVE,
         "length of the leg link from the metatarsal M to the toe T"),
        ("delta_m", 1, pi / 6, "rad", FINITE,
         "constant angle delta_m between sole and thigh, Eq. 8"),
        ("hip", 3, (0.0225, -0.018, 0.01125), "m", FINITE,
         "position p_b2h of the right hip, in B; the left hip has the opposite x"),
        needs="feet",
    ),
    *_rows(
        ("torso_semi_axes", 3, (0.0315, 0.0495, 0.027), "m", POSITIVE,
         "semi-axes of the torso, an ellipsoid centred at B"),
        needs="torso",
    ),
    *_rows(
        ("tendon_offsets", 2, None, "m", FINITE,
         "x and z of each tendon's guides in the axes of links or arcs, or of its first guide"),
        ("tendon_limits", 1, None, "N", POSITIVE, "largest tension of each tendon"),
        ("tendon_guides", 1, None, "1", FRACTION, "place of each tendon's guide along the links"),
        tail="tendon",
    ),
    *_rows(
        ("tendon_ends", 2, None, "m", FINITE,
         "x and z of each tendon's last guide; linear from guide to guide"),
        ("tendon_roots", 1, None, "m", NOT_NEGATIVE,
         "distance of each tendon's first guide, on the torso, before the mount"),
        tail="guided",
    ),
)
# Air around the animal: a scene has it if it names one of these. Size 0: one number at the root and
# one at the end of each link or arc.
WIDTHS = "tail_widths"
AIR = (
    *_rows(
        ("air_density", 1, None, "kg/m^3", NOT_NEGATIVE, "density of the air; 0: none acts"),
        ("wind", 3, (0.0, 0.0, 0.0), "m/s", FINITE, "velocity of the air, world axes, everywhere"),
        (WIDTHS, 0, None, "m", NOT_NEGATIVE,
         "widths of the tail in the air, at the root and at the end of each link or arc, linear "
         "between"),
        ("tail_drag", 2, (1.1, 0.02), "1", NOT_NEGATIVE,
         "drag coefficients of the tail on its width, across and along it"),
        ("tail_drag_speed", 1, 0.01, "m/s", POSITIVE,
         "speed e below which drag is linear: |u| is sqrt(u^2 + e^2); of turns the same in rad/s"),
        needs="air",
    ),
    *_rows(
        ("torso_drag", 3, (0.0, 0.0, 0.0), "m^2", NOT_NEGATIVE,
         "drag coefficient times area of the torso, along x, y, z of B"),
        ("torso_drag_turning", 3, (0.0, 0.0, 0.0), "m^5", NOT_NEGATIVE,
         "moment of the air on the torso about x, y, z of B, over density |omega| omega / 2"),
        ("torso_air_damping", 3, (0.0, 0.0, 0.0), "N m s", NOT_NEGATIVE,
         "moment of the air on the torso about x, y, z of B, over omega"),
        needs="air", tail="free",
    ),
)
# The passive tail: a scene has a part of it if it names one of the part's parameters; those without
# a default are then required. Size 0: one number for each tail coordinate.
PARTS = ("spring", "damping", "stops")
# parts with numbers for each tail coordinate
EACH = (*PARTS, "stop damping", "rotor", "motor", "power")
PASSIVE = (
    *_rows(
        ("tail_stiffness", 0, None, "N m/rad", NOT_NEGATIVE,
         "stiffness of the springs of the tail coordinates"),
        ("tail_rest", 0, 0.0, "rad", FINITE, "tail coordinates at which the springs are relaxed"),
        needs="spring",
    ),
    *_rows(
        ("tail_damping", 0, None, "N m s", NOT_NEGATIVE, "passive damping of the tail coordinates"),
        needs="damping",
    ),
    *_rows(
        ("tail_stop_lower", 0, None, "rad", FINITE, "tail coordinates below which stops push back"),
        ("tail_stop_upper", 0, None, "rad", FINITE, "tail coordinates above which stops push back"),
        ("tail_stop_stiffness", 0, None, "N m/rad", POSITIVE,
         "stiffness of the stops beyond tail_stop_width"),
        ("tail_stop_width", 0, 0.1, "rad", POSITIVE,
         "angle beyond a stop over which its stiffness grows from zero to tail_stop_stiffness"),
        needs="stops",
    ),
    *_rows(
        ("tail_stop_damping", 0, None, "N m s", NOT_NEGATIVE,
         "damping of the stops beyond tail_stop_width; it grows from zero as their stiffness does"),
        needs="stop damping",
    ),
    *_rows(
        ("tail_rotor", 0, None, "kg m^2", NOT_NEGATIVE,
         "inertia of each motor's rotor times its gear ratio squared"),
        needs="rotor",
    ),
    *_rows(
        ("motor_torque", 0, None, "N m", POSITIVE, "largest torque of each motor, at rest"),
        ("motor_speed", 0, None, "rad/s", POSITIVE, "speed of each motor without load"),
        needs="motor",
    ),
    *_rows(
        ("motor_power", 0, None, "W", POSITIVE, "largest mechanical power of each motor"),
        needs="power",
    ),
)
# fmt: on
OUT_OF_REACH = 1e6  # rad, which no coordinate reaches: stops there have no effect
AIR_NAMES = tuple(p.name for p in AIR)
PASSIVE_NAMES = tuple(p.name for p in PASSIVE)
NAMED = (*PARAMETERS, *AIR, *PASSIVE)  # all that a scene may name
NAMES = tuple(p.name for p in NAMED)


def name_in(chain: str, name: str) -> str:
    """Return the name of a parameter in a chain: ``hind_mass`` is what ``tail_mass`` is for the
    tail.
    """
    return f"{chain}_{key_in_chain(name)}" if chain else name


def key_in_chain(name: str) -> str:
    """Return the key of a parameter in the table of a chain: ``mass`` for ``tail_mass``."""
    return name.removeprefix("tail_")


def parts_of(named: Collection[str]) -> tuple[str, ...]:
    """Return the parts of tails and motors of which the scene names at least one parameter."""
    present = {p.needs for p in PASSIVE if p.name in named}
    return tuple(part for part in EACH if part in present)


def ellipsoid(m: Any, length: Any, r: Any) -> tuple[Any, Any, Any]:
    """I = m/5 [L^2/4 + r^2, 2 r^2, L^2/4 + r^2]: uniform ellipsoid, semi-axes (r, L/2, r)."""
    across, along = m / 5 * (length * length / 4 + r * r), m / 5 * (2 * r * r)
    return across, along, across
