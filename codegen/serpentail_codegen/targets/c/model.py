"""The model's own C files, and the values for their templates."""

import hashlib
import json
from typing import Any

from ...functions.tail import Tail, struct_parameters
from ...ir.program import VECTOR
from ...scene.scene import Scene
from ..target import SEAL
from ..templating import render
from .casadi_external.functions import casadi_context
from .form import PrintedFunction, values
from .records import layouts
from .routine import dialect
from .simulation import simulation_context
from .simulation_features import SimulationFeatures, simulation_features
from .views import (
    FunctionView,
    callee_view,
    callees_of,
    step_views,
)

COORDINATES = {
    "joint": "alpha_1, beta_1, ... of the joints",
    "bend": "a_1, b_1, ... of the segments' bend",
    "mixed": "of each segment alpha, beta of its joints, or a, b of its bend",
    "polar": "phi_1, theta_1, ... of the segments' bend",
}
# what they mean, with their signs, as lines of the header
JOINT_ANGLES = (
    "alpha_i, beta_i are the angles of each joint of segment i: a joint turns its link about x by",
    "alpha_i, then about the new z by beta_i, against the link before it (the first: the torso).",
)
BENDS = (
    "(a_i, 0, b_i) is the rotation vector from the root to the tip of segment i, a circular arc.",
    "It is the limit of n alpha_i, n beta_i for a segment of n links.",
)
ANGLES = {
    "joint": JOINT_ANGLES,
    "bend": BENDS,
    "mixed": (*JOINT_ANGLES, *BENDS),
    "polar": (
        "theta_i is the angle between the tangents at the ends of segment i, a circular arc;",
        "phi_i its direction: a bend by -theta_i cos(phi_i) about x, theta_i sin(phi_i) about z.",
    ),
}
HINGES = ("A hinge turns its body about x, y or z of the frame before it, by one coordinate.",)
PIECES = {"articulated": "links", "continuum": "samples", "mixed": "parts"}


def abi_hash(scene: Scene, views: list[FunctionView], simulation: SimulationFeatures | None) -> str:
    """Return a digest of everything that a caller relies on: symbols, sizes, workspace, the
    parameter struct.
    """
    fields = [[p.name, p.size] for p in struct_parameters(scene)]
    interface: list[Any] = [scene.name, scene.real, fields]
    interface += [
        [f.name, [[a.name, a.length] for a in (*f.inputs, *f.outputs)], f.work] for f in views
    ]
    if simulation:
        interface += layouts(simulation).items()
    return hashlib.sha256(json.dumps(interface).encode()).hexdigest()[:16]


def features_of(scene: Scene, tail: Tail, views: list[FunctionView]) -> SimulationFeatures | None:
    """Return what the simulation of a scene with these functions can do, if there is one."""
    outputs = {f.name: f.outputs for f in views}
    factors = outputs["implicit_factor"][0].length if "implicit_factor" in outputs else 0
    return simulation_features(tail, outputs, factors) if "rollout" in scene.functions else None


def c_context(
    scene: Scene, tail: Tail, printed: list[PrintedFunction], version: str
) -> dict[str, Any]:
    """Return all values that the C templates use."""
    views = [FunctionView(function, tail, scene.name) for function in printed]
    works = {f.name: f.work for f in views}
    simulation = features_of(scene, tail, views)
    return joined(
        {"version": version, "content_hash": SEAL, "abi_hash": abi_hash(scene, views, simulation)},
        model_context(scene, tail),
        function_context(scene, printed, views),
        simulation_context(scene, tail, simulation, works) if simulation else {},
        casadi_context(scene, tail, works),
    )


def model_context(scene: Scene, tail: Tail) -> dict[str, Any]:
    """Return the values of templates about the model as a whole: names, sizes, types,
    parameters.
    """
    pieces, single = PIECES[tail.kind], scene.real == "float"
    own = tail.shape.counts
    counts = f"of {', '.join(map(str, own))}" if own else f"x {tail.links}"
    return {
        "title": f"{chains_of(tail)}, {tail.segments} segments {counts} {pieces}{words_of(tail)}",
        "pieces": pieces,
        "prefix": scene.name,
        "upper": scene.name.upper(),
        "targets": scene.targets,
        "reproducible": scene.profile == "reproducible",
        "baked": scene.baked,
        "tail": tail,
        "coordinates": COORDINATES[scene.coordinates],
        "angles": (*ANGLES[scene.coordinates], *HINGES * (tail.hinges > 0)),
        "polar": tail.polar,
        "groups": ", ".join(f"{count} of the {name}" for name, count in tail.groups.items()),
        "parameters": struct_parameters(scene),
        "defaults": {p.name: values(scene, p.name) for p in struct_parameters(scene)},
        "parameter_count": sum(p.size for p in struct_parameters(scene)),
        # the type of all numbers, its limits and its functions
        "real": scene.real,
        "size": 4 if single else 8,
        "least": "FLT_MIN" if single else "DBL_MIN",
        "largest": "FLT_MAX" if single else "DBL_MAX",
        "sqrt": dialect(scene.real).functions["sqrt"],
        "vector": VECTOR,
        "widest": VECTOR,
    }


def chains_of(tail: Tail) -> str:
    """Return the kind of a tail, or the names of a tree's chains, in words."""
    if not tail.branches:
        return f"{tail.kind} tail"
    return f"chains {', '.join(chain.name or 'tail' for chain in tail.chains)}"


def words_of(tail: Tail) -> str:
    """Return the parts of a mixed tail in words."""
    kinds = {"articulated": "links", "continuum": "samples of an arc", "hinge": "a hinge"}
    return f": {', '.join(kinds[kind] for kind in tail.shape.kinds)}" if tail.shape.kinds else ""


def function_context(
    scene: Scene, printed: list[PrintedFunction], views: list[FunctionView]
) -> dict[str, Any]:
    """Return the values of templates about the functions, and about those that they call."""
    outputs = [a for f in views for a in f.outputs]
    return {
        "functions": views,
        "unchecked": [f.unchecked for f in views],
        "names": [f.name for f in views],
        "works": [{"name": f.name, "work": f.work} for f in views],
        "most_arrays": max(len(f.inputs) + len(f.outputs) for f in views),
        "factors": next((a.length for a in outputs if a.name == "factors"), 0),
        "steps": step_views(printed, scene.real, scene.name),
        "callees": [callee_view(*callee, scene.name) for callee in callees_of(printed)],
        "helpers": sorted(set().union(*(f.body.helpers for f in printed))),
    }


def joined(*parts: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of a context as one; a name in two parts is an error."""
    whole: dict[str, Any] = {}
    for part in parts:
        if whole.keys() & part.keys():
            twice = ", ".join(sorted(whole.keys() & part.keys()))
            raise ValueError(f"the templates' names {twice} mean two things")
        whole |= part
    return whole


def model_files(scene: Scene, context: dict[str, Any]) -> dict[str, str]:
    """Render the header, the model, its host entries, an example, and a simulation if any."""
    name = scene.name
    templates = {
        f"include/{name}.h": "model/header.h.jinja",
        f"include/{name}_unchecked.h": "model/unchecked.h.jinja",
        f"src/{name}.c": "model/model.c.jinja",
        f"src/{name}_host.c": "model/host.c.jinja",
        "example/main.c": "model/example.c.jinja",
    }
    if "has" in context:
        templates |= {
            f"include/{name}_simulation.h": "simulation/simulation.h.jinja",
            f"src/{name}_simulation.c": "simulation/simulation.c.jinja",
        }
    return {path: render("c", template, context) for path, template in templates.items()}
