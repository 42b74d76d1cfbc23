"""The table `body` of a scene: the size of the animal, and a torso of a simple shape.

All other values of the scene describe the animal at scale 1; `body` scales them according to their
units.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import pi, prod
from typing import Any

from serpentail_scene.keys import BODY, TORSOS
from serpentail_scene.parameters import NAMED, Value, name_in
from serpentail_scene.units import dimensions

from .problems import Problem, suggest
from .scene import Chain, Parameters
from .segment_tables import numbers_of

# Exponents of the body mass: bone lengths of legs, Alexander, Jayes, Maloiy & Wathuta, J. Zool. 189
# (1979) 305-314; times of a stride at equivalent speeds, Heglund & Taylor, J. Exp. Biol. 138 (1988)
# 301-318; all else keeps its shape.
LENGTH, LEG, TIME = 1 / 3, 0.35, 0.15
LEG_BONES = "L_"  # first letters of the names of their lengths
OF_TORSO = ("torso_mass", "torso_inertia", "torso_semi_axes")  # what a torso's shape gives


@dataclass(frozen=True)
class Size:
    """Factors for each kilogram, metre and second in a unit, and the factor of lengths of leg
    bones.
    """

    mass: float = 1.0
    length: float = 1.0
    time: float = 1.0
    leg: float = 1.0

    def of(self, name: str, unit: str, value: Any) -> Any:
        """Return the scaled numbers of a parameter; gravity is not scaled."""
        if name in ("gravity", "gravity_vector") or self == SAME:
            return value
        length = self.leg if name.startswith(LEG_BONES) else self.length
        powers = zip((self.mass, length, self.time), dimensions(unit), strict=True)
        factor = prod(base**power for base, power in powers)
        return tuple(x * factor for x in value) if isinstance(value, tuple) else value * factor


SAME = Size()


@dataclass(frozen=True)
class BodyTable:
    """A checked table `body`: scale or mass (kg), the parameters of the torso, and its problems."""

    scale: float | None = None
    mass: float | None = None
    torso: Mapping[str, Value] | None = None
    problems: tuple[Problem, ...] = ()

    def with_torso(self, named: Any, contacts: Collection[str]) -> Any:
        """Return a table of parameters, completed by those that the torso's shape determines."""
        if not self.torso or not isinstance(named, Mapping):
            return named
        touches = "torso" in contacts
        return {**named, **{n: x for n, x in self.torso.items() if touches or n != OF_TORSO[2]}}

    def size(self, total_mass: float) -> Size:
        """Return the size of an animal whose total mass is this (kg) at scale 1.

        A scale keeps the shape and the Froude number, so that times scale with the square root of
        lengths.
        """
        if self.mass is not None:
            ratio = self.mass / total_mass
            return Size(ratio, ratio**LENGTH, ratio**TIME, ratio**LEG)
        if self.scale is not None:
            return Size(self.scale**3, self.scale, self.scale**0.5, self.scale)
        return SAME


def body_table(table: Any, parameters: Any) -> BodyTable:
    """Return the checked table `body` of a scene; parameters: the scene's table of these."""
    if table is None:
        return BodyTable()
    named = parameters if isinstance(parameters, Mapping) else {}
    if not isinstance(table, Mapping):
        return BodyTable(problems=(Problem("body", table, "needs a table: scale or mass, torso"),))
    known = (*BODY, "torso")
    unknown = [key for key in table if key not in known]
    problems = [Problem(f"body.{key}", table[key], suggest(key, known)) for key in unknown]
    if "scale" in table and "mass" in table:
        remedy = "given together with scale: each decides the size; remove one of the two"
        problems.append(Problem("body.mass", table["mass"], remedy))
    size = {name: value for name, value in table.items() if name in BODY}
    numbers = {name: x for name, (x,) in numbers_of("body", size, BODY, 1, problems).items()}
    torso = _torso(table["torso"], named, problems) if "torso" in table else None
    return BodyTable(numbers.get("scale"), numbers.get("mass"), torso, tuple(problems))


def _torso(
    table: Any, named: Mapping[str, Any], problems: list[Problem]
) -> Mapping[str, Value] | None:
    """Return mass, inertia and contact ellipsoid of a torso of uniform density."""
    shape = table.get("shape") if isinstance(table, Mapping) else None
    if not isinstance(shape, str) or shape not in TORSOS:
        names = " or ".join(map(repr, TORSOS))
        remedy = f"needs a table with shape ({names}), its lengths, and density"
        problems.append(Problem("body.torso", table, remedy))
        return None
    keys, before = TORSOS[shape], len(problems)
    values = dict.fromkeys(keys) | {name: x for name, x in table.items() if name != "shape"}
    numbers = numbers_of("body.torso", values, keys, 1, problems)
    if len(problems) > before:
        return None
    lengths, (density,) = (numbers[name] for name in keys)
    torso = _shaped(shape, lengths, density)
    for name in torso.keys() & named.keys():
        remedy = "body.torso gives it: remove one of the two"
        problems.append(Problem(f"parameters.{name}", named[name], remedy))
    return torso


def _shaped(shape: str, lengths: tuple[float, ...], density: float) -> dict[str, Value]:
    """Return the parameters of a uniform ellipsoid with semi-axes, or of a box with sides."""
    round_ = shape == "ellipsoid"
    volume, share = prod(lengths) * (4 / 3 * pi if round_ else 1.0), 5 if round_ else 12
    mass = density * volume
    x2, y2, z2 = (length**2 for length in lengths)
    inertia = tuple(mass / share * each for each in (y2 + z2, x2 + z2, x2 + y2))
    semi_axes = lengths if round_ else tuple(length / 2 for length in lengths)
    return dict(zip(OF_TORSO, (mass, inertia, semi_axes), strict=True))


def _mass(parameters: Mapping[str, Value]) -> float:
    """Return the mass of a tail or another chain, as if it were one."""
    found = [parameters[n] for n in ("tail_mass", "link_masses", "arc_masses") if n in parameters]
    return sum(sum(each) if isinstance(each, tuple) else each for each in found)


def scaled_parameters(
    body: BodyTable, parameters: Parameters, chains: Collection[Chain] = ()
) -> dict[str, Any]:
    """Return the scaled parameters, the original ones, and the size, as Scene stores them.

    chains: besides the tail; their parameters are among all.
    """
    mass = float(parameters.get("torso_mass", 0.0)) + _mass(parameters)  # type: ignore[arg-type]
    mass += sum(_mass(chain.scene.parameters) * len(chain.names) for chain in chains)
    size = body.size(mass)
    if size == SAME:
        return {}
    owners = ("", *(chain.name for chain in chains))
    units = {name_in(o, p.name): p.unit for o in owners for p in NAMED}
    entries = tuple((name, size.of(name, units[name], x)) for name, x in parameters.entries)
    return {
        "parameters": Parameters(entries),
        "unscaled": parameters,
        "size": (size.mass, size.length, size.time),
    }
