"""All functions of a scene for CasADi, and the values for their templates."""

from typing import Any

from ....functions.catalogue import function_of
from ....functions.tail import Tail, struct_parameters
from ....scene.scene import Scene
from .derivatives import DYNAMICS, adjoint, hessian, jacobian
from .ports import External, Port, pattern

MEANINGS = {  # prefixes of CasADi's names -> what such a function returns
    "": "{}",
    "jac_": "Jacobian of {}",
    "adj1_": "Gradient of the weighted outputs of {}",
    "jac_adj1_": "Jacobian of the gradient of the weighted outputs of {}",
}


def plain(e: External, name: str, sizes: dict[str, int]) -> None:
    """Make a function of the model with dense ports."""
    function = function_of(name, e.tail)
    names = [a.name for a in (*function.inputs, *function.outputs)]
    e.call(name, *names)

    # no derivatives by parameters if the scene left them out but has others
    fixed = any(
        f.name == name and f.has(e.works, "jac_") and not f.by_parameters(e.works) for f in DYNAMICS
    )
    e.inputs = [Port(a.name, pattern(a.length(e.tail), 1), a.name) for a in function.inputs]
    e.inputs.append(Port("parameters", pattern(sizes["parameters"], 1), differentiable=not fixed))

    # matrices are row-major in C, so neighbours in a column are a row apart
    for a in function.outputs:
        shape, length = a.shape(e.tail), a.length(e.tail)
        columns = shape[-1] if len(shape) > 1 else 1
        e.outputs.append(Port(a.name, pattern(length // columns, columns), a.name, columns))


def externals(scene: Scene, tail: Tail, works: dict[str, int]) -> list[External]:
    """Return every function that CasADi can call, each derivative after its function."""
    sizes = {"q": tail.nq, "v": tail.nv, "v_dot": tail.nv, "force": tail.nv, "tau": tail.nt}
    sizes["parameters"] = sum(p.size for p in struct_parameters(scene))

    made: list[External] = []

    def begin(name: str, kind: str = "") -> External:
        symbol = f"{kind}{scene.name}_casadi_{name}"
        doc = MEANINGS[kind].format(name)
        made.append(External(symbol, doc, tail, scene.name, callable_for(scene, name, works)))
        return made[-1]

    for name in works:
        plain(begin(name), name, sizes)
    # derivatives by CasADi's q exist only for a free torso
    for f in () if tail.fixed or tail.branches else DYNAMICS:
        for kind, make in (("jac_", jacobian), ("adj1_", adjoint), ("jac_adj1_", hessian)):
            if f.has(works, kind):
                make(begin(f.name, kind), f, sizes)
    return made


def callable_for(scene: Scene, name: str, works: dict[str, int]) -> dict[str, int]:
    """Return the functions that may be used: no derivatives by parameters that are folded in."""
    suffix = "_parameter_derivatives"
    return {
        other: work
        for other, work in works.items()
        if not (scene.baked and other.endswith(suffix) and other != name)
    }


def casadi_context(scene: Scene, tail: Tail, works: dict[str, int]) -> dict[str, Any]:
    """Return the values for the templates of ``casadi.external``."""
    made = externals(scene, tail, works) if scene.real == "double" else []
    ports = [port for e in made for port in (*e.inputs, *e.outputs)]
    patterns = sorted({port.pattern for port in ports})
    return {
        "externals": made,
        "patterns": patterns,
        "pattern_of": {pattern: k for k, pattern in enumerate(patterns)},
        "casadi_helpers": set().union(*(e.helpers for e in made)),
    }
