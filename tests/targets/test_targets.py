"""Targets: each prints every statement of a program, or refuses it in words."""

from types import SimpleNamespace

import pytest

from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.targets.casadi.module import PythonPrinter, step_view
from serpentail_codegen.targets.templating import render


def casadi_values(program, **arguments):
    """Run the Python text of a program on numbers; return its outputs by name."""
    printer = PythonPrinter(program)
    inputs = [array.name for array in program.of_role("input")]
    view = {"name": program.name, "doc": program.doc, "inputs": inputs, "outputs": [], "shapes": {}}
    data = {
        "scene": SimpleNamespace(name="model"),
        "version": "",
        "content_hash": "",
        "sizes": {},
        "functions": [view | {"lines": printer.lines()}],
        "steps": [step_view(step) for step in printer.steps.values()],
        "selects": False,
    }
    names: dict = {}
    exec(render("casadi", "module.py.jinja", data), names)
    return names[program.name]({}, **arguments)


def interpreted_values(program, **arguments):
    """Run a program on numbers; return its outputs by name."""
    values = Run(program, Numbers(), arguments).values
    return {array.name: values[array.name] for array in program.of_role("output")}


@pytest.mark.parametrize("stride", [1, 2])
def test_casadi_adds_what_a_copy_adds(stride):
    b = Builder("sums", "Sums.")
    x, y = b.array("x", 6, role="input"), b.array("y", 6, role="output")
    b.fill(y[0], 1, 2, 3, 4, 5, 6)
    b.copy(y.part(0, 3, stride), x.part(1, 3), adds=True)
    program, numbers = b.finish(), [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    assert casadi_values(program, x=numbers) == interpreted_values(program, x=numbers)
