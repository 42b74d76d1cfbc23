"""Rollouts: many runs at once give what each gives alone, bit for bit, its error too, in any order,
on any core.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.snapshot import model_library
from serpentail.simulation import batched_runs, parallel_runs

from ...support.models import model_folder
from .many import DAMPING, NT, PER_RUN, WANTED, alone, same, starts, tail

LAWS = {
    "none": None,
    "damping": st.Damping((1e-6, 2e-6, 3e-6, 4e-6)),
    "table": st.TorqueTable(
        [0.0, 0.0123, 0.031], np.outer([1, -1, 2], [1e-5, 2e-5, -1e-5, 1e-5]), 1e-6
    ),
    "jumps": st.TorqueCurve(
        st.Piecewise(
            np.array([0.01, 0.0207, 0.04]), 1e-5 * np.array([[[1.0, 0]] * NT, [[-2.0, 9]] * NT])
        )
    ),
}
FLIGHT = {"t_span": (0.005, 0.05), "method": "rk4", "step": 3e-4, "output_step": 5e-3}


def near(rollouts, flights, digits=1e-11):
    """Assert that all arrays of rollouts are those of single flights but for rounding."""
    for name in PER_RUN:
        expected = np.array([getattr(flight, name) for flight in flights])
        error = np.abs(getattr(rollouts, name) - expected).max()
        assert error <= digits * max(np.abs(expected).max(), 1e-9), (name, error)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_flights_abreast_are_what_they_are_alone(law):
    q, v = starts(tail(), 19)
    settings = FLIGHT | {"controller": law}
    flights = alone(tail(), q, v, **settings)
    for count in (2, 8, 9, 19):
        found = st.simulate(tail(), q[:count], v[:count], **settings)
        assert found.info["abreast"] == 8 and found.errors == [None] * count
        near(found, flights[:count])
        assert found[1].info["steps"] == flights[1].info["steps"]
        assert found.info["evaluations"] == sum(
            flight.info["evaluations"] for flight in flights[:count]
        )


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_sound_flights_are_made_abreast_and_no_second_time(law, monkeypatch):
    """A group that fails is made singly, run by run: none of these may."""
    monkeypatch.setattr(parallel_runs, "RunsInTurn", lambda *_: pytest.fail("in turn"))
    st.simulate(tail(), *starts(tail(), 19), controller=law, **FLIGHT)


FORMS = {
    "loops": ((2, 2), {"emission": "loops"}, 1e-11),
    "baked": ((2, 2), {"baked": True}, 1e-11),
    "float": ((2, 2), {"real": "float"}, 1e-3),
    "continuum": ((2, None), {}, 1e-11),
}


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize(("sizes", "options", "digits"), FORMS.values(), ids=FORMS)
def test_every_form_of_a_model_flies_abreast(sizes, options, digits):
    model = st.load(model_folder(*sizes, name="form", functions=WANTED, **options))
    q, v = starts(model, 9)
    settings = FLIGHT | {"controller": LAWS["table"]}
    found = st.simulate(model, q, v, **settings)
    assert found.info["abreast"] == (16 if options.get("real") == "float" else 8)
    near(found, alone(model, q, v, **settings), digits)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", [None, LAWS["damping"]], ids=["none", "damping"])
def test_the_reproducible_profile_gives_the_same_bits(law):
    model = st.load(tail().folder, profile="reproducible")
    q, v = starts(model, 11)
    settings = {"t_span": 0.05, "method": "rk4", "step": 1e-3, "controller": law}
    found = st.simulate(model, q, v, **settings)
    assert found.info["abreast"] == 8
    same(found, alone(model, q, v, **settings))


@pytest.mark.usefixtures("any_number_is_many")
def test_each_lane_has_its_own_parameters():
    q, v = starts(tail(), 11)
    rng = np.random.default_rng(1)
    own = {"tail_mass": rng.uniform(0.002, 0.02, 11), "tail_mount": 0.02 * rng.normal(size=(11, 3))}
    found = st.simulate(tail(), q, v, parameters=own, **FLIGHT)
    models = [
        tail().with_parameters(**{name: values[k] for name, values in own.items()})
        for k in range(11)
    ]
    near(found, [st.simulate(model, q[k], v[k], **FLIGHT) for k, model in enumerate(models)])


@pytest.mark.usefixtures("any_number_is_many")
def test_a_flight_that_fails_abreast_loses_no_other():
    q, v = starts(tail(), 12)
    v[2] *= 1e160
    found = st.simulate(tail(), q, v, **FLIGHT)
    with pytest.raises(st.SimulationError) as caught:
        st.simulate(tail(), q[2], v[2], **FLIGHT)
    assert [k for k in range(12) if found.errors[k]] == [2] and str(found.errors[2]) == str(
        caught.value
    )
    others = [k for k in range(12) if k != 2]
    for k in others:
        flight = st.simulate(tail(), q[k], v[k], **FLIGHT)
        np.testing.assert_allclose(found.q[k], flight.q, rtol=0, atol=1e-12)
    assert np.isnan(found.q[2, 1:]).all()


@pytest.fixture
def built(monkeypatch):
    """What is compiled beside models, where the cache has nothing of it."""
    found = []
    monkeypatch.setattr(
        "serpentail.model.batch.model_library", lambda *a: found.append(a) or model_library(*a)
    )
    monkeypatch.setattr("serpentail.model.batch.library_in_cache", lambda *_: None)
    return found


def test_short_work_compiles_nothing_until_all_of_it_would_have_paid(built, monkeypatch):
    model = st.load(tail().folder)
    q, v = starts(model, 9)
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 1 and not built
    source = model.batch_library.rollouts
    price = batched_runs.COMPILE_S_PER_BYTE * source.bytes
    assert 0 < source.missed < price
    source.missed = price - source.missed / 2  # what many such calls would have come to
    assert st.simulate(model, q[:7], v[:7], **FLIGHT).info["abreast"] == 1  # no full vector
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 8 and len(built) == 1
    assert st.simulate(model, q, v, **FLIGHT).info["abreast"] == 8 and len(built) == 1


def test_long_work_compiles_at_once(built, monkeypatch):
    monkeypatch.setattr(batched_runs, "COMPILE_S_PER_BYTE", 1e-10)
    model = st.load(tail().folder)
    assert st.simulate(model, *starts(model, 9), **FLIGHT).info["abreast"] == 8 and len(built) == 1


def test_what_the_cache_has_is_used_for_short_work():
    tail().batch_library.rollouts.function("tail_side_by_side_flights")
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
            getattr(tail().library, f"tail_{name}")
