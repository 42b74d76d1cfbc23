"""The manifest: what the loader of a generated folder needs to know, as plain data.

The scene and its functions give the entries that hold for every target. Each target adds the
others, such as the workspace of C functions.
"""

from collections.abc import Sequence
from typing import Any

from serpentail_scene.parameters import WIDTHS, Parameter
from serpentail_scene.signatures.arguments import Argument
from serpentail_scene.signatures.table import EXACT_DERIVATIVES, SIGNATURES

from ..functions.function import Function
from ..functions.tail import Tail
from ..scene.parse import scene_to_dict
from ..scene.resolve import each_parameter
from ..scene.scene import Parameters, Scene
from ..scene.variant import Shape
from .target import Emission

FORMAT = 2


def manifest(
    scene: Scene, tail: Tail, functions: Sequence[Function], emissions: Sequence[Emission]
) -> dict[str, Any]:
    """Return the manifest of a generated folder, without its versions, hashes and files."""
    sizes = ("segments", "links", "total", "nq", "nv", "nt")
    described = {
        "prefix": scene.name,
        "real": scene.real,
        "scene": scene_to_dict(scene),
        "dimensions": {name: getattr(tail, name) for name in sizes} | own_counts(tail),
        "contacts": [{"group": name, "count": count} for name, count in tail.groups.items()],
        "parameters": [
            parameter_entry(scene.parameters, part.shape, p) for part, p in each_parameter(scene)
        ],
        "functions": {f.name: function_entry(f, tail, emissions) for f in functions},
    }
    if tail.branches:
        described["chains"] = [chain_entry(chain) for chain in tail.chains]
    if scene.unscaled:  # factors of each kg, m and s in the scene
        described["size"] = dict(zip(("kg", "m", "s"), scene.size, strict=True))
    for emission in emissions:
        described |= emission.entries
    return described


def own_counts(tail: Tail) -> dict[str, Any]:
    """Return the links of each segment if they differ, and the kinds in a mixed tail."""
    counts = {"links": list(tail.shape.counts)} if tail.shape.counts else {}
    return counts | ({"kinds": list(tail.shape.kinds)} if tail.shape.kinds else {})


def chain_entry(chain: Tail) -> dict[str, Any]:
    """Return what a caller must know about a chain of a tree: its segments and points among all."""
    return {
        "name": chain.name or "tail",
        "parameters": chain.owner or "tail",
        "mirrored": chain.mirrored,
        "bend_range": chain.bend_range,
        "segments": [chain.segments_before, chain.segments_before + chain.segments],
        "points": [chain.points_before, chain.points_before + chain.tail_points],
    }


def parameter_entry(values: Parameters, shape: Shape, parameter: Parameter) -> dict[str, Any]:
    """Return what a caller must know about a parameter; the default is null if it is computed.

    pieces: how many links or arcs have their own numbers, in one array for all.
    """
    value = values.get(parameter.name)
    own = parameter.of_pieces
    pieces = {"pieces": shape.numbers_of(parameter.tail)} if own else {}
    default: Any = list(value) if isinstance(value, tuple) else value
    if own and not isinstance(default, list):  # of a single piece
        default = [default]
    entry = pieces | {
        "name": parameter.name,
        "size": parameter.size,
        "unit": parameter.unit,
        "meaning": parameter.meaning,
        "check": parameter.rule.name,
        "default": default,
        "in_struct": not parameter.name.endswith("link_radius"),
    }
    # one number may stand for all of them
    per = "width" if parameter.name == WIDTHS else "coordinate"
    return entry | ({"per": per} if parameter.spread else {})


def function_entry(function: Function, tail: Tail, emissions: Sequence[Emission]) -> dict[str, Any]:
    """Return what a caller must know about a function."""
    exact = EXACT_DERIVATIVES.get(function.name, ())
    entry = {
        "doc": function.doc,
        "group": SIGNATURES[function.name].group,
        "exact_derivatives": [] if tail.fixed or tail.branches else list(map(list, exact)),
        "inputs": [argument_entry(a, tail) for a in function.inputs],
        "outputs": [argument_entry(a, tail) for a in function.outputs],
    }
    for emission in emissions:
        entry |= emission.functions.get(function.name, {})
    return entry


def argument_entry(argument: Argument, tail: Tail) -> dict[str, Any]:
    """Return what a caller must know about an argument."""
    shape = list(argument.shape(tail))
    return {"name": argument.name, "shape": shape, "meaning": argument.meaning}
