"""Models of floats and profiles, their names, threads, copies, and what they keep alive."""

import copy
import gc
import math
import pickle
import sys
import threading
import weakref

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo

from ...support.rows import row
from .calls import (
    CALLS,
    NV,
    POINTS,
    SIZES,
    assert_close,
    assert_same,
    call,
    sizes,
    state,
    states,
)

# Kinds of models


def test_float_model(model):
    single = zoo.model("single")
    for arguments in (state(), states(3)):
        floats = {key: np.float32(a) for key, a in arguments.items()}
        for name in CALLS:
            with row(name):
                exact = call(single, name, floats)
                assert_same(call(single, name, arguments), exact)
                assert {found.dtype for found in exact} == {np.dtype(np.float32)}
                rounded = {key: a.astype(float) for key, a in floats.items()}
                assert_close(exact, call(model, name, rounded), 2e-2, 1e-3)
    with pytest.raises(st.StateError, match=r"v\[0\]: value inf"):
        single.bias_force(state()["q"], [1e39] + [0] * (NV - 1))


@pytest.mark.parametrize("name", ["bare", pytest.param("m1_n1", marks=pytest.mark.slow)])
def test_profiles_agree_to_rounding(users_compiler, name):
    folder, given = zoo.folder(name), state(sizes=sizes(1, 1))
    fast, exact = (st.load(folder, profile=profile) for profile in ("fast", "reproducible"))
    assert exact.library._name != fast.library._name
    for function in fast.kernels.keys() & CALLS.keys():
        with row(function):
            assert_close(call(exact, function, given), call(fast, function, given), 1e-9, 1e-12)
    with pytest.raises(st.SerpentailError, match="profile: value 'quick'"):
        st.load(folder, profile="quick")


# Names


def test_aliases_of_the_field(model):
    q, v, v_dot, tau, f_ext = map(state().get, ("q", "v", "v_dot", "tau", "f_ext"))
    assert_same(model.crba(q), model.mass_matrix(q))
    assert_same(model.nle(q, v), model.bias_force(q, v))
    assert_same(model.rnea(q, v, v_dot), model.inverse_dynamics(q, v, v_dot))
    for load in (None, f_ext):
        assert_same(model.aba(q, v, tau, load), model.forward_dynamics(q, v, tau, load))


def test_function_left_out_is_named_with_the_remedy():
    bare = zoo.model("bare")
    for name in CALLS.keys() - {"forward_dynamics"}:
        with pytest.raises(st.ModelError, match=f"bare .*'{name}'.*forward_dynamics.*`functions`"):
            call(bare, name, state())
    with pytest.raises(st.ModelError, match=r"bare .*'energy'"):
        _ = bare.casadi.energy
    assert not hasattr(bare.casadi, "_repr_html_")
    assert bare.casadi.forward_dynamics.name_in() == ["q", "v", "tau"]


def test_external_force_takes_loads_by_name(model):
    tail = np.arange(7, 7 + 3 * POINTS).reshape(-1, 3)
    load = model.external_force(force=(1, 2, 3), moment=[4, 5, 6], tail=tail)
    np.testing.assert_array_equal(load, np.arange(1.0, 7 + 3 * POINTS))
    np.testing.assert_array_equal(model.external_force(), np.zeros(SIZES["f_ext"]))
    for name, value in (
        *(("force", (1, 2)), ("moment", 1.0), ("tail", np.zeros(3 * POINTS))),
        *(("force", "xyz"), ("moment", (0, np.nan, 0))),
    ):
        with pytest.raises(st.StateError, match=name):
            model.external_force(**{name: value})


# Life of a model


def test_eight_threads_on_one_model(model):
    batch, usual = states(300), sys.getswitchinterval()
    rows = list(zip(*map(batch.get, ("q", "v", "tau")), strict=True))
    expected = np.array([model.forward_dynamics(*each) for each in rows])
    found, together = np.zeros((8, *expected.shape)), threading.Barrier(8)

    def work(thread):
        together.wait()
        for k in np.roll(np.arange(len(rows)), 37 * thread):
            found[thread, k] = model.forward_dynamics(*rows[k])

    threads = [threading.Thread(target=work, args=(k,)) for k in range(8)]
    sys.setswitchinterval(1e-6)  # as often as can be
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(usual)
    np.testing.assert_array_equal(found, np.broadcast_to(expected, found.shape))


def test_kernel_keeps_what_it_needs():
    whole = st.load(zoo.folder("m2_n2"), {"tail_mass": 0.05})
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


def test_copies_are_models(model):
    originals = [model, model.with_parameters(tail_mass=0.05), zoo.model("baked")]
    originals += [model.with_parameters(link_inertia=(1, 1, 1))]
    ways = [copy.copy, copy.deepcopy, lambda m: pickle.loads(pickle.dumps(m))]
    for original in originals:
        given = state(sizes=sizes(original.segments, original.links))
        for k, duplicate in enumerate(ways):
            twin = duplicate(original)
            assert twin is not original and twin.parameters == original.parameters
            for name in CALLS:
                with row(original, k, name):
                    assert_same(call(twin, name, given), call(original, name, given))


def test_one_state_costs_few_calls(model):
    """A call on matching arrays runs three Python functions: it converts no arguments."""
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
