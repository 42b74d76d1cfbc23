"""Batches: states side by side give what each of them gives alone, in any number, from any thread,
errors included.
"""

import threading

import numpy as np
import pytest

import serpentail as st
from serpentail.model.snapshot import model_library

from .tails import alone, given, model, states

# The face.


def test_a_few_states_compile_nothing_and_many_do_once(monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1000)
    built = []
    monkeypatch.setattr(
        "serpentail.model.batch.model_library", lambda *a: built.append(a) or model_library(*a)
    )
    found = st.load(model().folder)
    found.mass_matrix(states(found, 999)["q"])
    assert not built
    found.mass_matrix(states(found, 1000)["q"])
    found.with_parameters(torso_mass=1.0).mass_matrix(states(found, 20)["q"])
    assert len(built) == 1


def test_parameters_count_in_batches():
    heavy = model().with_parameters(torso_mass=1.0, link_radius=0.01)
    arguments = states(heavy, 9)
    expected = alone(heavy, "forward_dynamics", arguments)
    np.testing.assert_allclose(
        heavy.forward_dynamics(*given(arguments, "forward_dynamics")), expected, rtol=1e-9
    )


WRONG = {
    "a number that is none": (
        lambda q, v: v.__setitem__((13, 4), np.nan),
        r"v\[4\] of state 13: value nan",
    ),
    "an infinite position": (
        lambda q, v: q.__setitem__((13, 0), np.inf),
        r"q\[0\] of state 13: value inf",
    ),
    "no attitude": (
        lambda q, v: q.__setitem__((13, slice(3, 7)), 0),
        r"quaternion q\[3:7\] of state 13 is zero",
    ),
    "what overflows": (
        lambda q, v: v.__setitem__((13, slice(None)), 1e200),
        "result of state 13 is not finite",
    ),
}


@pytest.mark.parametrize("what", WRONG)
@pytest.mark.parametrize("count", [20, 1500])
def test_the_state_that_is_wrong_is_named(what, count):
    change, message = WRONG[what]
    found, arguments = model(), states(model(), count)
    change(arguments["q"], arguments["v"])
    with pytest.raises(st.StateError, match=message):
        found.bias_force(arguments["q"], arguments["v"])


def test_a_bend_beyond_the_range_is_named():
    found = model("continuum", 2, None)
    q = states(found, 20)["q"]
    q[17, 9] = 7.0
    with pytest.raises(st.StateError, match="segment 2 of state 17 is bent by 7"):
        found.mass_matrix(q)


def test_threads_share_a_model():
    found = model()
    batches = [states(found, 600, seed) for seed in range(6)]
    expected = [found.forward_dynamics(*given(a, "forward_dynamics")) for a in batches]
    results = [None] * 6

    def work(k):
        results[k] = [
            found.forward_dynamics(*given(batches[k], "forward_dynamics")) for _ in range(20)
        ]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(one, expected[k]) for k, many in enumerate(results) for one in many)


def test_a_single_state_is_repeated_over_a_batch():
    found, arguments = model(), states(model(), 30)
    force = found.bias_force(arguments["q"][0], arguments["v"])
    expected = [found.bias_force(arguments["q"][0], v) for v in arguments["v"]]
    np.testing.assert_allclose(force, expected, rtol=1e-10, atol=1e-14)


def test_what_a_batch_returns_begins_at_a_cache_line():
    found, arguments = model(), states(model(), 20)
    for output in found.forward_dynamics_derivatives(
        *given(arguments, "forward_dynamics_derivatives")
    ):
        assert output.ctypes.data % 64 == 0 and output.flags.c_contiguous and output.flags.writeable
    empty = found.mass_matrix(arguments["q"][:0])
    assert empty.shape == (0, found.nv, found.nv)


@pytest.mark.parametrize("name", ["q", "v"])
def test_a_number_that_is_none_is_found_wherever_it_is(name):
    found = model()
    for k in range(found.nq if name == "q" else found.nv):
        arguments = states(found, 20)
        arguments[name][11, k] = np.inf
        with pytest.raises(st.StateError, match=rf"{name}\[{k}\] of state 11: value inf"):
            found.bias_force(arguments["q"], arguments["v"])
