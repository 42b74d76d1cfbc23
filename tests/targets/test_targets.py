"""Targets: each prints every statement of a program or refuses it in words, and drops none."""

import inspect
from types import SimpleNamespace

import pytest

from serpentail_codegen.ir import program as ir
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.pipeline import TARGETS
from serpentail_codegen.scene.scene import TARGETS as NAMES
from serpentail_codegen.targets.c.loops import LoopPrinter, in_loops
from serpentail_codegen.targets.casadi.printer import PythonPrinter, step_view
from serpentail_codegen.targets.target import UnprintableStatement
from serpentail_codegen.targets.templating import render

PARTS = {ir.Index, ir.Array, ir.Ref, ir.Program}  # of statements and of programs
STATEMENTS = [
    kind
    for _, kind in inspect.getmembers(ir, inspect.isclass)
    if kind.__module__ == ir.__name__ and kind not in PARTS
]


def printed_kinds(printer):
    """The kinds of statement that a printer has a method for."""
    return set(inspect.getattr_static(printer, "statement").dispatcher.registry) - {object}


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("kind", STATEMENTS)
def test_every_statement_has_a_method_in_every_printer(name, kind):
    assert kind in printed_kinds(TARGETS[name].printer)


@pytest.mark.parametrize("name", TARGETS)
def test_printers_know_nothing_but_statements(name):
    assert printed_kinds(TARGETS[name].printer) <= set(STATEMENTS)


def test_a_scene_can_ask_for_every_target():
    assert tuple(TARGETS) == NAMES


class Rotate:
    """A statement that no target knows."""


@pytest.mark.parametrize("printer", [PythonPrinter, lambda p: LoopPrinter(p, "double", "x")])
def test_an_unknown_statement_is_refused(printer):
    made = printer(Builder("empty", "Empty.").finish())
    with pytest.raises(UnprintableStatement, match="Printer has no method for Rotate: register"):
        made.statement(Rotate())


# What CasADi's lists cannot hold.


def refused_by_casadi(build):
    """A program of one statement that the CasADi target refuses."""
    b = Builder("refused", "Refused.")
    build(b, b.array("x", 4, role="input"), b.array("y", 4, role="output"))
    return b.finish()


def branch(b, x, y):
    with b.when(x.part(0, 1)):
        b.fill(y[0], 0)


REFUSED = {
    "When: a symbolic graph has no branches": branch,
    "Guard: `where` of the module takes a single scalar": lambda b, x, y: b.guard(
        x[0], "TOO_SMALL", y[0]
    ),
    "FactorPair: only functions that CasADi gets as compiled C": lambda b, x, y: b.emit(
        ir.FactorPair(y, 2)
    ),
    "wide has lanes": lambda b, x, y: b.fill(b.wide("wide", 1, 8)[0], 0),
}


@pytest.mark.parametrize("message", REFUSED)
def test_casadi_refuses_in_words_what_it_cannot_express(message):
    with pytest.raises(UnprintableStatement, match=message):
        PythonPrinter(refused_by_casadi(REFUSED[message])).lines()


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


# What C's helpers take only side by side.


def test_c_fills_scalars_that_lie_apart_one_by_one():
    b = Builder("apart", "Apart.")
    y = b.array("y", 12, role="output")
    b.fill(y.part(0, 4, 3), 7, 7, 7, 7)
    lines = in_loops(b.finish(), "double", "x").lines
    assert list(lines) == [f"y[{k}] = 7.0;" for k in (0, 3, 6, 9)]


def test_c_keeps_the_stride_of_what_is_folded_in():
    b = Builder("apart", "Apart.")
    p, y = b.array("p", 4, role="parameters"), b.array("y", 2, role="output")
    b.copy(y[0], p.part(1, 2, 2))
    lines = in_loops(b.finish(), "double", "x", {"p": [1, 2, 3, 4]}).lines
    assert {"y[0] = p[1];", "y[1] = p[3];"} <= set(lines)


def test_c_refuses_to_add_numbers_to_lanes():
    b = Builder("wide", "Wide.")
    x, wide = b.array("x", 1, role="input"), b.wide("wide", 1, 8)
    b.copy(wide[0], x[0], adds=True)
    with pytest.raises(UnprintableStatement, match="cannot be added to the lanes of wide"):
        in_loops(b.finish(), "double", "x")
