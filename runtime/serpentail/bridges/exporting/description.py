"""modelDescription.xml of an FMU: variables, units and dependencies."""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree as Xml

from ... import __version__
from ...model.model import Model
from ...show.animal import animal_of
from .export import xml_file

# our unit -> FMI's: its name, and exponents of SI's base units
UNITS: dict[str, tuple[str, dict[str, int] | None]] = {
    "1": ("1", {}),
    "m": ("m", {"m": 1}),
    "kg": ("kg", {"kg": 1}),
    "rad": ("rad", {"rad": 1}),
    "1/s": ("1/s", {"s": -1}),
    "m/s": ("m/s", {"m": 1, "s": -1}),
    "rad/s": ("rad/s", {"rad": 1, "s": -1}),
    "m/s^2": ("m/s2", {"m": 1, "s": -2}),
    "rad/s^2": ("rad/s2", {"rad": 1, "s": -2}),
    "s": ("s", {"s": 1}),
    "s/m": ("s/m", {"s": 1, "m": -1}),
    "N/m": ("N/m", {"kg": 1, "s": -2}),
    "N/m^1.5": ("N/m1.5", None),  # FMI has whole exponents alone
    "N m": ("N.m", {"kg": 1, "m": 2, "s": -2}),
    "N m s": ("N.m.s", {"kg": 1, "m": 2, "s": -1}),
    "N m/rad": ("N.m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}),
    "kg m^2": ("kg.m2", {"kg": 1, "m": 2}),
}
RATES = {"m": "m/s", "1": "1/s", "rad": "rad/s", "m/s": "m/s^2", "rad/s": "rad/s^2"}
AXES = ("x", "y", "z")
SHARED = {  # of both kinds of interface
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}


class FmuVariable(NamedTuple):
    """A variable: name, description, unit and start value; computed ones have no start value."""

    name: str
    meaning: str
    unit: str
    start: float | None = None
    least: str | None = None


def description(model: Model, guid: str, sources: list[str]) -> bytes:
    """Return the file."""
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=guid,
        description=f"Motion of a torso with a tail: {model.segments} segments, {model.kind}",
        generationTool=f"serpentail {__version__}",
        variableNamingConvention="structured",
        numberOfEventIndicators=str(sum(model.contacts.values())),
    )
    shared = SHARED | {"providesDirectionalDerivative": "false" if model.contacts else "true"}
    extra = {"CoSimulation": {"canHandleVariableCommunicationStepSize": "true"}}
    for kind in ("ModelExchange", "CoSimulation"):
        able = {"modelIdentifier": model.name} | extra.get(kind, {}) | shared
        files = Xml.SubElement(Xml.SubElement(root, kind, able), "SourceFiles")
        for name in sources:
            Xml.SubElement(files, "File", name=name)
    units = Xml.SubElement(root, "UnitDefinitions")
    for name, exponents in UNITS.values():
        unit = Xml.SubElement(units, "Unit", name=name)
        if exponents is not None:
            powers = {base: str(power) for base, power in exponents.items()}
            Xml.SubElement(unit, "BaseUnit", powers)
    categories = Xml.SubElement(root, "LogCategories")
    Xml.SubElement(categories, "Category", name="logStatusError")
    Xml.SubElement(root, "DefaultExperiment", startTime="0", stopTime="0.5")
    _add_variables(root, model)
    return xml_file(root)


def _add_variables(root: Xml.Element, model: Model) -> None:
    """Add all variables in the order of their references, and which are outputs and derivatives."""
    states = [*_states(model)]
    variables = Xml.SubElement(root, "ModelVariables")
    output = {"causality": "output", "variability": "continuous", "initial": "exact"}
    for each in states:
        _add(variables, each, output)
    for index, each in enumerate(states, 1):
        rate = FmuVariable(f"der({each.name})", f"rate of {each.name}", RATES[each.unit])
        real = _add(variables, rate, {"causality": "local", "variability": "continuous"})
        real.set("derivative", str(index))
    for each in _inputs(model):
        _add(variables, each, {"causality": "input", "variability": "continuous"})
    for each in _parameters(model):
        _add(variables, each, {"causality": "parameter", "variability": "tunable"})
    # indices from 1: states, then their derivatives
    structure, n = Xml.SubElement(root, "ModelStructure"), len(states)
    lists = {"Outputs": 0, "Derivatives": n, "InitialUnknowns": n}
    for name, first in lists.items():
        unknowns = Xml.SubElement(structure, name)
        for index in range(first + 1, first + n + 1):
            Xml.SubElement(unknowns, "Unknown", index=str(index))


def _add(variables: Xml.Element, each: FmuVariable, role: dict[str, str]) -> Xml.Element:
    """Add a variable, whose reference is its index; return the element of its type."""
    head = {"name": each.name, "valueReference": str(len(variables)), "description": each.meaning}
    scalar = Xml.SubElement(variables, "ScalarVariable", head | role)
    real = Xml.SubElement(scalar, "Real", unit=UNITS[each.unit][0])
    if each.least is not None:
        real.set("min", each.least)
    if each.start is not None:
        real.set("start", repr(each.start))
    return real


def _states(model: Model) -> Iterator[FmuVariable]:
    """Yield q, v and bristles; the start is upright, straight, at rest, and clear of the ground."""
    for k, (axis, place) in enumerate(zip(AXES, (0.0, 0.0, height(model)), strict=True), 1):
        yield FmuVariable(f"q[{k}]", f"position of B, {axis} of the world", "m", place)
    for k, part in enumerate("wxyz", 4):
        meaning = f"attitude of the torso, {part} of a quaternion of any norm but 0"
        yield FmuVariable(f"q[{k}]", meaning, "1", 1.0 if part == "w" else 0.0)
    for k, name in enumerate(model.names.tail, 8):
        yield FmuVariable(f"q[{k}]", name, "rad", 0.0)
    for k, axis in enumerate(AXES, 1):
        yield FmuVariable(f"v[{k}]", f"velocity of B, {axis} of the world", "m/s", 0.0)
    for k, axis in enumerate(AXES, 4):
        yield FmuVariable(f"v[{k}]", f"angular velocity, {axis} of the torso", "rad/s", 0.0)
    for k, name in enumerate(model.names.tail, 7):
        yield FmuVariable(f"v[{k}]", f"rate of {name}", "rad/s", 0.0)
    for k in range(2 * sum(model.contacts.values())):
        meaning = (
            f"stretch of the friction spring of point {k // 2 + 1}, {AXES[k % 2]} of the world"
        )
        yield FmuVariable(f"bristle[{k + 1}]", meaning, "m", 0.0)


def height(model: Model) -> float:
    """Return the height (m) of B at the start; with contacts a tail straight down is clear."""
    return animal_of(model).length if model.contacts else 0.0


def legs(model: Model) -> int:
    """Return the number of inputs for the legs: four angles and their rates; 0 without feet."""
    return 8 if "feet" in model.contacts else 0


def _inputs(model: Model) -> Iterator[FmuVariable]:
    """Yield the torques, and the angles and rates of the legs."""
    for k, name in enumerate(model.names.tail, 1):
        yield FmuVariable(f"tau[{k}]", f"torque on {name}", "N m", 0.0)
    for k in range(legs(model)):
        angle = f"{('gamma', 'delta')[k % 2]} of the {('right', 'left')[k % 4 // 2]} leg"
        meaning, unit = (angle, "rad") if k < 4 else (f"rate of {angle}", "rad/s")
        yield FmuVariable(f"legs[{k + 1}]", meaning, unit, 0.0)


def _parameters(model: Model) -> Iterator[FmuVariable]:
    """Yield the parameters that can be changed, with their values."""
    entries = [] if model.manifest["scene"]["baked"] else model.manifest["parameters"]
    for entry in entries:
        if entry["in_struct"]:
            values = model.parameters[entry["name"]]
            several = isinstance(values, tuple)
            for k, value in enumerate(values if several else (values,), 1):
                name = f"{entry['name']}[{k}]" if several else entry["name"]
                least = None if entry["check"] == "finite" else "0"
                yield FmuVariable(name, entry["meaning"], entry["unit"], value, least)
