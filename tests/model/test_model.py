"""Models: every function takes any array of numbers, alone or in batches, and refuses the rest by
name.
"""

import copy
import gc
import math
import os
import pickle
import subprocess
import sys
import threading
import weakref
from functools import partial

import numpy as np
import pytest

import serpentail as st
from serpentail_codegen.scene.signatures.table import ALL, NEEDS
from tests.support.models import model_folder

SEGMENTS, LINKS = 2, 1
NQ, NV, NT, POINTS = 7 + 2 * SEGMENTS, 6 + 2 * SEGMENTS, 2 * SEGMENTS, SEGMENTS * LINKS + 1
SIZES = {"q": NQ, "v": NV, "v_dot": NV, "tau": NT, "f_ext": 6 + 3 * POINTS}
SIZES |= {"dq": NV, "dv": NV, "dtau": NT, "multiplier": NV, "accelerations": NT}
# Every function: its arguments and the shapes of what it returns.
CALLS = {
    "mass_matrix": (["q"], [(NV, NV)]),
    "bias_force": (["q", "v"], [(NV,)]),
    "inverse_dynamics": (["q", "v", "v_dot"], [(NV,)]),
    "forward_dynamics": (["q", "v", "tau"], [(NV,)]),
    "forward_dynamics_external": (["q", "v", "tau", "f_ext"], [(NV,)]),
    "energy": (["q", "v"], [(), ()]),
    "momentum": (["q", "v"], [(3,), (3,)]),
    "center_of_mass": (["q", "v"], [(3,), (3,), (3, NV)]),
    "tail_points": (["q"], [(POINTS, 3)]),
    "tail_point_jacobians": (["q"], [(POINTS, 3, NV)]),
    "mass_matrix_world": (["q"], [(NV, NV)]),
    "bias_force_world": (["q", "v"], [(NV,)]),
    "forward_dynamics_derivatives": (["q", "v", "tau"], [(NV, NV), (NV, NV), (NV, NT)]),
    "forward_dynamics_parameter_derivatives": (["q", "v", "tau"], [(NV, 13)]),
    "forward_dynamics_jvp": (["q", "v", "tau", "dq", "dv", "dtau"], [(NV,)]),
    "forward_dynamics_vjp": (["q", "v", "tau", "multiplier"], [(NV,), (NV,), (NT,)]),
    "inverse_dynamics_derivatives": (["q", "v", "v_dot"], [(NV, NV), (NV, NV)]),
    "inverse_dynamics_parameter_derivatives": (["q", "v", "v_dot"], [(NV, 13)]),
    "inverse_dynamics_vjp": (["q", "v", "v_dot", "multiplier"], [(NV,), (NV,), (NV,)]),
    "inverse_dynamics_hessian": (["q", "v", "v_dot", "multiplier"], [(NV, NV)] * 4),
    "energy_derivatives": (["q", "v"], [(NV,), (NV,), (NV,)]),
    "momentum_derivatives": (["q", "v"], [(3, NV)] * 4),
    "pfl": (["q", "v", "accelerations"], [(NT,)]),
}
ELSEWHERE = {"rollout", "implicit", *NEEDS}  # tested in files of their own
every_function = pytest.mark.parametrize("name", CALLS)


folder = partial(model_folder, SEGMENTS, LINKS, name="tail", functions="all")


@pytest.fixture(scope="module")
def model():
    return st.load(folder())


@pytest.fixture(scope="module")
def small():
    """A model with one function."""
    return st.load(model_folder(1, 2, name="small", functions=["mass_matrix"]))


@pytest.fixture
def no_process(monkeypatch):
    """Make every attempt to start a process, so every compilation, fail the test."""

    def refuse(*_args, **_options):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)


def states(count, seed=1):
    """Arguments by name, each (count, size), the quaternions of any norm."""
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(-2, 2, (count, size)) for name, size in SIZES.items()}


def state(seed=1):
    """Arguments of one state by name."""
    return {name: rows[0] for name, rows in states(1, seed).items()}


def call(model, name, arguments):
    """The outputs of a function, always in a tuple."""
    method = model.forward_dynamics if name == "forward_dynamics_external" else getattr(model, name)
    result = method(*(arguments[argument] for argument in CALLS[name][0]))
    return result if isinstance(result, tuple) else (result,)


def assert_same(found, expected):
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_every_function_is_called_here():
    assert {*CALLS, *ELSEWHERE} == set(ALL)


def test_sizes(model):
    assert (model.segments, model.links, model.nq, model.nv) == (SEGMENTS, LINKS, NQ, NV)
    assert repr(model) == "<serpentail.Model tail: 2 x 1 links, nv = 10>"


@every_function
def test_outputs_are_plain_arrays(model, name):
    for count in (None, 3):
        outputs = call(model, name, state() if count is None else states(count))
        for output, shape in zip(outputs, CALLS[name][1], strict=True):
            assert output.shape == (shape if count is None else (count, *shape))
            assert output.dtype == np.float64 and np.isfinite(output).all()
            assert output.ndim == 0 or output.flags.c_contiguous


# Arrays of all kinds


@every_function
@pytest.mark.parametrize("count", [0, 1, 500])
def test_batch_is_its_states_one_by_one(model, name, count):
    batch = states(count)
    found = call(model, name, batch)
    for output, shape in zip(found, CALLS[name][1], strict=True):
        assert output.shape == (count, *shape)
    for k in range(0, count, 7):
        alone = call(model, name, {key: rows[k] for key, rows in batch.items()})
        assert_same([output[k] for output in found], alone)


@every_function
def test_single_states_are_repeated_over_a_batch(model, name):
    batch, one, names = states(5), state(seed=2), CALLS[name][0]
    for varied in names:
        mixed = one | {varied: batch[varied]}
        repeated = {key: np.broadcast_to(mixed[key], (5, SIZES[key])) for key in names}
        assert_same(call(model, name, mixed), call(model, name, repeated))


def test_batches_of_different_size_are_refused(model):
    with pytest.raises(
        st.StateError, match=r"^forward_dynamics: batch sizes differ \(1, 3, 5\): give one$"
    ):
        model.forward_dynamics(states(3)["q"], states(5)["v"], states(1)["tau"])
    with pytest.raises(st.StateError, match=r"^energy: batch sizes differ \(0, 1\): give one$"):
        model.energy(states(1)["q"], states(0)["v"])


KINDS = {
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(map(tuple, a.tolist())) if a.ndim == 2 else tuple(a.tolist()),
    "Fortran order": np.asfortranarray,
    "strided": lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
    "reversed": lambda a: a[..., ::-1].copy()[..., ::-1],
    "read-only": lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    "big-endian": lambda a: a.astype(">f8"),
    "pickled": lambda a: pickle.loads(pickle.dumps(a)),
    "long double": lambda a: a.astype(np.longdouble),
    "matrix of a subclass": lambda a: a.view(type("Sub", (np.ndarray,), {})),
}


@every_function
@pytest.mark.parametrize("kind", KINDS)
def test_layout_does_not_matter(model, name, kind):
    for arguments in (state(), states(3)):
        changed = {key: KINDS[kind](value) for key, value in arguments.items()}
        assert_same(call(model, name, changed), call(model, name, arguments))


@every_function
@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int64, np.int8, np.uint16, list])
def test_numbers_of_any_type(model, name, kind):
    whole = {key: np.arange(1, 1 + size) % 5 for key, size in SIZES.items()}
    changed = {
        key: value.tolist() if kind is list else value.astype(kind) for key, value in whole.items()
    }
    assert_same(
        call(model, name, changed),
        call(model, name, {k: v.astype(float) for k, v in whole.items()}),
    )


def test_arguments_are_left_alone(model):
    for name in CALLS:
        for arguments in (state(), states(3)):
            before = copy.deepcopy(arguments)
            call(model, name, arguments)
            assert_same(arguments.values(), before.values())


@every_function
def test_outputs_are_the_callers_own(model, name):
    for arguments, other in ((state(1), state(2)), (states(3, 1), states(3, 2))):
        kept = call(model, name, arguments)
        copies = copy.deepcopy(kept)
        for output in call(model, name, other):
            if output.ndim:
                output[...] = np.nan
        assert_same(kept, copies)
        assert_same(call(model, name, arguments), copies)


# What is refused


class Foreign:
    """An array of another package that NumPy cannot read, as casadi.SX is."""

    def __array__(self, *_args, **_options):
        raise Exception("no numbers in here")


@every_function
@pytest.mark.parametrize(
    "value",
    [
        np.ones(NQ, bool),
        np.ones(NQ, complex),
        np.ones(NQ, np.complex64),
        np.ones(NQ, object),
        ["1.0"] * NQ,
        [None] * NQ,
        None,
        "upright",
        {1.0, 2.0},
        [[1.0], [1.0, 2.0]],
        np.ones(NQ, "datetime64[s]"),
        Foreign(),
    ],
    ids=lambda value: type(value).__name__,
)
def test_other_things_than_real_numbers_are_refused(model, name, value):
    for argument in CALLS[name][0]:
        if argument == "f_ext" and value is None:
            continue  # no load
        with pytest.raises(
            st.StateError, match=f"^{name}: {argument}: type .*: needs real numbers"
        ):
            call(model, name, state() | {argument: value})


@every_function
def test_wrong_shape_is_named_with_the_right_one(model, name):
    for argument in CALLS[name][0]:
        size = SIZES[argument]
        for shape in [
            (),
            (0,),
            (size - 1,),
            (size + 1,),
            (3, size - 1),
            (size, 3),
            (2, 2, size),
            (size, 1),
            (1, 0),
        ]:
            with pytest.raises(st.StateError) as caught:
                call(model, name, state() | {argument: np.zeros(shape)})
            assert (
                str(caught.value)
                == f"{name}: {argument} has shape {shape}, not ({size},) or (batch, {size})"
            )


@every_function
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite_entry_is_named_with_its_place(model, name, bad):
    for argument in CALLS[name][0]:
        one, batch = state(), states(9)
        one[argument][5 % NT], batch[argument][6, 2] = bad, bad
        with pytest.raises(st.StateError) as caught:
            call(model, name, one)
        assert (
            str(caught.value) == f"{name}: {argument}[{5 % NT}]: value {bad}: needs a finite number"
        )
        with pytest.raises(st.StateError) as caught:
            call(model, name, batch)
        assert (
            str(caught.value)
            == f"{name}: {argument}[2] of state 6: value {bad}: needs a finite number"
        )


@every_function
@pytest.mark.parametrize(
    ("norm", "words"), [(0.0, "is zero"), (1e-160, "has norm 1e-160"), (1e200, "has norm 1e+200")]
)
def test_quaternion_without_direction_is_named(model, name, norm, words):
    one, batch = state(), states(9)
    one["q"][3:7] = batch["q"][6, 3:7] = 0, norm, 0, 0
    for arguments, where in ((one, ""), (batch, " of state 6")):
        with pytest.raises(st.StateError) as caught:
            call(model, name, arguments)
        assert (
            str(caught.value)
            == f"{name}: the quaternion q[3:7]{where} {words}: upright is (1, 0, 0, 0)"
        )


@every_function
@pytest.mark.parametrize("factor", [-1.0, 2.0**-40, 3.7, 1e-100, 1e100])
def test_quaternion_may_have_any_norm(model, name, factor):
    arguments = state()
    unit = arguments["q"].copy()
    unit[3:7] /= np.linalg.norm(unit[3:7])
    scaled = unit.copy()
    scaled[3:7] *= factor
    found = (call(model, name, arguments | {"q": q}) for q in (scaled, unit))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13 * np.abs(other).max())


def test_model_works_on_after_a_refusal(model):
    expected = call(model, "forward_dynamics", state())
    for bad in ({"q": np.zeros(NQ)}, {"tau": np.full(NT, np.nan)}, {"v": "no"}):
        with pytest.raises(st.StateError):
            call(model, "forward_dynamics", state() | bad)
        assert_same(call(model, "forward_dynamics", state()), expected)


def test_indefinite_inertia_is_named():
    """A tail so long that H overflows."""
    with pytest.warns(st.UnlikeBodies, match="unlike by inf"):
        endless = st.load(folder(), {"link_inertia": (1, 1, 1), "tail_length": 1e200})
    words = (
        "forward_dynamics: the inertia matrix{} is not positive definite: is a value too large, or "
        "a parameter"
    )
    for arguments, where in ((state(), ""), (states(2), " of state 0")):
        with pytest.raises(st.StateError, match=f"^{words.format(where)}"):
            call(endless, "forward_dynamics", arguments)


@pytest.mark.parametrize("name", ["bias_force", "forward_dynamics", "energy"])
def test_result_beyond_numbers_is_named(model, name):
    one, batch = state(), states(9)
    one["v"] *= 1e200
    batch["v"][6] *= 1e200
    for arguments, where in ((one, ""), (batch, " of state 6")):
        with pytest.raises(
            st.StateError, match=f"^{name}: the result{where} is not finite: is a value too large"
        ):
            call(model, name, arguments)


# Names


def test_aliases_of_the_field(model):
    s = state()
    assert_same(model.crba(s["q"]), model.mass_matrix(s["q"]))
    assert_same(model.nle(s["q"], s["v"]), model.bias_force(s["q"], s["v"]))
    assert_same(
        model.rnea(s["q"], s["v"], s["v_dot"]), model.inverse_dynamics(s["q"], s["v"], s["v_dot"])
    )
    for load in (None, s["f_ext"]):
        assert_same(
            model.aba(s["q"], s["v"], s["tau"], load),
            model.forward_dynamics(s["q"], s["v"], s["tau"], load),
        )


@pytest.mark.parametrize("name", [name for name in CALLS if name != "mass_matrix"])
def test_function_left_out_is_named_with_the_remedy(small, name):
    with pytest.raises(st.ModelError) as caught:
        call(small, name, state())
    assert str(caught.value) == (
        f"small was generated without {name!r} (it has mass_matrix): add it to `functions` of the "
        "scene, "
        "then generate it again"
    )


def test_casadi_knows_the_same_functions(small):
    with pytest.raises(st.ModelError, match="small was generated without 'energy'"):
        _ = small.casadi.energy
    assert not hasattr(small.casadi, "_repr_html_")
    assert small.casadi.mass_matrix.name_in() == ["q"]


def test_external_force_takes_loads_by_name(model):
    load = model.external_force(
        force=(1, 2, 3), moment=[4, 5, 6], tail=np.arange(7, 7 + 3 * POINTS).reshape(-1, 3)
    )
    np.testing.assert_array_equal(load, np.arange(1.0, 7 + 3 * POINTS))
    np.testing.assert_array_equal(model.external_force(), np.zeros(SIZES["f_ext"]))


@pytest.mark.parametrize(
    "loads", [{"force": (1, 2)}, {"moment": 1.0}, {"tail": np.zeros(3 * POINTS)}, {"force": "xyz"}]
)
def test_external_force_names_a_wrong_load(model, loads):
    with pytest.raises(st.StateError, match=next(iter(loads))):
        model.external_force(**loads)


# Parameters


def test_parameters_change_without_a_compiler(model, no_process):
    """Mass and inertia twice as large make H twice as large, bit for bit."""
    double = {name: 2 * model.parameters[name] for name in ("torso_mass", "tail_mass")}
    double["torso_inertia"] = 2 * np.array(model.parameters["torso_inertia"])
    s = state()
    for heavy in (st.load(folder(), parameters=double), model.with_parameters(**double)):
        np.testing.assert_array_equal(heavy.mass_matrix(s["q"]), 2 * model.mass_matrix(s["q"]))
        np.testing.assert_array_equal(
            heavy.bias_force(s["q"], s["v"]), 2 * model.bias_force(s["q"], s["v"])
        )
        assert heavy.parameters["link_inertia"] == tuple(
            2 * np.array(model.parameters["link_inertia"])
        )


def test_parameters_given_late_are_those_of_a_scene(model):
    changes = {"tail_mass": 0.02, "tail_mount": [0.01, -0.05, 0.002], "gravity": 1.6}
    other = st.load(folder(parameters=changes))
    for name in CALLS:
        assert_same(
            call(model.with_parameters(**changes), name, state()), call(other, name, state())
        )


def test_first_model_keeps_its_parameters(model):
    before, expected = dict(model.parameters), model.mass_matrix(state()["q"])
    assert (model.with_parameters(tail_mass=1.0).mass_matrix(state()["q"]) != expected).any()
    assert dict(model.parameters) == before
    np.testing.assert_array_equal(model.mass_matrix(state()["q"]), expected)


def test_changes_of_parameters_add_up(model):
    light = model.with_parameters(tail_mass=0.001).with_parameters(link_radius=0.01)
    assert light.parameters == model.with_parameters(tail_mass=0.001, link_radius=0.01).parameters
    given = light.with_parameters(link_inertia=(1e-6, 1e-8, 1e-6)).with_parameters(tail_mass=0.002)
    assert (
        given.parameters["link_inertia"] == (1e-6, 1e-8, 1e-6)
        and "link_radius" not in given.parameters
    )
    assert given.with_parameters(link_radius=0.01, tail_mass=0.001).parameters == light.parameters


def test_wrong_parameters_are_refused(model):
    for attempt in (lambda p: st.load(folder(), p), lambda p: model.with_parameters(**p)):
        with pytest.raises(st.ModelError) as caught:
            attempt({"tail_mas": 1, "gravity": -1})
        assert "did you mean 'tail_mass'?" in str(caught.value) and "gravity: value -1" in str(
            caught.value
        )


def test_baked_model_has_the_same_values_and_refuses_others(model):
    baked = st.load(folder(baked=True))
    for name in CALLS:
        for found, expected in zip(
            call(baked, name, state()), call(model, name, state()), strict=True
        ):
            np.testing.assert_allclose(
                found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max()
            )
    assert baked.with_parameters().parameters == model.parameters
    for attempt in (
        lambda: baked.with_parameters(gravity=1.6),
        lambda: st.load(baked.folder, {"gravity": 1.6}),
    ):
        with pytest.raises(st.ModelError, match="baked = false"):
            attempt()


# Kinds of models


def test_float_model(model):
    single = st.load(folder(real="float"))
    for arguments in (state(), states(3)):
        for name in CALLS:
            expected = call(
                model, name, {k: np.float32(a).astype(float) for k, a in arguments.items()}
            )
            exact = call(single, name, {k: np.float32(a) for k, a in arguments.items()})
            assert_same(call(single, name, arguments), exact)
            for found, reference in zip(exact, expected, strict=True):
                assert found.dtype == np.float32
                np.testing.assert_allclose(
                    found, reference, rtol=2e-2, atol=1e-3 * np.abs(reference).max()
                )
    with pytest.raises(st.StateError, match=r"v\[0\]: value inf"):
        single.bias_force(state()["q"], [1e39] + [0] * (NV - 1))


def test_a_scene_s_profile_is_that_of_its_library():
    folders = {
        name: model_folder(1, 1, functions=["mass_matrix"], profile=name)
        for name in ("fast", "reproducible")
    }
    assert {name: st.load(path).profile for name, path in folders.items()} == {
        name: name for name in folders
    }
    assert st.load(folders["reproducible"], profile="fast").profile == "fast"


def test_profiles_agree_to_rounding(model):
    exact = st.load(folder(), profile="reproducible")
    assert exact.library._name != model.library._name
    for name in CALLS:
        for found, expected in zip(
            call(exact, name, state()), call(model, name, state()), strict=True
        ):
            np.testing.assert_allclose(
                found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max()
            )
    with pytest.raises(st.SerpentailError, match="profile: value 'quick'"):
        st.load(folder(), profile="quick")


def test_models_do_not_disturb_each_other(model, small):
    heavy = model.with_parameters(tail_mass=1.0)
    q = states(20)["q"]
    calls = [(model, NQ), (small, 9), (heavy, NQ)]
    alone = [[one.mass_matrix(row[:size]) for row in q] for one, size in calls]
    mixed = [[one.mass_matrix(row[:size]) for one, size in calls] for row in q]
    for expected, found in zip(alone, zip(*mixed, strict=True), strict=True):
        assert_same(found, expected)


# Life of a model


@pytest.fixture
def restless():
    """Let threads take turns as often as can be."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


def test_eight_threads_on_one_model(model, restless):
    batch = states(1000)
    names = ("q", "v", "tau")
    expected = np.array(
        [model.forward_dynamics(*state) for state in zip(*map(batch.get, names), strict=True)]
    )
    found, together = np.zeros((8, *expected.shape)), threading.Barrier(8)

    def work(thread):
        together.wait()
        for k in np.roll(np.arange(1000), 125 * thread):
            found[thread, k] = model.forward_dynamics(batch["q"][k], batch["v"][k], batch["tau"][k])

    threads = [threading.Thread(target=work, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    np.testing.assert_array_equal(found, np.broadcast_to(expected, found.shape))


def test_kernel_keeps_what_it_needs():
    whole = st.load(folder(), {"tail_mass": 0.05})
    expected, kernel = whole.mass_matrix(state()["q"]), whole.kernel("mass_matrix")
    gone, *kept = map(weakref.ref, (whole, whole.parameter_vector, whole.library))
    del whole
    gc.collect()
    assert gone() is None
    assert all(reference() is not None for reference in kept)
    np.testing.assert_array_equal(kernel(state()["q"]), expected)
    del kernel
    gc.collect()
    assert kept[0]() is None


@pytest.mark.parametrize(
    "duplicate",
    [copy.copy, copy.deepcopy, lambda m: pickle.loads(pickle.dumps(m))],
    ids=["copy", "deepcopy", "pickle"],
)
def test_copies_are_models(model, duplicate):
    baked = st.load(folder(baked=True))
    for original in (
        model,
        baked,
        model.with_parameters(tail_mass=0.05),
        model.with_parameters(link_inertia=(1, 1, 1)),
    ):
        twin = duplicate(original)
        assert twin is not original and twin.parameters == original.parameters
        for name in CALLS:
            assert_same(call(twin, name, state()), call(original, name, state()))


def test_pickled_model_goes_to_another_process(monkeypatch, tmp_path):
    monkeypatch.chdir(folder().parent)
    model = st.load("tail", {"tail_mass": 0.05}, profile="reproducible")
    (tmp_path / "model").write_bytes(pickle.dumps(model))
    program = (
        "import pathlib, pickle; model = pickle.loads(pathlib.Path('model').read_bytes()); "
        f"print(model.profile, model.mass_matrix({state()['q'].tolist()}).tobytes().hex())"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(
        command, cwd=tmp_path, env=os.environ, check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == ["reproducible", model.mass_matrix(state()["q"]).tobytes().hex()]


def test_one_state_costs_few_calls(model):
    """A call on matching arrays runs three Python functions; a conversion of arguments would show
    here.
    """
    s, events = state(), []
    model.forward_dynamics(s["q"], s["v"], s["tau"])
    sys.setprofile(lambda frame, event, _: events.append((event, frame.f_code.co_name)))
    try:
        model.forward_dynamics(s["q"], s["v"], s["tau"])
    finally:
        sys.setprofile(None)
    entered = [name for event, name in events if event == "call"]
    assert entered == ["forward_dynamics", "kernel", "__call__"]
    assert sum(event == "c_call" for event, _ in events) < 10
    assert math.isfinite(model.energy(s["q"], s["v"])[0])
