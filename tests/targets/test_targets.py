"""Targets: each prints every statement of a program or refuses it in words, and drops none; the
NumPy target that follows the recipe means what the programs mean.
"""

import inspect
import json
import sys
from dataclasses import replace
from types import SimpleNamespace

import jinja2
import numpy as np
import pytest

from serpentail_codegen import pipeline
from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.function import assemble
from serpentail_codegen.ir import program as ir
from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.scene.parse import scene_for
from serpentail_codegen.targets import templating
from serpentail_codegen.targets.c.loops import LoopPrinter, in_loops
from serpentail_codegen.targets.c.routine import routine_lines
from serpentail_codegen.targets.casadi.printer import PythonPrinter, step_view
from serpentail_codegen.targets.target import UnprintableStatement
from serpentail_codegen.targets.templating import render
from serpentail_scene.keys import TARGETS as NAMES
from tests.references.parameters import random_states
from tests.support.programs import SWAP
from tests.support.rows import row
from tests.targets.numpy_target import TARGET


def test_every_printer_has_a_method_for_each_statement_and_for_nothing_else():
    assert tuple(pipeline.TARGETS) == NAMES  # a scene can ask for each
    for target in (*pipeline.TARGETS.values(), TARGET):
        kinds = inspect.getattr_static(target.printer, "statement").dispatcher.registry
        assert set(kinds) - {object} == set(ir.STATEMENTS), target.name


def arrays(b, x=4, y=4):
    """An input and an output of so many scalars."""
    return b.array("x", x, role="input"), b.array("y", y, role="output")


class Rotate:
    """A statement that no target knows."""


def branch(b, x, y):
    with b.when(x.part(0, 1)):
        b.fill(y[0], 0)


def test_what_cannot_be_printed_is_refused():
    empty = Builder("empty", "Empty.").finish()
    for printer in (PythonPrinter(empty), LoopPrinter(empty, "double", "x")):
        with pytest.raises(UnprintableStatement, match=f"{type(printer).__name__} .*Rotate"):
            printer.statement(Rotate())

    def casadi(program):
        return PythonPrinter(program).lines()

    def c(program):
        return in_loops(program, "double", "x")

    rows = [
        ("When", branch, casadi),
        ("Guard", lambda b, x, y: b.guard(x[0], "TOO_SMALL", y[0]), casadi),
        ("Factor", lambda b, x, y: b.factor(y, 2, True), casadi),
        ("Solve", lambda b, x, y: b.solve(y, x.part(0, 2), True), casadi),
        ("wide has lanes", lambda b, x, y: b.fill(b.wide("wide", 1, 8)[0], 0), casadi),
        (
            "cannot be added to the lanes of wide",
            lambda b, x, y: b.copy(b.wide("wide", 1, 8)[0], x.part(0, 1), adds=True),
            c,
        ),
    ]
    for words, build, printed in rows:
        b = Builder("refused", "Refused.")
        build(b, *arrays(b))
        with row(words), pytest.raises(UnprintableStatement, match=words):
            printed(b.finish())


def casadi_values(program, **arguments):
    """Run the Python text of a program on numbers; return its outputs by name."""
    printer = PythonPrinter(program)
    inputs = [array.name for array in program.of_role("input")]
    view = {"name": program.name, "doc": program.doc, "inputs": inputs, "outputs": [], "shapes": {}}
    data = {"scene": SimpleNamespace(name="model"), "version": "", "content_hash": "", "sizes": {}}
    data |= {"functions": [view | {"lines": printer.lines()}], "selects": False}
    data["steps"] = [step_view(step) for step in printer.steps.values()]
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


def test_c_writes_scalars_that_lie_apart_one_by_one():
    b = Builder("apart", "Apart.")
    p, y = b.array("p", 8, role="parameters"), b.array("y", 12, role="output")
    b.fill(y.part(0, 4, 3), 7, 7, 7, 7)
    b.copy(y.part(1, 4), p.part(1, 4, 2))  # folded in
    lines = in_loops(b.finish(), "double", "x", {"p": range(8)}).lines
    copies = [f"y[{k + 1}] = p[{2 * k + 1}];" for k in range(4)]
    assert list(lines[1:]) == [*(f"y[{k}] = 7.0;" for k in (0, 3, 6, 9)), *copies]


def test_c_reads_and_clears_what_lies_apart():
    b = Builder("apart", "Scalars.")
    x, u = arrays(b, 4, 2)
    b.apply(SWAP, {"x": x.part(0, 2, 2)}, x=u[0])
    (routine,) = in_loops(b.finish(), "double", "rat").routines
    lines = routine_lines(routine, "double", "rat")
    assert lines[-2:] == ["x_out[0] = r0;", "x_out[1] = r1;"] and "const real r0 = x[2];" in lines
    b = Builder("apart", "Rows.")
    x, u = b.wide("x", 4, 3), b.wide("u", 2, 3)
    b.fill(x.part(0, 2, 2), 0)
    b.apply(SWAP, {"x": x.part(0, 2, 2)}, x=u[0])
    text = in_loops(b.finish(), "double", "rat")
    loads = "\n".join(routine_lines(text.routines[0], "double", "rat"))
    assert "LOAD(&x[0] + c)" in loads and "LOAD(&x[16] + c)" in loads
    fills = [line for line in text.lines if "fill" in line or "clear" in line]
    assert fills == [f"rat_fill_rows(8, 0.0, {place});" for place in ("x", "x + 16")]


# The recipe for a target

VALUES = ["mass_matrix", "forward_dynamics", "energy", "tail_points"]
DERIVATIVES = ["forward_dynamics_derivatives", "inverse_dynamics_hessian", "inverse_dynamics_vjp"]
SCENES = {
    "one_link": scene_for("articulated", 1, 1, functions=[*VALUES, *DERIVATIVES]),
    "links": scene_for("articulated", 2, 3, functions=[*VALUES, *DERIVATIVES, "implicit"]),
    "arcs": scene_for("continuum", 2, functions=[*VALUES, "inverse_dynamics_derivatives", "pfl"]),
    "feet": scene_for(
        "articulated", 1, 2, contacts=["feet", "tail"], functions=["contact_dynamics", "implicit"]
    ),
}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_emitted_module_computes_what_the_programs_mean(scene, tmp_path, monkeypatch):
    monkeypatch.setitem(pipeline.TARGETS, "numpy", TARGET)
    pipeline.generate(replace(scene, targets=("numpy",)), tmp_path)
    folder, names, rng = tmp_path / scene.name, {}, np.random.default_rng(7)
    exec((folder / f"{scene.name}_numpy.py").read_text(), names)
    manifest = json.loads((folder / "manifest.json").read_text())
    assert names["__doc__"].endswith(f"derivation {manifest['content_hash']}.")
    assert manifest["scene"]["targets"] == ["numpy"] and "work" not in manifest
    tail = pipeline.tail_of(scene)
    states = (rows[0] for rows in random_states(scene.segments, 5, 1, "random"))
    known = dict(zip(("q", "v", "v_dot", "tau"), states, strict=True))
    parameters = {key: np.ravel(value).tolist() for key, value in scene.parameters.items()}
    for name in manifest["functions"]:
        function = CATALOGUE[name].of(tail)
        program = assemble(function, tail)
        positive = {a.name: rng.uniform(0.1, 0.3, a.length(tail)) for a in function.inputs}
        arguments = {key: known.get(key, value) for key, value in positive.items()}
        arrays = (*program.of_role("parameters"), *program.of_role("input"))
        given = {a.name: (parameters | arguments)[a.name] for a in arrays}
        expected = Run(program, Numbers(), given).values
        found = names[name](parameters, **arguments)
        with row(name):
            assert list(found) == [a.name for a in function.outputs]
            for key, values in found.items():
                wanted = np.array(expected[key], float)
                limit = 1e-10 * np.max(np.abs(wanted))
                np.testing.assert_allclose(values, wanted, rtol=0, atol=limit, err_msg=key)


def test_templates_are_compiled_once_for_a_text_and_a_jinja(tmp_path, monkeypatch):
    compiled, usual = [], jinja2.Environment._compile
    monkeypatch.setattr(jinja2.Environment, "_compile", lambda *a: compiled.append(a) or usual(*a))

    def rendered(text, folder=tmp_path):
        kept = templating.CompiledTemplates()
        kept.directory = str(folder)
        made = jinja2.Environment(loader=jinja2.DictLoader({"a": text}), bytecode_cache=kept)
        return made.get_template("a").render()

    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    assert [rendered(text) for text in "1122"] == [*"1122"] and len(compiled) == 2
    monkeypatch.setattr(templating, "installed", lambda _: "another Jinja2")
    assert rendered("2") == "2" == rendered("2", tmp_path / "none") and len(compiled) == 4
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert [rendered("3"), rendered("2")] == ["3", "2"] and len(compiled) == 5
