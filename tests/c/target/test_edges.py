"""The C text: it compiles without a warning, means what its program means bit for bit, and keeps to
itself.
"""

import ctypes
import re

import numpy as np
import pytest

from serpentail_codegen.ir.step import Step
from serpentail_codegen.targets.c.routine import Routine, routine_lines

from .emitted import REPRODUCIBLE, Library, bits, every_model, run, states_of


@pytest.mark.parametrize("name", ["m1_n1_double_straight", "m1_n1_float_loops", *REPRODUCIBLE])
def test_sine_and_cosine_at_the_edges(models, name):
    library = Library(models(name))
    assert library.sincos(0.0).tolist() == [0, 1]
    assert library.sincos(-0.5).tolist() == (library.sincos(0.5) * [-1, 1]).tolist()
    assert all(np.isnan(library.sincos(x)).all() for x in (np.nan, np.inf, -np.inf))


NUMBER = r"(?<![\w.])\d+(?:\.\d+(?:[eE][-+]?\d+)?|[eE][-+]?\d+)f?"


@every_model
def test_numbers_are_shortest_exact_decimals_of_the_right_type(models, name):
    model = models(name)
    code = re.sub(r"/\*.*?\*/|\"[^\"\n]*\"", "", model.text + model.host.read_text(), flags=re.S)
    code += re.sub(r"/\*.*?\*/|\"[^\"\n]*\"", "", model.simulation.read_text(), flags=re.S)
    literals = set(re.findall(NUMBER, code))
    assert len(literals) > 10
    suffix = "f" if model.manifest["real"] == "float" else ""
    assert {
        text for text in literals if len(text) > len(repr(float(text.rstrip("f")))) + len(suffix)
    } == set()
    assert {text for text in literals if text.endswith("f") != bool(suffix)} == set()


@every_model
def test_not_a_number_is_reported(models, name):
    model = models(name)
    state = states_of(model)[0]
    state["q"][7] = np.nan
    Library(model).call("forward_dynamics", state, status=2)


@every_model
def test_what_the_header_lets_be_null_is_not_read(models, name):
    library, state = Library(models(name)), states_of(models(name))[0]
    for function in library.model.manifest["functions"]:
        assert bits(library.call(function, state, spare=False)) == bits(
            library.call(function, state)
        ), function


SWAP = Step(
    "swap",
    "Exchange.",
    (("x", 3),),
    (("x", 3),),
    (("input", 0), ("input", 1), ("neg", 0)),
    (1, 2, 0),
)


def test_outputs_of_a_step_may_overwrite_its_inputs(tmp_path):
    lines = "\n".join(routine_lines(Routine(SWAP), "double", "x"))
    source, path = tmp_path / "swap.c", tmp_path / "swap.so"
    source.write_text(
        f"#define real double\nvoid swap(const real *x, real *x_out)\n{{\n{lines}\n}}\n"
    )
    run("gcc", "-std=c99", "-shared", "-fPIC", source, "-o", path)
    x = (ctypes.c_double * 3)(1, 2, 3)
    ctypes.CDLL(str(path)).swap(x, x)
    assert list(x) == [2, -1, 1]
