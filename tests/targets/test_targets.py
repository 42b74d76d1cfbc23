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
from tests.support.rows import row


def printed_kinds(printer):
    """The kinds of statement that a printer has a method for."""
    return set(inspect.getattr_static(printer, "statement").dispatcher.registry) - {object}


def test_every_printer_has_a_method_for_each_statement_and_for_nothing_else():
    assert tuple(TARGETS) == NAMES  # a scene can ask for each
    for name, target in TARGETS.items():
        assert printed_kinds(target.printer) == set(ir.STATEMENTS), name


class Rotate:
    """A statement that no target knows."""


def test_an_unknown_statement_is_refused():
    program = Builder("empty", "Empty.").finish()
    for printer in (PythonPrinter(program), LoopPrinter(program, "double", "x")):
        with pytest.raises(UnprintableStatement, match=f"{type(printer).__name__} .*Rotate"):
            printer.statement(Rotate())


# What CasADi's lists cannot hold.


def arrays(b, x=4, y=4):
    """An input and an output of so many scalars."""
    return b.array("x", x, role="input"), b.array("y", y, role="output")


def branch(b, x, y):
    with b.when(x.part(0, 1)):
        b.fill(y[0], 0)


def test_casadi_refuses_what_it_cannot_express():
    rows = {
        "When": branch,
        "Guard": lambda b, x, y: b.guard(x[0], "TOO_SMALL", y[0]),
        "FactorPair": lambda b, x, y: b.factor_pair(y, 2),
        "SolvePair": lambda b, x, y: b.solve_pair(y, x.part(0, 2)),
        "wide has lanes": lambda b, x, y: b.fill(b.wide("wide", 1, 8)[0], 0),
    }
    for words, build in rows.items():
        b = Builder("refused", "Refused.")
        build(b, *arrays(b))
        with row(words), pytest.raises(UnprintableStatement, match=words):
            PythonPrinter(b.finish()).lines()


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


def test_casadi_adds_what_a_copy_adds():
    numbers = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    for stride in (1, 2):
        b = Builder("sums", "Sums.")
        x, y = arrays(b, 6, 6)
        b.fill(y[0], 1, 2, 3, 4, 5, 6)
        b.copy(y.part(0, 3, stride), x.part(1, 3), adds=True)
        program = b.finish()
        expected = Run(program, Numbers(), {"x": numbers}).values["y"]
        assert casadi_values(program, x=numbers) == {"y": expected}, stride


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
