"""The keys of a scene file: what each may hold, and which kinds of tails have it."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .drives import DRIVES
from .purposes import PURPOSES
from .rules import (
    ANY,
    BODY_INERTIA,
    COUNT,
    FINITE,
    FLAG,
    FRACTION,
    NOT_NEGATIVE,
    POSITIVE,
    TABLES,
    TEXT,
    KeyRule,
    NumberRule,
    different,
    one_of,
    table,
    within,
)

KINDS = ("articulated", "continuum", "mixed")
LIMBS = ("limb", "placed_limb")  # of other chains: all bodies along -y, or bodies anywhere
GROUPS = ("feet", "tail", "torso")  # of contact points; other chains follow the tail
TARGETS = ("c", "casadi")  # languages to emit, in their order
# a model with such a name would hide the system's header
C_HEADERS = (
    "assert|complex|ctype|errno|features|fenv|float|inttypes|iso646|limits|locale|math|setjmp|"
    "signal|stdarg|stdbool|stddef|stdint|stdio|stdlib|string|tgmath|time|wchar|wctype"
)
# the prefix of C symbols, a file's and a folder's name
NAME = KeyRule(
    "a text of up to 63 of a-z, 0-9 and _, a letter first, that names no C header: rename the "
    'file, or set name = "..." in it',
    lambda x: (
        isinstance(x, str)
        and re.fullmatch(f"(?!({C_HEADERS})$)[a-z][a-z0-9_]{{0,62}}", x) is not None
    ),
    {
        "type": "string",
        "pattern": "^[a-z][a-z0-9_]{0,62}$",
        "not": {"enum": C_HEADERS.split("|")},
    },
)
SEGMENTS = KeyRule(
    f"{COUNT.text}, or an array of tables, one for each segment",
    lambda x: COUNT.holds(x) or (isinstance(x, list | tuple) and len(x) > 0),
)
BEND = KeyRule(
    'an angle above 0 and up to 100 rad, such as "360 deg" or a plain number in rad',
    lambda x: not isinstance(x, bool) and isinstance(x, int | float) and 0 < x <= 100,
    {"exclusiveMinimum": 0, "maximum": 100},
)
CONTACTS = KeyRule(
    'an array of different names out of "feet", "tail", "torso" and other chains, such as ["feet"]',
    lambda x: (
        isinstance(x, list | tuple)
        and all(isinstance(name, str) and x.count(name) == 1 for name in x)
    ),
    {"type": "array", "items": {"anyOf": [{"enum": [*GROUPS]}, NAME.schema]}, "uniqueItems": True},
)
PURPOSE = different(
    list(PURPOSES),
    f'an array of different names out of {", ".join(PURPOSES)}, such as ["plan"]',
)
TARGET_NAMES = different(
    TARGETS,
    'an array of different names out of "c" and "casadi", at least one, such as ["c"]',
    least=1,
)


@dataclass(frozen=True)
class SceneKey:
    """A key of a scene file: its default, None if it is required or empty, and its rule.

    The rule ANY: a function of its own checks the key.
    """

    default: Any
    rule: KeyRule


KEYS = {
    "name": SceneKey(None, NAME),
    "description": SceneKey("", TEXT),
    "kind": SceneKey(None, one_of(KINDS)),
    "segments": SceneKey(None, SEGMENTS),
    "links": SceneKey(1, COUNT),
    "samples": SceneKey(5, COUNT),
    "bend_range": SceneKey(2 * math.pi, BEND),
    "functions": SceneKey(None, ANY),  # of those that `purpose` and the tables take
    "purpose": SceneKey((), PURPOSE),
    "parameters": SceneKey({}, ANY),
    "coordinates": SceneKey("joint", ANY),
    "baked": SceneKey(False, FLAG),
    "real": SceneKey("double", one_of(["double", "float"])),
    "emission": SceneKey("auto", one_of(["auto", "straight", "loops", "lanes", "segments"])),
    "profile": SceneKey("fast", one_of(["fast", "reproducible"])),
    "contacts": SceneKey((), CONTACTS),
    "friction": SceneKey("cone", one_of(["cone", "smooth", "paper"])),
    "targets": SceneKey(TARGETS, TARGET_NAMES),
    # motions to plan and to simulate, and more that the runtime checks
    "plan": SceneKey({}, table("plan")),
    "simulate": SceneKey({}, table("simulate")),
    "identify": SceneKey({}, table("identify")),
    "phase": SceneKey((), TABLES),
    "sweep": SceneKey({}, table("sweep")),
    "taper": SceneKey(None, ANY),
    "body": SceneKey(None, ANY),  # the size of the animal
    "base": SceneKey("free", one_of(["free", "fixed"])),
    "weightless": SceneKey(False, FLAG),
    "slope": SceneKey(None, ANY),  # of the ground
    "chain": SceneKey({}, table("chain.NAME")),  # besides the tail
    "tendon": SceneKey({}, table("tendon.NAME")),  # that pull the tail
}


@dataclass(frozen=True)
class Only:
    """What only one kind of tail has: keys, parameters, and its coordinates, with the default
    first.
    """

    keys: tuple[str, ...]
    required: tuple[str, ...]
    parameters: tuple[str, ...]
    coordinates: tuple[str, ...]


OF_LINKS = ("link_masses", "link_lengths", "link_centers", "link_inertias")
OF_GUIDES = ("tendon_guides", "tendon_ends", "tendon_roots")
OF_ARCS = ("arc_masses", "arc_lengths")
OF_PLACED = ("link_masses", "link_tips", "link_offsets", "link_inertias")
ONLY = {
    "articulated": Only(
        ("links",),
        ("links",),
        ("link_radius", "link_inertia", "joint_ratios", *OF_LINKS, *OF_GUIDES),
        ("joint",),
    ),
    "continuum": Only(("samples", "bend_range"), (), OF_ARCS, ("bend", "polar")),
    "mixed": Only(("samples", "bend_range"), (), (*OF_LINKS, *OF_ARCS), ("mixed",)),
    "limb": Only((), (), (*OF_LINKS, "rotors"), ("joint",)),
    "placed_limb": Only((), (), (*OF_PLACED, "rotors"), ("joint",)),
}


def foreign_to(kind: str) -> tuple[list[str], list[str]]:
    """Return the keys and the parameters that only other kinds of tails have."""
    has = ONLY[kind]
    keys = [key for only in ONLY.values() for key in only.keys if key not in has.keys]
    names = [
        name for only in ONLY.values() for name in only.parameters if name not in has.parameters
    ]
    return [*dict.fromkeys(keys)], [*dict.fromkeys(names)]


# keys of a table [chain.NAME], besides its parameters
CHAIN = ("on", "pair", "kind", "drive", "segments", "links", "samples", "bend_range", "taper")
OF_LIMB = (
    "on",
    "pair",
    "kind",
    "drive",
    "joints",
    "mount",
    "mount_angles",
)  # of one that is a limb


# ---- keys of tables ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Key:
    """The values that a key of a table may have: numbers, a table of keys, or another form.

    unit: of the numbers; "1" for pure numbers, "" for no numbers; several units: one for each entry
    of an array, the last one for all further entries. rule: of the numbers. size: how many numbers
    belong here; each_link: as many for each link. depth: largest depth of nested arrays that may
    stand in place of one number. usual: whether to warn of values that no animal has.

    keys: of a table, with those that it needs. kinds: keys by the table's ``kind``. each: keys of
    the tables in an array. named: of each value in a table whose names are those of chains and
    joints. words: texts that are allowed instead. form: JSON Schema of any other form.
    """

    unit: str | Sequence[str] = ""
    rule: NumberRule = FINITE
    size: int = 1
    each_link: bool = False
    depth: int = 0
    usual: bool = True
    keys: Mapping[str, "Key"] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    kinds: Mapping[str, "Key"] = field(default_factory=dict)
    each: "Key | None" = None
    named: "Key | None" = None
    words: tuple[str, ...] = ()
    form: Mapping[str, Any] = field(default_factory=dict)

    @property
    def is_table(self) -> bool:
        """Tell whether a table belongs here."""
        return bool(self.keys or self.kinds)


def one_word(*words: str) -> Key:
    """Return the key of one of these words."""
    return Key(form={"enum": list(words)})


# of the tables `segments` and `taper`
LENGTHS = {"length": Key("m", POSITIVE), "link_lengths": Key("m", POSITIVE, each_link=True)}
MASSES = {
    "mass": Key("kg", POSITIVE),
    "link_masses": Key("kg", POSITIVE, each_link=True),
    "density": Key("kg/m^3", POSITIVE),
}
INERTIAS = {
    "link_radius": Key("m", NOT_NEGATIVE),
    "link_inertia": Key("kg m^2", NOT_NEGATIVE, 3),
    "link_inertias": Key("kg m^2", NOT_NEGATIVE, 3, each_link=True),
    "radii": Key("m", POSITIVE, 2),
}
RATIOS = {"ratios": Key("1", each_link=True)}
SEGMENT = {**LENGTHS, **MASSES, **INERTIAS, "link_centers": Key("m", each_link=True), **RATIOS}
# of the tables in `joints` of a limb
JOINT = {
    "length": Key("m", POSITIVE),
    "tip": Key("m", size=3),
    "mass": Key("kg", NOT_NEGATIVE),
    "center": Key("m", size=3),
    "inertia": Key("kg m^2", BODY_INERTIA, 3),
    "radius": Key("m", NOT_NEGATIVE),
    "stiffness": Key("N m/rad", NOT_NEGATIVE),
    "rest": Key("rad"),
    "damping": Key("N m s", NOT_NEGATIVE),
    "stops": Key("rad", size=2),
    "stop_stiffness": Key("N m/rad", POSITIVE),
    "stop_width": Key("rad", POSITIVE),
    "rotor": Key("kg m^2", NOT_NEGATIVE),
}
JOINT_WORDS = {"name": one_word(), "axis": one_word(*"xyz"), "drive": one_word(*DRIVES)}
# of the table `body`; a torso's shape -> its three lengths, and its density
BODY = {"scale": Key("1", within(1e-3, 1e3)), "mass": Key("kg", within(1e-9, 1e9))}
DENSITY = {"density": Key("kg/m^3", within(1e-3, 1e5))}
TORSOS = {
    "ellipsoid": {"semi_axes": Key("m", POSITIVE, 3), **DENSITY},
    "box": {"sides": Key("m", POSITIVE, 3), **DENSITY},
}
SLOPE = {
    "angle": Key("rad", NumberRule("", "from 0 to 180 deg", least=0, most=math.pi)),
    "toward": one_word("x", "y", "-x", "-y"),
}
TAPER = {name: SEGMENT[name] for name in ("length", "radii", "density", "mass")}
# of the tables `tendon.NAME`
TENDON = {
    "offset": Key("m", size=2),
    "radius": Key("m", POSITIVE),
    "tension": Key("N", POSITIVE),
    "guides": Key("1", FRACTION),
    "end_offset": Key("m", size=2),
    "root": Key("m", NOT_NEGATIVE),
}
TENDON_COUNTS = ("to", "count")


def names_of_tendons(tables: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the name of each tendon of checked tables; a ring numbers its own from 1."""
    return tuple(
        f"{name}_{k + 1}" if "count" in table else name
        for name, table in tables.items()
        for k in range(table.get("count", 1))
    )
