"""The Scene: what to generate, and which keys a scene file may have."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from serpentail_scene.signatures.table import DEFAULT

from .parameters import ANY, PARAMETERS, Parameters, Rule
from .passive import PASSIVE_NAMES, parts_of
from .variant import EQUAL, Shape

KINDS = ("articulated", "continuum", "mixed")
GROUPS = ("feet", "tail", "torso")  # of contact points, in their order
FRICTION = ("cone", "smooth", "paper")
BASES = ("free", "fixed")  # of the tail: a torso that moves, or one that never does
TARGETS = ("c", "casadi")  # languages to emit, in their order
# a model with such a name would hide the system's header
C_HEADERS = (
    "assert|complex|ctype|errno|features|fenv|float|inttypes|iso646|limits|locale|math|setjmp|"
    "signal|stdarg|stdbool|stddef|stdint|stdio|stdlib|string|tgmath|time|wchar|wctype"
)
# Larger models would take more than about a minute: the work grows with the cube of the
# number of segments, and the text of straight lines with every piece.
MOST_SEGMENTS = 100
MOST_LINKS = 10_000  # or samples, of all segments
MOST_STRAIGHT = (20, 100)  # segments, and pieces in all, of straight lines


def _one_of(names: Sequence[str], remark: str = "") -> Rule:
    """Return the rule that a value is one of these names."""
    text = " or ".join(f'"{name}"' for name in names)
    schema = {"enum": list(names)}
    return Rule(text + remark, lambda x: isinstance(x, str) and x in names, schema)


def _names(names: Sequence[str], **more: Any) -> dict[str, Any]:
    """Return the JSON Schema of an array of different names."""
    return {"type": "array", "items": {"enum": list(names)}, "uniqueItems": True} | more


def is_whole(x: object) -> bool:
    """Tell if x is an integer, but not true or false."""
    return isinstance(x, int) and not isinstance(x, bool)


FLAG = Rule("true or false, without quotes", lambda x: isinstance(x, bool), {"type": "boolean"})
COUNT = Rule(
    "a whole number, 1 or above",
    lambda x: is_whole(x) and x >= 1,
    {"type": "integer", "minimum": 1},
)
SEGMENTS = Rule(
    f"{COUNT.text}, or an array of tables, one for each segment",
    lambda x: COUNT.holds(x) or (isinstance(x, list | tuple) and len(x) > 0),
    {"anyOf": [COUNT.schema, {"type": "array", "items": {"type": "object"}, "minItems": 1}]},
)
TEXT = Rule('a text, in "quotes"', lambda x: isinstance(x, str), {"type": "string"})
# the prefix of C symbols, a file's and a folder's name
NAME = Rule(
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
BEND = Rule(
    'an angle above 0 and up to 100 rad, such as "360 deg" or a plain number in rad',
    lambda x: not isinstance(x, bool) and isinstance(x, int | float) and 0 < x <= 100,
    {"exclusiveMinimum": 0, "maximum": 100},
)
CONTACTS = Rule(
    'an array of different names out of "feet", "tail" and "torso", such as ["feet"]',
    lambda x: isinstance(x, list | tuple) and all(n in GROUPS and x.count(n) == 1 for n in x),
    _names(GROUPS),
)
TARGET_NAMES = Rule(
    'an array of different names out of "c" and "casadi", at least one, such as ["c"]',
    lambda x: (
        isinstance(x, list | tuple)
        and len(x) > 0
        and all(n in TARGETS and x.count(n) == 1 for n in x)
    ),
    _names(TARGETS, minItems=1),
)


def _table(name: str) -> Rule:
    """Return the rule that a value is a table."""
    text = f"a table, under a line [{name}]"
    return Rule(text, lambda x: isinstance(x, Mapping), {"type": "object"})


TABLES = Rule(
    "tables, under lines [[phase]]",
    lambda x: isinstance(x, list | tuple) and all(isinstance(each, Mapping) for each in x),
    {"type": "array", "items": {"type": "object"}},
)


@dataclass(frozen=True)
class Scene:
    """What to generate: a tail, its parameters, the functions, and in which form."""

    name: str  # prefix of every C symbol and generated file
    kind: str
    segments: int  # m
    links: int  # n, in each segment; 1 for a continuum and for mixed tails
    functions: tuple[str, ...]  # in the order of their table
    parameters: Parameters
    coordinates: str = (
        "joint"  # of q_t: joint angles alpha_i, beta_i; "bend": a_i, b_i; "polar": phi_i, theta_i
    )
    samples: int = 5  # tail points in each segment of a continuum
    bend_range: float = 2 * math.pi  # rad, largest bend of a continuum segment
    baked: bool = False  # parameters folded into the code, behind the same ABI
    real: str = "double"
    emission: str = "auto"
    profile: str = "fast"  # or "reproducible": the same bits on every machine
    contacts: tuple[
        str, ...
    ] = ()  # groups of points that can touch the ground, in the order of GROUPS
    friction: str = "cone"
    targets: tuple[str, ...] = TARGETS  # in that order
    base: str = "free"  # or "fixed": the torso never moves
    weightless: bool = False
    shape: Shape = EQUAL  # how segments and links differ
    body: str = ""  # the key `body` of the file, as JSON
    unscaled: Parameters | None = None  # before scaling, if `body` scales the parameters
    size: tuple[float, float, float] = (1.0, 1.0, 1.0)  # factors of kg, m and s
    tables: str = ""  # the keys `segments` and `taper` of the file, as JSON; empty: a count

    @property
    def passive(self) -> tuple[str, ...]:
        """Parts of the passive tail that the scene has."""
        return parts_of(self.parameters)


# The keys of a scene file: default (None: required) and rule. ANY: a function of its own checks the
# key.
KEYS: dict[str, tuple[Any, Rule]] = {
    "name": (None, NAME),
    "description": ("", TEXT),
    "kind": (None, _one_of(KINDS)),
    "segments": (None, SEGMENTS),
    "links": (1, COUNT),
    "samples": (Scene.samples, COUNT),
    "bend_range": (Scene.bend_range, BEND),
    "functions": (DEFAULT, ANY),
    "parameters": ({}, ANY),
    "coordinates": (Scene.coordinates, ANY),
    "baked": (Scene.baked, FLAG),
    "real": (Scene.real, _one_of(["double", "float"])),
    "emission": (Scene.emission, _one_of(["auto", "straight", "loops", "lanes", "segments"])),
    "profile": (Scene.profile, _one_of(["fast", "reproducible"])),
    "contacts": ((), CONTACTS),
    "friction": (Scene.friction, _one_of(FRICTION)),
    "targets": (Scene.targets, TARGET_NAMES),
    "plan": (
        {},
        _table("plan"),
    ),  # motions to plan and to simulate, which the runtime checks
    "simulate": ({}, _table("simulate")),
    "identify": ({}, _table("identify")),
    "phase": ((), TABLES),  # of a sequence, likewise
    "sweep": ({}, _table("sweep")),  # of many runs, likewise
    "taper": (None, ANY),
    "body": (None, ANY),  # the size of the animal
    "base": (Scene.base, _one_of(BASES)),
    "weightless": (Scene.weightless, FLAG),
}
NAMES = (*(parameter.name for parameter in PARAMETERS), *PASSIVE_NAMES)


@dataclass(frozen=True)
class Only:
    """What only one kind of tail has: keys, parameters, and its coordinates, with the default
    first.
    """

    keys: tuple[str, ...]
    required: tuple[str, ...]
    parameters: tuple[str, ...]
    coordinates: tuple[str, ...]


ONLY = {
    "articulated": Only(
        ("links",),
        ("links",),
        (
            *("link_radius", "link_inertia"),
            *("link_masses", "link_lengths", "link_centers", "link_inertias"),
        ),
        ("joint",),
    ),
    "continuum": Only(
        ("samples", "bend_range"), (), ("arc_masses", "arc_lengths"), ("bend", "polar")
    ),
    "mixed": Only(
        ("samples", "bend_range"),
        (),
        (
            *("link_masses", "link_lengths", "link_centers", "link_inertias"),
            *("arc_masses", "arc_lengths"),
        ),
        ("mixed",),
    ),
}


def foreign_to(kind: str) -> tuple[list[str], list[str]]:
    """Return the keys and the parameters that only other kinds of tails have."""
    own = ONLY[kind]
    keys = [key for only in ONLY.values() for key in only.keys if key not in own.keys]
    names = [
        name for only in ONLY.values() for name in only.parameters if name not in own.parameters
    ]
    return [*dict.fromkeys(keys)], [*dict.fromkeys(names)]
