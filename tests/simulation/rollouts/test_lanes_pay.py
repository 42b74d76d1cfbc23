"""When flights go side by side: what that compiles, and when it pays."""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.snapshot import model_library
from serpentail.simulation import batched_runs, parallel_runs
from serpentail.simulation.adaptive_runs import AdaptiveRuns

from ..runs import DAMPING, JUMPS, NT, TABLE, alone, near, starts, tail

FLIGHT = {"t_span": (0.005, 0.05), "method": "rk4", "step": 3e-4, "output_step": 5e-3}


@pytest.fixture
def built(monkeypatch):
    """What is compiled beside models, where the cache has nothing of it."""
    found = []
    monkeypatch.setattr(
        "serpentail.model.batch.model_library", lambda *a: found.append(a) or model_library(*a)
    )
    monkeypatch.setattr("serpentail.model.batch.library_in_cache", lambda *_: None)
    return found


def test_short_work_compiles_nothing_until_all_of_it_would_have_paid(built):
    model = st.load(tail().folder)
    q, v = starts(model, 9)
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 1 and not built
    source = model.batch_library.rollouts
    price = batched_runs.COMPILE_S_PER_BYTE * source.bytes
    assert 0 < source.missed < price
    source.missed = price - source.missed / 2  # what many such calls would have come to
    assert st.simulate(model, q[:7], v[:7], **FLIGHT).info["abreast"] == 1  # no full vector
    for _ in range(2):
        assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 8 and len(built) == 1


def test_long_work_compiles_at_once(built, monkeypatch):
    monkeypatch.setattr(batched_runs, "COMPILE_S_PER_BYTE", 1e-10)
    model = st.load(tail().folder)
    assert st.simulate(model, *starts(model, 9), **FLIGHT).info["abreast"] == 8 and len(built) == 1


def test_what_the_cache_has_is_used_for_short_work():
    tail().batch_library.rollouts.function("m2_n2_side_by_side_flights")
    model = st.load(tail().folder)
    assert st.simulate(model, *starts(model, 8), **FLIGHT).info["abreast"] == 8


@pytest.mark.usefixtures("any_number_is_many")
def test_other_laws_fly_alone(built):
    model = st.load(tail().folder)
    q, v = starts(model, 9)
    laws = [st.Phases([(0.0, None), (0.02, DAMPING)]), lambda t, q, v: [0.0] * NT]
    laws.append(st.Pfl(model, st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT])))
    for law in laws:
        assert st.simulate(model, q, v, **FLIGHT | {"controller": law}).info["abreast"] == 1
    assert not built
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 8 and len(built) == 1
    st.simulate(model.with_parameters(torso_mass=1.0), q, v, **FLIGHT)
    assert len(built) == 1


def test_the_models_library_has_no_lanes():
    """Batches and flights are compiled when they are needed."""
    for name in ("side_by_side_forward_dynamics", "side_by_side_flights"):
        with pytest.raises(AttributeError):
            getattr(tail().library, f"m2_n2_{name}")


@pytest.mark.parametrize(("price", "lanes"), [(1e-9, 8), (1.0, 1)])
def test_pilots_tell_whether_compiling_pays(monkeypatch, price, lanes):
    monkeypatch.setattr("serpentail.model.batch.library_in_cache", lambda *_: None)
    monkeypatch.setattr(batched_runs, "COMPILE_S_PER_BYTE", price)
    monkeypatch.setattr(parallel_runs, "PILOTS", 5)
    model, how = st.load(tail().folder), {"t_span": 0.3, "method": "tsit5", "output_step": 0.0123}
    q, v = starts(model, 19)
    found, flights = st.simulate(model, q, v, **how), alone(model, q, v, **how)
    assert found.info["abreast"] == lanes and found.errors == [None] * 19
    near(found, flights)
    np.testing.assert_array_equal(found.q[:5], [flight.q for flight in flights[:5]])


@pytest.mark.usefixtures("any_number_is_many")
def test_sound_flights_are_made_abreast_and_no_second_time(monkeypatch):
    """A group that fails is made singly, run by run: none of these may."""
    go, again = AdaptiveRuns.go, []

    def told(self, runs, ended):
        for numbers, outcome in go(self, runs, ended):
            again.extend([] if outcome else numbers)
            yield numbers, outcome

    monkeypatch.setattr(AdaptiveRuns, "go", told)
    q, v = starts(tail(), 19)
    found = st.simulate(tail(), q, v, t_span=0.3, method="tsit5")
    assert again == [] and found.errors == [None] * 19
    monkeypatch.setattr(parallel_runs, "RunsInTurn", lambda *_: pytest.fail("in turn"))
    for law in (None, DAMPING, TABLE, JUMPS):
        st.simulate(tail(), q, v, controller=law, **FLIGHT)
