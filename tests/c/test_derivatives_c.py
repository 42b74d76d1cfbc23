"""The C of derivatives: lanes of any width, any workspace and single precision mean what the
programs mean.
"""

import ctypes
import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import serpentail as st
from serpentail.model.calls import declined
from serpentail.model.model import Model
from serpentail.model.toolchain import candidates as _candidates
from serpentail_codegen.ir.interpret import Numbers, Run
from serpentail_codegen.ir.program import Apply, statements
from serpentail_codegen.scene.signatures.table import DERIVATIVES
from tests.references.metrics import equilibrated_condition
from tests.support import zoo
from tests.support.compile_once import compile_once
from tests.support.derivative_models import jacobian_error, nest_of, parameters_of, states
from tests.support.programs import Narrow
from tests.support.rows import row

FLOATS = Numbers(np, float)
ROUNDING = 1e-12  # largest error of a block, relative, where products and sums are fused
UNFUSED = 1e-13  # the same where they are not
BUILDS = {"as loaded": None, "plain": (), "avx": ("-mavx2", "-mno-avx512f"), "one lane": ()}
every_model = pytest.mark.parametrize(
    "name",
    ["loops", "m1_n1"]
    + [pytest.param(n, marks=pytest.mark.slow) for n in ("m3_n4", "arcs2_loops", "arcs1")],
)


def state_of(model, seed=5):
    """All arguments that a derivative function may have."""
    rng, state = np.random.default_rng(seed), states(model, "random")[seed % 2]
    shapes = {"dq": model.nv, "dv": model.nv, "dtau": model.nv - 6}
    return state | {name: rng.uniform(-1, 1, size) for name, size in shapes.items()}


def arguments(model, name, state):
    """The arguments of a function in order."""
    return [state[a["name"]] for a in model.manifest["functions"][name]["inputs"]]


def outputs(model, name, state):
    """The outputs of a compiled function, in order."""
    found = model.kernel(name)(*arguments(model, name, state))
    return found if isinstance(found, tuple) else (found,)


def interpreted(model, name, kind=Run):
    """The outputs of a function as its program means them, in order."""
    nest, state = nest_of(model, name), state_of(model)
    inputs = {a.name: list(state[a.name]) for a in nest.of_role("input")}
    inputs |= {n: list(x) for n, x in parameters_of(model).items()}
    values = kind(nest, FLOATS, inputs).values
    shapes = [a["shape"] for a in model.manifest["functions"][name]["outputs"]]
    arrays = zip(nest.of_role("output"), shapes, strict=True)
    return [np.array(values[a.name], float).reshape(shape) for a, shape in arrays]


def limit(model, name, state, rounding=ROUNDING):
    """Largest error of a block; solving with H multiplies rounding."""
    forward = "forward" in name
    return rounding * (equilibrated_condition(model.mass_matrix(state["q"])) if forward else 1)


def assert_close(found, expected, model, largest):
    """Every block of every output is as close as that."""
    for one, other in zip(found, expected, strict=True):
        assert jacobian_error(one, other, model.nv, negligible=1e-3) <= largest


@cache
def built(model, build):
    """The model compiled another way."""
    if build == "as loaded":
        return model
    folder, source = model.folder, model.folder / "src" / f"{model.name}.c"
    text = source.read_text()
    if build == "one lane":
        text, widths = re.subn(r"^#define LANES \d+$", "#define LANES 1", text, flags=re.MULTILINE)
        assert widths >= 2
    flags = ("-std=c99", *BUILDS[build], "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared")
    # v of implicit_factor
    command = (*next(iter(_candidates())), *flags, "-Wno-unused-parameter")
    with TemporaryDirectory() as temporary:
        copy = Path(temporary) / "copy.c"
        copy.write_text(text)
        sources = [copy, folder / "src" / f"{model.name}_host.c"]
        library = compile_once("model.so", command, sources, folder / "include")
    return Model(model.checked, model.parameters, ctypes.CDLL(str(library)))


@every_model
def test_compiled_text_means_the_program(name):
    """However it is compiled, and computed without the lanes that a step is told to leave."""
    model = zoo.model(name)
    state = state_of(model)
    for function in DERIVATIVES:
        expected = interpreted(model, function)
        for narrow, wide in zip(interpreted(model, function, Narrow), expected, strict=True):
            np.testing.assert_array_equal(narrow, wide)
        for build in BUILDS if name != "m1_n1" else ["as loaded"]:
            rounding = ROUNDING if build == "as loaded" else UNFUSED
            found = outputs(built(model, build), function, state)
            with row(function, build):
                assert_close(found, expected, model, limit(model, function, state, rounding))


def test_some_lanes_are_left_out():
    """The check above has something to check: sweeps over segments compute what depends on them
    alone.
    """
    names = ("inverse_dynamics_derivatives", "forward_dynamics_derivatives")
    for name in (*names, "inverse_dynamics_hessian"):
        body = nest_of(zoo.model("loops"), name).body
        calls = [s for s, _ in statements(body) if isinstance(s, Apply)]
        assert any(call.columns for call in calls), name


@pytest.mark.parametrize("name", ["loops", "m1_n1"])
def test_workspace_may_begin_anywhere_and_hold_anything(name):
    """Vectors need no alignment, and nothing is read that was not written: not even its
    not-a-numbers.
    """
    model = zoo.model(name)
    state = state_of(model)
    for function in DERIVATIVES:
        for offset in (1, 3):
            kernel = Model(model.checked, model.parameters, model.library).kernel(function)
            size = kernel.work + 1
            memory = np.full(size + 16 + offset, np.nan)
            first = -(memory.ctypes.data // 8) % 8 + offset
            work = memory[first : first + size]
            kernel.fast = declined
            kernel.own.buffers = kernel._buffers()
            kernel.own.buffers.record.work = work.ctypes.data
            found = kernel(*arguments(model, function, state))
            found = found if isinstance(found, tuple) else (found,)
            with row(function, offset):
                assert work.ctypes.data % 64 == 8 * offset
                for one, expected in zip(found, outputs(model, function, state), strict=True):
                    np.testing.assert_array_equal(one, expected)
                assert not kernel.work or not np.isnan(work).all()
                assert np.isnan(memory[:first]).all() and np.isnan(memory[first + size :]).all()


def test_batches_are_their_states_one_by_one():
    for model in (zoo.model("loops"), zoo.model("m1_n1")):
        several = [state_of(model, seed) for seed in (5, 6, 5)]
        stacked = {key: np.stack([state[key] for state in several]) for key in several[0]}
        for name in DERIVATIVES:
            found = outputs(model, name, stacked)
            for k, state in enumerate(several):
                for output, expected in zip(found, outputs(model, name, state), strict=True):
                    with row(model.name, name, k):
                        np.testing.assert_array_equal(output[k], expected)


def test_single_precision():
    """In float the same text holds twice the lanes; what comes out is right to single precision."""
    single, double = zoo.model("single"), zoo.model("m2_n2")
    state = state_of(double)
    for name in DERIVATIVES:
        found = outputs(single, name, {key: x.astype(np.float32) for key, x in state.items()})
        with row(name):
            assert all(output.dtype == np.float32 for output in found)
            expected = outputs(double, name, state)
            assert_close(found, expected, double, limit(double, name, state, 1e-4))


def test_parameters_given_late_count_in_derivatives():
    """Derivatives scale with the masses as forces do: exactly, by two."""
    masses = ("torso_mass", "torso_inertia", "tail_mass", "link_inertia")
    names = ("inverse_dynamics_derivatives", "inverse_dynamics_hessian")
    for model in (zoo.model("loops"), zoo.model("m1_n1")):
        p, state = model.parameters, state_of(model)
        heavy = model.with_parameters(**{n: (2 * np.array(p[n])).tolist() for n in masses})
        for name in (*names, "energy_derivatives", "momentum_derivatives"):
            pairs = zip(outputs(heavy, name, state), outputs(model, name, state), strict=True)
            for one, other in pairs:
                with row(model.name, name):
                    np.testing.assert_array_equal(one, 2 * other)


# What is refused


def test_function_left_out_is_named():
    bare, full = zoo.model("bare"), zoo.model("m1_n1")
    for name in DERIVATIVES:
        given = arguments(full, name, state_of(full))
        with row(name), pytest.raises(st.ModelError, match=rf"^bare .*{name!r}"):
            getattr(bare, name)(*given)


def test_wrong_arguments_are_named():
    """Every kind of wrong argument in one function, one kind in all functions."""
    model = zoo.model("m1_n1")
    state = state_of(model)
    no_attitude = {"q": np.r_[state["q"][:3], np.zeros(4), state["q"][7:]]}
    for name in DERIVATIVES:
        entry = model.manifest["functions"][name]["inputs"]
        wrong = [(no_attitude, r"quaternion q\[3:7\]")]
        for argument in (a["name"] for a in entry):
            size = len(state[argument])
            shapes = [(), (size - 1,), (size + 1,), (2, size + 1), (size, 1)]
            for shape in shapes if name == "forward_dynamics_jvp" else shapes[1:2]:
                words = f"{argument} .*{re.escape(str(shape))}"
                wrong.append(({argument: np.ones(shape)}, words))
            for bad in (np.nan, np.inf) if name == "forward_dynamics_jvp" else (np.nan,):
                spoiled = np.r_[state[argument][:-1], bad]
                wrong.append(({argument: spoiled}, rf"{argument}\[{size - 1}\].*{bad}"))
        for change, words in wrong:
            with row(name, words), pytest.raises(st.StateError, match=f"{name}: .*{words}"):
                getattr(model, name)(*arguments(model, name, state | change))
