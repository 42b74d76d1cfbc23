"""The table of functions: each has an assembly, a shape for every tail, and a place in a scene."""

import subprocess
import sys

import pytest

from serpentail_codegen.functions.catalogue import CATALOGUE
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.scene.signatures.signature import ALWAYS, CALLED, GROUND, NAMED
from serpentail_codegen.scene.signatures.table import ALL, EXACT_DERIVATIVES, SIGNATURES

TAILS = [Tail(2, 3), Tail(1, 5, "continuum"), Tail(2, 2, contacts=("feet", "tail", "torso"))]


def test_every_signature_with_outputs_has_an_assembly():
    assert list(CATALOGUE) == [name for name, s in SIGNATURES.items() if s.outputs]
    for name, function in CATALOGUE.items():
        signature = SIGNATURES[name]
        assert (function.inputs, function.outputs) == (signature.inputs, signature.outputs)


@pytest.mark.parametrize("name", CATALOGUE)
@pytest.mark.parametrize("tail", TAILS, ids=["links", "arc", "contacts"])
def test_every_shape_is_known_for_every_tail(name, tail):
    for argument in (*SIGNATURES[name].inputs, *SIGNATURES[name].outputs):
        assert all(n >= 0 for n in argument.shape(tail)) and argument.meaning


def test_it_is_known_when_each_function_is_emitted():
    assert {s.emitted for s in SIGNATURES.values()} == {ALWAYS, GROUND, NAMED, CALLED}
    assert set(ALL) == {name for name, s in SIGNATURES.items() if s.emitted != CALLED}


def test_exact_derivatives_are_functions():
    parts = {part for orders in EXACT_DERIVATIVES.values() for order in orders for part in order}
    assert parts <= set(CATALOGUE)


def test_the_table_needs_no_other_package():
    """A scene is checked without SymPy, NumPy and Jinja, which take a second to import."""
    heavy = "{'sympy', 'numpy', 'jinja2', 'casadi'}"
    script = (
        "import sys, serpentail_codegen.scene.signatures.table, serpentail_codegen.scene.parse; "
    )
    script += f"assert not {heavy} & set(sys.modules), {heavy} & set(sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
