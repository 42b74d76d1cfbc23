"""The CasADi target's files: one Python module with the functions that can be symbolic graphs."""

from collections.abc import Iterable
from typing import Any

from ...functions.catalogue import SYMBOLIC
from ...functions.function import Function, assemble
from ...functions.tail import Tail, struct_parameters
from ...ir.step import Step
from ...scene.scene import Scene
from ..target import SEAL, Emission, Target
from ..templating import render
from .printer import PythonPrinter, step_view


def emit(scene: Scene, tail: Tail, functions: Iterable[Function], version: str) -> Emission:
    """Return the module of a scene; functions without a symbolic form exist only in C."""
    views: list[dict[str, Any]] = []
    steps: dict[str, Step] = {}
    for function in functions:
        if function.name in SYMBOLIC:
            printer = PythonPrinter(assemble(function, tail))
            views.append(function_view(function, tail, printer.lines()))
            steps |= printer.steps

    data = {
        "scene": scene,
        "version": version,
        "content_hash": SEAL,
        "functions": views,
        "sizes": {p.name: p.size for p in struct_parameters(scene)},
        "steps": [step_view(step) for step in steps.values()],
        "selects": any(op == "select" for step in steps.values() for op, *_ in step.nodes),
    }
    path = f"{scene.name}_casadi.py"
    return Emission({path: render("casadi", "module.py.jinja", data)}, (path,), {}, {})


def function_view(function: Function, tail: Tail, lines: list[str]) -> dict[str, Any]:
    """Return a function in the form that the template needs."""
    arguments = (*function.inputs, *function.outputs)
    return {
        "name": function.name,
        "doc": function.doc,
        "inputs": [a.name for a in function.inputs],
        "outputs": [a.name for a in function.outputs],
        "shapes": {a.name: list(a.shape(tail)) for a in arguments},
        "lines": lines,
    }


CASADI = Target("casadi", PythonPrinter, emit)
