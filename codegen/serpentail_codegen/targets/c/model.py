"""The C target: a scene's programs go in, the text of every C file comes out."""

import hashlib
import json
import math

from ...functions.tail import Tail, struct_parameters
from ...ir.program import VECTOR
from ...scene.scene import Scene
from ..templating import render
from .casadi_external import casadi_context
from .form import Emitted
from .routine import dialect
from .simulation import Has, layouts, simulation_context
from .views import FunctionView, callee_view, callees_of, parameter_views, step_views

COORDINATES = {
    "joint": "alpha_1, beta_1, ... of the joints",
    "bend": "a_1, b_1, ... of the segments' bend",
    "polar": "phi_1, theta_1, ... of the segments' bend",
}
PIECES = {"articulated": "links", "continuum": "samples"}


def offered(tail: Tail, views: list["FunctionView"]) -> Has:
    """Return what the simulation of a scene with these functions can do."""
    outputs = {f.name: f.outputs for f in views}
    factors = outputs["implicit_factor"][0].length if "implicit_factor" in outputs else 0
    return Has(
        "pfl" in outputs, factors, tail.points, tuple(tail.groups.items()), "feet" in tail.contacts
    )


def abi_hash(scene: Scene, tail: Tail, views: list[FunctionView]) -> str:
    """Digest of what a caller relies on: symbols, argument sizes, workspace, the parameter
    struct.
    """
    interface = [scene.name, scene.real, [[p.name, p.size] for p in struct_parameters(scene)]]
    interface += [
        [f.name, [[a.name, a.length] for a in (*f.inputs, *f.outputs)], f.work] for f in views
    ]
    if "rollout" in scene.functions:
        interface += layouts(offered(tail, views)).items()
    return hashlib.sha256(json.dumps(interface).encode()).hexdigest()[:16]


def c_context(scene: Scene, tail: Tail, emitted: list[Emitted], version: str) -> dict:
    """Return everything that the C templates lay out."""
    views = [FunctionView(e, tail, scene.name) for e in emitted]
    literal = dialect(scene.real).literal
    numbers = {"zero": 0, "one": 1, "two": 2, "half": 0.5, "third": 1 / 3}
    numbers |= {"stiffness": 400, "damping": 40}  # of the example's tail
    numbers |= {"word": 2.0**-32, "quarter": math.pi / 2 * 2.0**-30}
    works = {f.name: f.work for f in views}
    rollout = {}
    if "rollout" in scene.functions:
        rollout = simulation_context(scene, tail, offered(tail, views), works)
    return joined(
        {name: literal(value) for name, value in numbers.items()},
        {
            "title": (
                f"{scene.kind} tail, {tail.segments} segments x {tail.links} {PIECES[scene.kind]}"
            ),
            "pieces": PIECES[scene.kind],
            "prefix": scene.name,
            "vector": VECTOR,
            "widest": VECTOR,
            "upper": scene.name.upper(),
            "real": scene.real,
            "reproducible": scene.profile == "reproducible",
            "least": "FLT_MIN" if scene.real == "float" else "DBL_MIN",
            "most": "FLT_MAX" if scene.real == "float" else "DBL_MAX",
            "sqrt": dialect(scene.real).functions["sqrt"],
            "version": version,
            "coordinates": COORDINATES[scene.coordinates],
            "polar": tail.polar,
            "content_hash": "",
            "abi_hash": abi_hash(scene, tail, views),
            "tail": tail,
            "factors": next((a.length for f in views for a in f.outputs if a.name == "factors"), 0),
            "groups": ", ".join(f"{count} of the {name}" for name, count in tail.groups.items()),
            "baked": scene.baked,
            "parameters": parameter_views(scene),
            "parameter_count": sum(p.size for p in struct_parameters(scene)),
            "functions": views,
            "names": [f.name for f in views],
            "most_arrays": max(len(f.inputs) + len(f.outputs) for f in views),
            "works": [{"name": name, "work": work} for name, work in works.items()],
            "steps": step_views(emitted, scene.real, scene.name),
            "callees": [callee_view(*callee, scene.name) for callee in callees_of(emitted)],
            "helpers": sorted(set().union(*(e.body.helpers for e in emitted))),
        },
        rollout,
        casadi_context(scene, tail, works),
    )


def joined(*parts: dict) -> dict:
    """Return the parts of a context as one; no name means two things."""
    names = [name for part in parts for name in part]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"the templates' names {', '.join(twice)} mean two things")
    return {name: value for part in parts for name, value in part.items()}


def c_files(scene: Scene, context: dict) -> dict[str, str]:
    """Render the header, the model, its host entries and an example."""
    name = scene.name
    places = {
        "simulation/simulation.h.jinja": f"include/{name}_simulation.h",
        "simulation/simulation.c.jinja": f"src/{name}_simulation.c",
    }
    return {
        f"include/{name}.h": render("c", "model/header.h.jinja", context),
        f"src/{name}.c": render("c", "model/model.c.jinja", context),
        f"src/{name}_host.c": render("c", "model/host.c.jinja", context),
        "example/main.c": render("c", "model/example.c.jinja", context),
        **(
            {path: render("c", template, context) for template, path in places.items()}
            if "has" in context
            else {}
        ),
    }
