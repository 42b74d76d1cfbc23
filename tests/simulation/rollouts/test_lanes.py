"""Flights side by side in vectors: each lane is what its run is alone, to rounding; and when that
pays.
"""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.library import model_library
from serpentail.simulation.runs import batch, lanes
from serpentail.simulation.runs.lanes import LaneRuns
from tests.support import zoo
from tests.support.rows import row

from ..runs import DAMPING, JUMPS, NT, TABLE, alone, both, near, starts, tail

EACH = st.Damping((1e-6, 2e-6, 3e-6, 4e-6))
PHASES = st.Phases([(0.0, DAMPING), (0.1, TABLE), (0.2, None)])
LAWS = {"none": None, "damping": EACH, "table": TABLE, "jumps": JUMPS, "phases": PHASES}
RK4 = {"t_span": (0.005, 0.05), "method": "rk4", "step": 3e-4, "output_step": 5e-3}
TSIT5 = {"t_span": (0.005, 0.3), "method": "tsit5", "output_step": 0.0123}
METHODS = {"rk4": RK4, "tsit5": TSIT5}


@pytest.fixture(autouse=True)
def any_number_is_many(monkeypatch):
    monkeypatch.setattr(batch, "worth_lanes", lambda *_: True)


def unlike(count, seed=0):
    """Starts of which some need several times as many steps as others."""
    q, v = starts(tail(), count, seed)
    return q, v * np.linspace(0.2, 12, count)[:, None]


@pytest.mark.parametrize("method", METHODS)
def test_each_lane_steps_as_its_run_does_alone(method):
    q, v = unlike(19)
    for name, law in LAWS.items():
        settings = METHODS[method] | {"controller": law}
        flights = alone(tail(), q, v, **settings)
        taken = [flight.info["steps"] for flight in flights]
        assert method == "rk4" or max(taken) > 2 * min(taken)
        for count in (2, 8, 9, 19):
            with row(name, count):
                found = st.simulate(tail(), q[:count], v[:count], **settings)
                assert found.info["abreast"] == 8 and found.errors == [None] * count
                near(found, flights[:count])
                assert (found.ends == settings["t_span"][1]).all()
                for key in ("steps", "rejected", "evaluations"):
                    wanted = [flight.info.get(key) for flight in flights[:count]]
                    assert [found[k].info.get(key) for k in range(count)] == wanted, key
                work = [flight.info["work_J"]["torques"] for flight in flights[:count]]
                found = found.audit.work["torques"]
                np.testing.assert_allclose(found, work, rtol=1e-8, atol=1e-16)


def test_the_reproducible_profile_gives_the_same_bits():
    model, (q, v) = st.load(tail().folder, profile="reproducible"), unlike(11)
    for method, names in (("rk4", LAWS), ("tsit5", LAWS)):
        for name in names:
            with row(method, name):
                found, _ = both(model, q, v, LAWS[name], **METHODS[method])
                assert found.info["abreast"] == 8


FORMS = {"loops": 1e-11, "baked": 1e-11, "single": 3e-3, "arcs2": 1e-11}
FORMS |= {"elastic": 1e-11, "elastic_arcs": 1e-11}


@pytest.mark.parametrize("name", FORMS)
def test_every_form_of_a_model_has_lanes(name):
    """Where a tail is elastic, with damping and springs of each run's own."""
    model, own = zoo.model(name), {}
    (q, v), models = starts(model, 19), [model] * 19
    law = st.TorqueTable(TABLE.times, np.array(TABLE.torques)[:, : model.layout.nt], 1e-6)
    if "elastic" in name:
        own["tail_damping"] = np.linspace(1e-5, 1e-3, 19)[:, None] * np.ones(4)
        own["tail_stiffness"] = np.random.default_rng(5).uniform(1e-3, 1e-2, (19, 4))
        changes = ({key: values[k] for key, values in own.items()} for k in range(19))
        models = [model.with_parameters(**each) for each in changes]
    for method, settings in METHODS.items():
        how = settings | {"t_span": 0.05, "controller": law}
        found = st.simulate(model, q, v, parameters=own or None, **how)
        flights = [st.simulate(*one, **how) for one in zip(models, q, v, strict=True)]
        with row(method):
            assert found.info["abreast"] == (16 if name == "single" else 8)
            near(found, flights, FORMS[name])
            lost = [flight.info["work_J"]["damping"] for flight in flights]
            limit = 1e-3 if name == "single" else 1e-7
            np.testing.assert_allclose(found.audit.work["damping"], lost, limit, 1e-16)


@pytest.mark.parametrize("method", METHODS)
def test_controllers_and_parameters_are_those_of_the_run_in_the_lane(method):
    q, v = unlike(13)
    kinds = [None, DAMPING, PHASES, TABLE, JUMPS]
    given = (kinds * 5)[:13]
    own = {"tail_mass": np.linspace(0.002, 0.02, 13)}
    own["tail_mount"] = 0.02 * np.random.default_rng(1).normal(size=(13, 3))
    how = METHODS[method]
    found = st.simulate(tail(), q, v, controller=given, parameters=own, **how)
    assert found.info["abreast"] == 8
    flights = []
    for k, law in enumerate(given):
        model = tail().with_parameters(**{name: values[k] for name, values in own.items()})
        flights.append(st.simulate(model, q[k], v[k], controller=law, **how))
    near(found, flights)


def test_settings_of_steps_hold_in_lanes():
    q, v = unlike(9)
    for own in ({"first_step": 1e-3}, {"most_step": 2e-3}, {"least_step": 1e-5}):
        with row(own):
            found, flights = both(tail(), q, v, compare=near, **TSIT5 | own)
            assert found.info["steps"] == sum(flight.info["steps"] for flight in flights)


@pytest.mark.parametrize("method", METHODS)
def test_a_run_that_fails_loses_no_other(method):
    q, v = unlike(20)
    v[[0, 2]] *= 1e160  # overflow at once
    v[5] = [1e200] + [0.0] * (v.shape[1] - 1)  # has no energy
    settings = METHODS[method]
    if method == "tsit5":
        v[11] *= 40  # takes too many steps
        settings = settings | {"most_steps": 200}
    for threads in (1, 3):
        found = st.simulate(tail(), q, v, threads=threads, **settings)
        for k in range(20):
            try:
                flight = st.simulate(tail(), q[k], v[k], **settings)
            except st.SimulationError as error:
                assert str(found.errors[k]) == str(error)
            else:
                assert found.errors[k] is None and np.isfinite(found.v[k]).all()
                np.testing.assert_allclose(found.q[k], flight.q, rtol=0, atol=1e-11)
        failed = {k for k in range(20) if found.errors[k]}
        assert failed >= {0, 2, 5} and (11 in failed) == (method == "tsit5") and len(failed) < 10
        assert np.isnan(found.q[2, 1:]).all()


def test_torques_of_their_own_with_kinks_at_any_times_fly_abreast():
    (q, v), rng = starts(tail(), 19), np.random.default_rng(4)
    constants = [st.TorqueTable([0.0], 1e-5 * rng.normal(size=(1, NT)), 1e-6) for _ in range(19)]
    tables = [st.TorqueTable(TABLE.times, 1e-5 * rng.normal(size=(3, NT))) for _ in range(19)]
    kinks = [st.TorqueTable([0.0, 0.01 + 1e-3 * k], 1e-5 * np.eye(2, NT)) for k in range(19)]
    for given in (constants, tables, kinks, [None, DAMPING, *constants[2:]]):
        found, flights = both(tail(), q, v, given, compare=near, **RK4)
        assert found.info["abreast"] == 8 and found.errors == [None] * 19
        work = [flight.info["work_J"]["torques"] for flight in flights]
        np.testing.assert_allclose(found.audit.work["torques"], work, rtol=1e-9, atol=1e-20)


@pytest.fixture
def priced(monkeypatch):
    """Lanes only where they pay."""
    monkeypatch.undo()


@pytest.fixture
def built(monkeypatch):
    """What is compiled beside models, where the cache has nothing of it."""
    found = []

    def noted(checked, sources, profile):
        found.extend([sources] if len(sources) == 1 else [])
        return model_library(checked, sources, profile)

    monkeypatch.setattr("serpentail.model.library.model_library", noted)
    monkeypatch.setattr("serpentail.model.library.library_in_cache", lambda *_: None)
    return found


def test_short_work_compiles_nothing_until_all_of_it_would_have_paid(priced, built, monkeypatch):
    model = st.load(tail().folder)
    q, v = starts(model, 9)
    assert st.simulate(model, q, v, **RK4).info["abreast"] == 1 and not built
    source = model.batch_library.rollouts
    price = lanes.COMPILE_S_PER_BYTE * source.bytes
    assert 0 < source.missed < price
    source.missed = price - source.missed / 2  # what many such calls would have come to
    assert st.simulate(model, q[:7], v[:7], **RK4).info["abreast"] == 1  # no full vector
    for _ in range(2):
        assert st.simulate(model, q, v, **RK4).info["abreast"] == 8 and len(built) == 1
    monkeypatch.undo()  # what the cache has is used for short work
    model = st.load(tail().folder)
    assert st.simulate(model, *starts(model, 8), **RK4).info["abreast"] == 8


def test_other_laws_fly_alone(built):
    model = st.load(tail().folder)
    q, v = starts(model, 9)
    laws = [lambda t, q, v: [0.0] * NT]
    laws.append(st.Pfl(model, st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT])))
    for law in laws:
        assert st.simulate(model, q, v, **RK4 | {"controller": law}).info["abreast"] == 1
    assert not built
    assert st.simulate(model, q, v, **RK4).info["abreast"] == 8 and len(built) == 1
    st.simulate(model.with_parameters(torso_mass=1.0), q, v, **RK4)
    assert len(built) == 1


@pytest.mark.parametrize(("price", "abreast"), [(1e-9, 8), (1.0, 1)])
def test_pilots_tell_whether_compiling_pays(priced, monkeypatch, price, abreast):
    monkeypatch.setattr("serpentail.model.library.library_in_cache", lambda *_: None)
    monkeypatch.setattr(lanes, "COMPILE_S_PER_BYTE", price)
    monkeypatch.setattr(batch, "PILOTS", 5)
    model, how = st.load(tail().folder), {"t_span": 0.3, "method": "tsit5", "output_step": 0.0123}
    found, flights = both(model, *starts(model, 19), compare=near, **how)
    assert found.info["abreast"] == abreast and found.errors == [None] * 19
    np.testing.assert_array_equal(found.q[:5], [flight.q for flight in flights[:5]])


def test_sound_flights_are_made_abreast_and_no_second_time(monkeypatch):
    """A group that fails is made singly, run by run: none of these may."""
    go, again = LaneRuns.go, []

    def told(self, runs, ended):
        for numbers, outcome in go(self, runs, ended):
            again.extend(numbers if outcome is None else [])
            yield numbers, outcome

    monkeypatch.setattr(LaneRuns, "go", told)
    q, v = starts(tail(), 19)
    found = st.simulate(tail(), q, v, t_span=0.3, method="tsit5")
    assert again == [] and found.errors == [None] * 19
    monkeypatch.setattr(batch, "RunsInTurn", lambda *_: pytest.fail("in turn"))
    for law in (None, DAMPING, TABLE, JUMPS):
        st.simulate(tail(), q, v, controller=law, **RK4)
