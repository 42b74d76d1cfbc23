"""Reads the table of a chain that is a limb: its `joints`, each a hinge with a body or without."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from serpentail_scene.drives import DRIVE, drives_of
from serpentail_scene.keys import JOINT, NAME
from serpentail_scene.parameters import OUT_OF_REACH, ellipsoid
from serpentail_scene.rules import one_of

from .checks import MOST_SEGMENTS
from .problems import Problem, SceneError
from .resolve import resolve_parameters
from .scene import Scene
from .segment_tables import numbers_of
from .variant import Shape

WORDS = {
    "name": replace(NAME, text=NAME.text.partition(", that")[0]),
    "axis": one_of("xyz"),
    "drive": DRIVE,
}
NEEDS = {  # keys of a hinge that mean nothing without another one
    **dict.fromkeys(("length", "tip", "center", "inertia", "radius"), "mass"),
    **{"rest": "stiffness", "stop_stiffness": "stops", "stop_width": "stops"},
}
EXAMPLE = 'joints = [{name = "knee", length = "40 mm", mass = "3 g", radius = "4 mm"}]'
Hinge = dict[str, tuple[float, ...]]  # the numbers of a table of `joints` by key, in SI units


def limb(name: str, table: Mapping[str, Any], named: Mapping[str, Any]) -> Scene:
    """Return a limb as the scene of a tail without torso; ``named``: parameters that replace what
    its table says.
    """
    joints: Any = table.get("joints")
    listed = isinstance(joints, list | tuple) and 0 < len(joints) <= MOST_SEGMENTS
    if not listed:
        raise SceneError([Problem("joints", joints, f"needs 1 to 100 tables, such as {EXAMPLE}")])
    problems: list[Problem] = []
    hinges = [_hinge(f"joints[{k}]", each, problems) for k, each in enumerate(joints)]
    names = [each.get("name") for each in joints if isinstance(each, Mapping)]
    for k in [k for k, each in enumerate(names) if each in names[:k]]:
        problems.append(Problem(f"joints[{k}].name", names[k], "given before: choose another"))
    axes = [each.get("axis", "x") for each in joints if isinstance(each, Mapping)]
    for k in [k for k in range(len(axes) - 1) if "mass" not in hinges[k]]:
        if not problems and axes[k] == axes[k + 1]:
            remedy = f"nothing lies between it and joints[{k + 1}]: give a mass, or another axis"
            problems.append(Problem(f"joints[{k}].axis", axes[k], remedy))
    if "mass" not in hinges[-1] and not problems:
        remedy = "at the end of a chain: its angle would have no inertia. Give a mass"
        problems.append(Problem(f"joints[{len(joints) - 1}].mass", None, remedy))
    given = {*drives_of(table)} == {"prescribed"}
    for k in [k for k, each in enumerate(hinges) if each.get("mass") == (0.0,) and not given]:
        remedy = 'needs a mass above 0, in kg, or drive = "prescribed" for the whole limb'
        problems.append(Problem(f"joints[{k}].mass", 0.0, remedy))
    if "mount" not in table and "tail_mount" not in named:
        problems.append(Problem("mount", None, "has no default: give it in m"))
    if problems:
        raise SceneError(problems)

    placed = any("tip" in each or _off_axis(each.get("center", ())) for each in hinges)
    kind, rotors = "placed_limb" if placed else "limb", any("rotor" in each for each in hinges)
    values = {"tail_mount": table.get("mount"), "mount_angles": table.get("mount_angles")}
    values = {key: value for key, value in values.items() if value is not None}
    values |= _bodies([each for each in hinges if "mass" in each], placed) | _passive(hinges)
    values |= {"rotors": [each.get("rotor", (0.0,))[0] for each in hinges]} if rotors else {}
    values |= named
    shape = Shape(
        counts=(1,) * len(hinges),
        kinds=tuple(
            joint.get("axis", "x") + ("" if "mass" in hinge else "_bare")
            for joint, hinge in zip(joints, hinges, strict=True)
        ),
        links=sum("mass" in each for each in hinges),
        rotors=len(hinges) * rotors,
        given=given,
        tilted="mount_angles" in values,
    )
    parameters = resolve_parameters(values, 1, kind, (), shape, len(hinges))
    return Scene(name, kind, len(hinges), 1, ("mass_matrix",), parameters, shape=shape)


def _hinge(place: str, table: Any, problems: list[Problem]) -> Hinge:
    """Return the numbers of one table of `joints`."""
    words = WORDS if isinstance(table, Mapping) else {}
    for key in [key for key in words if key in table or key == "name"]:
        if not words[key].holds(table.get(key)):
            problems.append(Problem(f"{place}.{key}", table.get(key), f"needs {words[key].text}"))
    numbers = {k: x for k, x in table.items() if k not in words} if words else table
    before = len(problems)
    found = dict(numbers_of(place, numbers, JOINT, 1, problems))
    if len(problems) == before:
        for key, remedy in _combined(found):
            value = found.get(key, (None,))
            shown = value[0] if len(value) == 1 else value
            problems.append(Problem(f"{place}.{key}", shown, remedy))
    return found


def _combined(found: Hinge) -> Iterator[tuple[str, str]]:
    """Yield keys of a hinge that do not go with others, each with a remedy."""
    for key in [key for key in found if NEEDS.get(key, key) not in found]:
        yield key, f"means nothing without {NEEDS[key]}: give it, too, or remove {key}"
    for one, other in (("length", "tip"), ("inertia", "radius")):
        if "mass" in found and (one in found) == (other in found):
            yield one, f"needs either {one} or {other}"
    if "radius" in found and "tip" in found:
        yield "radius", "is that of a body along -y: give length instead of tip, or inertia"
    if "stops" in found:
        if not found["stops"][0] < found["stops"][1]:
            yield "stops", "needs the lower angle first"
        if "stop_stiffness" not in found:
            yield "stop_stiffness", "stops need it: give it in N m/rad"


def _off_axis(place: tuple[float, ...]) -> bool:
    """Tell if a place is not on the y axis."""
    return any(place[0:3:2])


def _bodies(bodies: list[Hinge], placed: bool) -> dict[str, list[float]]:
    """Return the parameters of bodies, along -y or anywhere."""
    tips = [each.get("tip") or (0.0, -each["length"][0], 0.0) for each in bodies]
    centers = [
        each.get("center") or tuple(x / 2 for x in tip)
        for each, tip in zip(bodies, tips, strict=True)
    ]
    moments = [
        each.get("inertia") or ellipsoid(each["mass"][0], each["length"][0], each["radius"][0])
        for each in bodies
    ]
    found = {"link_masses": [each["mass"][0] for each in bodies]}
    found["link_inertias"] = [x for each in moments for x in each]
    if placed:
        found["link_tips"] = [x for tip in tips for x in tip]
        return found | {"link_offsets": [x for center in centers for x in center]}
    found["link_lengths"] = [-tip[1] for tip in tips]
    return found | {"link_centers": [-center[1] for center in centers]}


def _passive(hinges: list[Hinge]) -> dict[str, list[float]]:
    """Return the parameters of springs, damping and stops; a hinge without them has no effect."""

    def each(key: str, default: float, entry: int = 0) -> list[float]:
        return [hinge[key][entry] if key in hinge else default for hinge in hinges]

    springs = {"tail_stiffness": each("stiffness", 0.0), "tail_rest": each("rest", 0.0)}
    found = springs if any("stiffness" in hinge for hinge in hinges) else {}
    if any("damping" in hinge for hinge in hinges):
        found |= {"tail_damping": each("damping", 0.0)}
    if any("stops" in hinge for hinge in hinges):
        found |= {
            "tail_stop_lower": each("stops", -OUT_OF_REACH),
            "tail_stop_upper": each("stops", OUT_OF_REACH, 1),
            "tail_stop_stiffness": each("stop_stiffness", 1.0),
            "tail_stop_width": each("stop_width", 0.1),
        }
    return found
