"""Batches share compiled lanes, threads and arrays, and name the state that is wrong."""

import threading
from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.model.snapshot import model_library
from tests.support import zoo
from tests.support.rows import row

from . import ground
from .tails import alone, given, states


@cache
def model_of(name):
    """A model that other files of tests do not have: once it has lanes, they are used."""
    return st.load(zoo.folder(name))


@pytest.fixture(autouse=True)
def any_batch_is_large(monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1)


def test_a_few_states_compile_nothing_and_many_do_once(monkeypatch):
    monkeypatch.setattr("serpentail.model.batch.MIN_BATCH", 1000)
    built, place = [], "serpentail.model.batch.model_library"
    monkeypatch.setattr(place, lambda *a: built.append(a) or model_library(*a))
    found = st.load(zoo.folder("m1_n1"))
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
    ("q", 0, np.inf, r"q\[0\] of state 13: value inf"),
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
    touching = model_of("ground")
    values = ground.states(touching, ground.TOUCHING * 4)
    values["bristles"][7, 3] = np.nan
    with pytest.raises(st.StateError, match=r"bristles\[3\] of state 7: value nan"):
        touching.contact_dynamics(*given(touching, values, "contact_dynamics"))


def test_threads_share_a_model():
    found, name = model_of("m1_n1"), "forward_dynamics"
    batches = [given(found, states(found, 600, seed), name) for seed in range(6)]
    expected, results = [found.forward_dynamics(*batch) for batch in batches], [None] * 6

    def work(k):
        results[k] = [found.forward_dynamics(*batches[k]) for _ in range(20)]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(one, expected[k]) for k, many in enumerate(results) for one in many)


def test_what_a_batch_returns_begins_at_a_cache_line():
    found, name = model_of("m1_n1"), "forward_dynamics_derivatives"
    values = states(found, 20)
    for output in getattr(found, name)(*given(found, values, name)):
        assert output.ctypes.data % 64 == 0 and output.flags.c_contiguous and output.flags.writeable
    assert found.mass_matrix(values["q"][:0]).shape == (0, found.nv, found.nv)
