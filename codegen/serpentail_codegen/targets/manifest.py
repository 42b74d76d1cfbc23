"""The manifest: what the loader of a generated folder needs to know, as plain data.

The scene and its functions give what holds for every target; each target reports the rest, such as
the workspace of C functions.
"""

from collections.abc import Sequence
from typing import Any

from ..functions.function import Argument, Function
from ..functions.tail import Tail
from ..scene.parameters import ANY, BODY_INERTIA, NOT_NEGATIVE, POSITIVE, Parameter
from ..scene.parse import scene_to_dict
from ..scene.resolve import parameters_of
from ..scene.scene import Scene
from .target import Emission

FORMAT = 1
CHECKS = {
    ANY: "finite",
    POSITIVE: "positive",
    NOT_NEGATIVE: "not_negative",
    BODY_INERTIA: "body_inertia",
}


def manifest(
    scene: Scene, tail: Tail, functions: Sequence[Function], emissions: Sequence[Emission]
) -> dict[str, Any]:
    """Return the manifest of a generated folder, but for its versions, hashes and files."""
    sizes = ("segments", "links", "total", "nq", "nv", "nt")
    described = {
        "prefix": scene.name,
        "real": scene.real,
        "scene": scene_to_dict(scene),
        "dimensions": {name: getattr(tail, name) for name in sizes},
        "contacts": [{"group": name, "count": count} for name, count in tail.groups.items()],
        "parameters": [
            parameter_entry(scene, p) for p in parameters_of(scene.kind, scene.contacts)
        ],
        "functions": {f.name: function_entry(f, tail, emissions) for f in functions},
    }
    for emission in emissions:
        described |= emission.entries
    return described


def parameter_entry(scene: Scene, parameter: Parameter) -> dict[str, Any]:
    """Return what a caller must know of a parameter; the default is null where it is computed."""
    value = scene.parameters.get(parameter.name)
    return {
        "name": parameter.name,
        "size": parameter.size,
        "unit": parameter.unit,
        "meaning": parameter.meaning,
        "check": CHECKS[parameter.check],
        "default": list(value) if isinstance(value, tuple) else value,
        "in_struct": parameter.name != "link_radius",
    }


def function_entry(function: Function, tail: Tail, emissions: Sequence[Emission]) -> dict[str, Any]:
    """Return what a caller must know of a function."""
    entry = {
        "doc": function.doc,
        "inputs": [argument_entry(a, tail) for a in function.inputs],
        "outputs": [argument_entry(a, tail) for a in function.outputs],
    }
    for emission in emissions:
        entry |= emission.functions.get(function.name, {})
    return entry


def argument_entry(argument: Argument, tail: Tail) -> dict[str, Any]:
    """Return what a caller must know of an argument."""
    shape = list(argument.shape(tail))
    return {"name": argument.name, "shape": shape, "meaning": argument.meaning}
