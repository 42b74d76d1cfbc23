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
from tests.support.compile_once import compile_once
from tests.support.derivative_models import (
    derivative_model,
    jacobian_error,
    nest_of,
    parameters_of,
    states,
    tail_name,
)
from tests.support.models import model_folder
from tests.support.programs import Narrow

FLOATS = Numbers(np, float)
SIZES = [(2, 2, "loops"), (1, 3, "straight")]
SIZES += [
    pytest.param(size, marks=pytest.mark.slow)
    for size in [(3, 2, "loops"), (2, None, "loops"), (1, None, "straight")]
]
ROUNDING = 1e-12  # largest error of a block, relative, where products and sums are fused
UNFUSED = 1e-13  # the same where they are not
BUILDS = {"as loaded": None, "plain": (), "avx": ("-mavx2", "-mno-avx512f"), "one lane": ()}
every_build = pytest.mark.parametrize(
    "build", [pytest.param(b, marks=pytest.mark.slow) if b == "avx" else b for b in BUILDS]
)
every_function = pytest.mark.parametrize("name", DERIVATIVES)


@pytest.fixture(scope="module", params=SIZES, ids=tail_name)
def model(request):
    """A compiled model with all derivatives."""
    return derivative_model(*request.param)


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
    found = getattr(model, name)(*arguments(model, name, state))
    return found if isinstance(found, tuple) else (found,)


@cache
def interpreted(model, name, kind=Run):
    """The outputs of a function as its program means them, in order."""
    nest, state = nest_of(model, name), state_of(model)
    inputs = {a.name: list(state[a.name]) for a in nest.of_role("input")}
    values = kind(
        nest, FLOATS, inputs | {n: list(x) for n, x in parameters_of(model).items()}
    ).values
    shapes = [a["shape"] for a in model.manifest["functions"][name]["outputs"]]
    arrays = nest.of_role("output")
    return [
        np.array(values[a.name], float).reshape(shape)
        for a, shape in zip(arrays, shapes, strict=True)
    ]


def limit(model, name, state, rounding=ROUNDING):
    """Largest error of a block; solving with H multiplies rounding."""
    return rounding * (
        equilibrated_condition(model.mass_matrix(state["q"])) if "forward" in name else 1
    )


def assert_close(found, expected, model, largest):
    for one, other in zip(found, expected, strict=True):
        error = jacobian_error(one, other, model.nv, negligible=1e-3)
        assert error <= largest, error


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
    command = (*next(iter(_candidates())), *flags)
    with TemporaryDirectory() as temporary:
        copy = Path(temporary) / "copy.c"
        copy.write_text(text)
        sources = [copy, folder / "src" / f"{model.name}_host.c"]
        library = compile_once("model.so", command, sources, folder / "include")
    return Model(model.checked, model.parameters, ctypes.CDLL(str(library)))


@every_function
@every_build
def test_compiled_text_means_the_program(model, build, name):
    state, found = state_of(model), outputs(built(model, build), name, state_of(model))
    rounding = ROUNDING if build == "as loaded" else UNFUSED
    assert_close(found, interpreted(model, name), model, limit(model, name, state, rounding))


@every_function
def test_lanes_that_are_left_out_are_not_looked_at(model, name):
    """Computed lane by lane, without those that a step is told to leave, the outputs are the same
    and all numbers.
    """
    for one, other in zip(interpreted(model, name, Narrow), interpreted(model, name), strict=True):
        np.testing.assert_array_equal(one, other)


def test_some_lanes_are_left_out():
    """The check above has something to check: sweeps over segments compute what depends on them
    alone.
    """
    model = derivative_model(2, 2, "loops")
    for name in (
        "inverse_dynamics_derivatives",
        "forward_dynamics_derivatives",
        "inverse_dynamics_hessian",
    ):
        calls = [s for s, _ in statements(nest_of(model, name).body) if isinstance(s, Apply)]
        assert any(call.columns for call in calls), name


@every_function
@pytest.mark.parametrize("offset", [1, 3])
def test_workspace_may_begin_anywhere_and_hold_anything(model, name, offset):
    """Vectors need no alignment, and nothing is read that was not written: not even its
    not-a-numbers.
    """
    state = state_of(model)
    other = Model(model.checked, model.parameters, model.library)
    kernel = other.kernel(name)
    size = kernel.work + 1
    memory = np.full(size + 16 + offset, np.nan)
    first = -(memory.ctypes.data // 8) % 8 + offset
    work = memory[first : first + size]
    assert work.ctypes.data % 64 == 8 * offset
    kernel.fast = declined
    kernel.own.buffers = kernel._buffers()
    kernel.own.buffers.record.work = work.ctypes.data
    found = kernel(*arguments(model, name, state))
    found = found if isinstance(found, tuple) else (found,)
    for one, expected in zip(found, outputs(model, name, state), strict=True):
        np.testing.assert_array_equal(one, expected)
    assert not kernel.work or not np.isnan(work).all()
    assert np.isnan(memory[:first]).all() and np.isnan(memory[first + size :]).all()


@every_function
def test_batches_are_their_states_one_by_one(model, name):
    both = [state_of(model, seed) for seed in (5, 6, 5)]
    stacked = {key: np.stack([state[key] for state in both]) for key in both[0]}
    found = outputs(model, name, stacked)
    for k, state in enumerate(both):
        for output, expected in zip(found, outputs(model, name, state), strict=True):
            np.testing.assert_array_equal(output[k], expected)


@pytest.mark.parametrize("emission", ["loops", pytest.param("straight", marks=pytest.mark.slow)])
def test_single_precision(emission):
    """In float the same text holds twice the lanes; what comes out is right to single precision."""
    options = {"functions": DERIVATIVES, "real": "float", "name": "tail_float"}
    single, double = derivative_model(2, 2, emission, **options), derivative_model(2, 2, "loops")
    state = state_of(double)
    for name in DERIVATIVES:
        found = outputs(single, name, {key: x.astype(np.float32) for key, x in state.items()})
        assert all(output.dtype == np.float32 for output in found)
        assert_close(found, outputs(double, name, state), double, limit(double, name, state, 1e-4))


@pytest.mark.parametrize("emission", ["loops", "straight"])
def test_parameters_given_late_count_in_derivatives(emission):
    """Derivatives scale with the masses as forces do: exactly, by two."""
    size = (2, 2, "loops") if emission == "loops" else (1, 3, "straight")
    model = derivative_model(*size)
    p, state = model.parameters, state_of(model)
    twice = {
        name: 2 * np.array(p[name])
        for name in ("torso_mass", "torso_inertia", "tail_mass", "link_inertia")
    }
    heavy = model.with_parameters(**{n: x.tolist() for n, x in twice.items()})
    for name in (
        "inverse_dynamics_derivatives",
        "inverse_dynamics_hessian",
        "energy_derivatives",
        "momentum_derivatives",
    ):
        for one, other in zip(
            outputs(heavy, name, state), outputs(model, name, state), strict=True
        ):
            np.testing.assert_array_equal(one, 2 * other)


# What is refused


@every_function
def test_function_left_out_is_named(name):
    small = st.load(model_folder(1, 1, name="small", functions=["mass_matrix"]))
    state = state_of(small)
    known = {"forward_dynamics_jvp": ("q", "v", "tau", "dq", "dv", "dtau")}
    third = {"inverse": ("q", "v", "v_dot"), "forward": ("q", "v", "tau")}.get(
        name.split("_")[0], ("q", "v")
    )
    weights = ("multiplier",) if name.endswith(("vjp", "hessian")) else ()
    with pytest.raises(st.ModelError, match=f"^small was generated without {name!r} "):
        getattr(small, name)(*(state[n] for n in known.get(name, (*third, *weights))))


@every_function
def test_wrong_arguments_are_named(name):
    model = derivative_model(2, 2, "loops")
    state = state_of(model)
    for k, argument in enumerate(a["name"] for a in model.manifest["functions"][name]["inputs"]):
        size = len(state[argument])
        for shape in [(), (size - 1,), (size + 1,), (2, size + 1), (size, 1)]:
            wrong = arguments(model, name, state | {argument: np.ones(shape)})
            with pytest.raises(
                st.StateError,
                match=re.escape(f"{name}: {argument} has shape {shape}, not ({size},) or"),
            ):
                getattr(model, name)(*wrong)
        for bad in (np.nan, np.inf):
            spoiled = state[argument].copy()
            spoiled[size - 1] = bad
            with pytest.raises(
                st.StateError, match=re.escape(f"{name}: {argument}[{size - 1}]: value {bad}")
            ):
                getattr(model, name)(
                    *(spoiled if j == k else x for j, x in enumerate(arguments(model, name, state)))
                )


@every_function
def test_quaternions_without_direction_are_named(name):
    model = derivative_model(2, 2, "loops")
    state = state_of(model)
    state["q"][3:7] = 0
    with pytest.raises(st.StateError, match=re.escape(f"{name}: the quaternion q[3:7] is zero")):
        outputs(model, name, state)
