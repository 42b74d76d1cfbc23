"""The C of derivatives: lanes of any width and single precision mean what the programs mean."""

import re

import numpy as np
import pytest

from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_scene.signatures.table import DERIVATIVES
from tests.references.metrics import equilibrated_condition
from tests.support import zoo
from tests.support.derivative_models import jacobian_error, nest_of, parameters_of
from tests.support.programs import Narrow
from tests.support.rows import row

from .target.emitted import Library, library_of, model_of, states_of

ROUNDING = 1e-12  # largest error of a block, relative, where products and sums are fused
UNFUSED = 1e-13  # the same where they are not


def loaded(model, name, state):
    """The outputs of a function of a loaded model."""
    inputs = model.manifest["functions"][name]["inputs"]
    found = model.kernel(name)(*(state[a["name"]] for a in inputs))
    return found if isinstance(found, tuple) else (found,)


def interpreted(model, name, state, kind=Run):
    """The outputs of a function as its program means them."""
    nest = nest_of(model, name)
    inputs = parameters_of(model) | {a.name: state[a.name] for a in nest.of_role("input")}
    values = kind(nest, Numbers(np, float), {n: list(x) for n, x in inputs.items()}).values
    return [np.array(values[a.name], float) for a in nest.of_role("output")]


def assert_close(model, name, state, found, expected, largest):
    """Every block of every output is as close as that; solving with H multiplies rounding."""
    if "forward" in name:
        largest *= equilibrated_condition(model.mass_matrix(state["q"]))
    outputs = model.manifest["functions"][name]["outputs"]
    for one, other, entry in zip(found, expected, outputs, strict=True):
        pair = (np.reshape(x, entry["shape"]) for x in (one, other))
        assert jacobian_error(*pair, model.nv, negligible=1e-3) <= largest


@pytest.mark.parametrize(
    "name",
    ["loops", "m1_n1"]
    + [pytest.param(n, marks=pytest.mark.slow) for n in ("m3_n4", "arcs2_loops", "arcs1")],
)
def test_compiled_text_means_the_program(name):
    """However it is compiled, and computed without the lanes that a step is told to leave."""
    emitted, model, builds = model_of(name), zoo.model(name), {}
    if name != "m1_n1":
        text = emitted.source.read_text()
        text, widths = re.subn(r"^#define LANES \d+$", "#define LANES 1", text, flags=re.MULTILINE)
        assert widths >= 2
        builds["plain"] = library_of(emitted)
        builds["avx"] = Library(emitted, "-mavx2", "-mno-avx512f")
        builds["one lane"] = Library(emitted, text=text)
    state = states_of(emitted)[0]
    for function in DERIVATIVES:
        expected = interpreted(model, function, state)
        for narrow, wide in zip(interpreted(model, function, state, Narrow), expected, strict=True):
            np.testing.assert_array_equal(narrow, wide)
        found = loaded(model, function, state)
        with row(function):
            assert_close(model, function, state, found, expected, ROUNDING)
        for build, library in builds.items():
            found = library.call(function, state).values()
            with row(function, build):
                assert_close(model, function, state, found, expected, UNFUSED)


def test_single_precision():
    """In float the same text holds twice the lanes; what comes out is right to single precision."""
    single, double = zoo.model("single"), zoo.model("m2_n2")
    state = states_of(model_of("m2_n2"))[0]
    for name in DERIVATIVES:
        found = loaded(single, name, {key: x.astype(np.float32) for key, x in state.items()})
        with row(name):
            assert all(output.dtype == np.float32 for output in found)
            expected = loaded(double, name, state)
            assert_close(double, name, state, found, expected, 1e-4)
