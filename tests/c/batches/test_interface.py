"""Batches share compiled lanes, threads and arrays, and name the state that is wrong."""

import ctypes
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.model.kernel import argument_record
from serpentail.model.library import NOT_FINITE, model_library
from tests.support import zoo
from tests.support.rows import row

from .tails import TOUCHING, alone, evaluated, given, on_ground, states

model_of = cache(zoo.own)  # once a model has lanes, they are used


@pytest.fixture(autouse=True)
def any_batch_is_large(monkeypatch):
    monkeypatch.setattr("serpentail.model.library.MIN_BATCH", 1)


def test_a_few_states_compile_nothing_and_many_do_once(monkeypatch):
    monkeypatch.setattr("serpentail.model.library.MIN_BATCH", 1000)
    built, place = [], "serpentail.model.library.model_library"
    found = zoo.own("m1_n1")
    monkeypatch.setattr(place, lambda *a: built.append(a) or model_library(*a))
    found.mass_matrix(states(found, 999)["q"])
    assert not built
    found.mass_matrix(states(found, 1000)["q"])
    found.with_parameters(torso_mass=1.0).mass_matrix(states(found, 20)["q"])
    assert len(built) == 1


def test_parameters_count_in_batches_and_a_single_state_is_repeated():
    heavy = model_of("m1_n1").with_parameters(torso_mass=1.0, link_radius=0.01)
    values = states(heavy, 30)
    found = heavy.forward_dynamics(*given(heavy, values, "forward_dynamics"))
    np.testing.assert_allclose(found, alone(heavy, "forward_dynamics", values), rtol=1e-9)
    force = heavy.bias_force(values["q"][0], values["v"])
    expected = [heavy.bias_force(values["q"][0], v) for v in values["v"]]
    np.testing.assert_allclose(force, expected, rtol=1e-10, atol=1e-14)


WRONG = [
    ("v", 4, np.nan, r"v\[4\] of state 13: value nan"),
    ("q", slice(3, 7), 0, r"quaternion q\[3:7\] of state 13"),
    ("v", slice(None), 1e200, "state 13 is not finite"),
    *(("q", k, np.inf, rf"q\[{k}\] of state 13: value inf") for k in range(9)),
    *(("v", k, -np.inf, rf"v\[{k}\] of state 13: value -inf") for k in range(8)),
]


def test_the_state_that_is_wrong_is_named():
    found = model_of("m1_n1")
    for count in (20, 1500):
        for name, where, value, words in WRONG:
            values = states(found, count)
            values[name][13, where] = value
            with row(count, name, where), pytest.raises(st.StateError, match=words):
                found.bias_force(values["q"], values["v"])
    bent = states(model_of("arcs2"), 20)["q"]
    bent[17, 9] = 7.0
    with pytest.raises(st.StateError, match="segment 2 of state 17 is bent by 7"):
        model_of("arcs2").mass_matrix(bent)
    straight = states(model_of("mixed"), 20)["q"]  # its arcs are segments 1 and 3
    straight[17, 7:] = [6.3, 0, 9, 0, 1, 0, 9, 0]
    with pytest.raises(st.StateError, match=r"segment 1 of state 17 is bent by 6\.3 "):
        model_of("mixed").mass_matrix(straight)
    touching = model_of("ground")
    values = on_ground(touching, TOUCHING * 4)
    values["bristles"][7, 3] = np.nan
    with pytest.raises(st.StateError, match=r"bristles\[3\] of state 7: value nan"):
        evaluated(touching, "contact_dynamics", given(touching, values, "contact_dynamics"))


def test_threads_share_a_model():
    found, name = model_of("m1_n1"), "forward_dynamics"
    batches = [given(found, states(found, 600, seed), name) for seed in range(6)]
    expected = [found.forward_dynamics(*batch) for batch in batches]

    def work(k):
        results = [found.forward_dynamics(*batches[k]) for _ in range(20)]
        return all(np.array_equal(one, expected[k]) for one in results)

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(work, range(6)))


def test_what_a_batch_returns_begins_at_a_cache_line():
    found, name = model_of("m1_n1"), "forward_dynamics_derivatives"
    values = states(found, 20)
    for output in getattr(found, name)(*given(found, values, name)):
        assert output.ctypes.data % 64 == 0 and output.flags.c_contiguous and output.flags.writeable
    assert found.mass_matrix(values["q"][:0]).shape == (0, found.nv, found.nv)


@pytest.mark.parametrize("name", ["m1_n1", pytest.param("arcs2_loops", marks=pytest.mark.slow)])
def test_states_may_lie_apart_or_be_shared(name):
    """For kernels in C: x among other numbers, one angular momentum and one set of weights."""
    found, function = model_of(name), "airborne_rates_hessian"
    batches, values = found.batch_library, states(found, 21)
    for shared in ("angular", "weights"):
        values[shared][:] = values[shared][0]
    expected = alone(found, function, values)
    x, tau, *shared = given(found, values, function)
    nodes = np.hstack([x, tau, np.full((21, 3), np.nan)])
    outputs = [a["shape"] for a in found.manifest["functions"][function]["outputs"]]
    results = [np.zeros((21, int(np.prod(shape)) + 1)) for shape in outputs]
    arrays = [nodes, nodes[:, x.shape[1] :], *shared, *results]
    apart = [nodes.shape[1]] * 2 + [0, 0] + [result.shape[1] for result in results]
    apart, work = np.array(apart, np.uintp), np.zeros(batches.work[function])
    called = batches.sources[batches.parts[function]].function(
        f"{found.name}_side_by_side_{function}_apart"
    )
    called.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    record = argument_record(found.parameter_vector, len(nodes), work, arrays)
    assert called(ctypes.byref(record), apart.ctypes.data) == 0
    got = np.hstack([result[:, :-1] for result in results])
    assert (np.abs(got - expected) <= 1e-11 * np.abs(expected).max(axis=0)).all()
    assert not any(result[:, -1].any() for result in results)
    nodes[13, 5] = np.nan
    assert called(ctypes.byref(record), apart.ctypes.data) == NOT_FINITE and record.failed == 8
