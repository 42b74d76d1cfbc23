"""The manifest: what was emitted goes in, what a loader needs to know comes out as plain data."""

from ..scene.parameters import ANY, BODY_INERTIA, NOT_NEGATIVE, POSITIVE
from ..scene.parse import scene_to_dict
from ..scene.resolve import parameters_of
from ..scene.scene import Scene
from ..scene.signatures.table import EXACT_DERIVATIVES, SIGNATURES
from .c.simulation import layouts

FORMAT = 2
CHECKS = {
    ANY: "finite",
    POSITIVE: "positive",
    NOT_NEGATIVE: "not_negative",
    BODY_INERTIA: "body_inertia",
}


def manifest(scene: Scene, context: dict, emitted: list) -> dict:
    """Return the manifest of a generated folder, without its files."""
    work = {f["name"]: f["work"] for f in context["works"]}
    simulation = {}
    if "has" in context:
        work |= {"rollout": context["rollout_work"]}
        simulation = {"simulation": simulation_entry(context)}
    return {
        "format": FORMAT,
        "generator": context["version"],
        "content_hash": context["content_hash"],
        "abi_hash": context["abi_hash"],
        "prefix": context["prefix"],
        "real": context["real"],
        "scene": scene_to_dict(scene),
        "dimensions": {
            name: getattr(context["tail"], name)
            for name in ("segments", "links", "total", "nq", "nv", "nt")
        },
        "contacts": [
            {"group": name, "count": count} for name, count in context["tail"].groups.items()
        ],
        "parameters": [
            parameter_entry(scene, p) for p in parameters_of(scene.kind, scene.contacts)
        ],
        "functions": {e.function.name: function_entry(e, context["tail"]) for e in emitted},
        "work": work,
        **simulation,
    }


def simulation_entry(context: dict) -> dict:
    """Return what a caller must know of simulations: methods by their numbers, the members of
    records.
    """
    has = context["has"]
    methods = {
        name: number for number, name in enumerate(context["methods"]) if name in has.methods
    }
    return {"methods": methods, "records": layouts(has)}


def parameter_entry(scene: Scene, parameter) -> dict:
    """Return what a caller must know of a parameter; its default is the scene's value, null where
    it is computed.
    """
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


def function_entry(emitted, tail) -> dict:
    """Return what a caller must know of a function."""
    function = emitted.function

    def entries(arguments):
        return [
            {"name": a.name, "shape": list(a.shape(tail)), "meaning": a.meaning} for a in arguments
        ]

    return {
        "doc": function.doc,
        "group": SIGNATURES[function.name].group,
        "exact_derivatives": list(map(list, EXACT_DERIVATIVES.get(function.name, ()))),
        "inputs": entries(function.inputs),
        "outputs": entries(function.outputs),
        "emission": emitted.emission,
        "operations": emitted.body.operations,
    }
