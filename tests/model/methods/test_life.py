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

import numpy as np
import pytest

import serpentail as st

from ...support.models import model_folder
from .calls import CALLS, NQ, NV, assert_same, call, folder, state, states

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


@pytest.mark.parametrize(
    "functions",
    [
        pytest.param(["mass_matrix", "forward_dynamics", "energy", "tail_points"], id="few"),
        pytest.param("all", marks=pytest.mark.slow),
    ],
)
def test_profiles_agree_to_rounding(users_compiler, functions):
    fast, exact = (
        st.load(folder(functions=functions), profile=name) for name in ("fast", "reproducible")
    )
    assert exact.library._name != fast.library._name
    for name in fast.kernels.keys() & CALLS.keys():
        for found, expected in zip(
            call(exact, name, state()), call(fast, name, state()), strict=True
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
