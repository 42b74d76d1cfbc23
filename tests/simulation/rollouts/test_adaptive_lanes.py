"""Flights by tsit5 in lanes, each with its own clock: what each is alone, to rounding."""

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import batched_runs, parallel_runs
from serpentail.simulation.adaptive_runs import AdaptiveRuns
from tests.references.metrics import block_error

from ...support.models import model_folder
from .many import DAMPING, WANTED, alone, same, starts, tail
from .test_lanes import LAWS, near

FLIGHT = {"t_span": (0.005, 0.3), "method": "tsit5", "output_step": 0.0123}
COUNTS = ("steps", "rejected", "evaluations")
PHASES = st.Phases([(0.0, DAMPING), (0.1, LAWS["table"]), (0.2, None)])


def unlike(count, seed=0):
    """Starts of which some need several times as many steps as others."""
    q, v = starts(tail(), count, seed)
    return q, v * np.linspace(0.2, 12, count)[:, None]


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", [*LAWS.values(), PHASES], ids=[*LAWS, "phases"])
def test_each_lane_steps_as_its_run_does_alone(law):
    q, v = unlike(21)
    settings = FLIGHT | {"controller": law}
    flights = alone(tail(), q, v, **settings)
    taken = [flight.info["steps"] for flight in flights]
    assert max(taken) > 2 * min(taken)
    for count in (2, 8, 9, 21):
        found = st.simulate(tail(), q[:count], v[:count], **settings)
        assert found.info["abreast"] == 8 and found.errors == [None] * count
        near(found, flights[:count])
        for k in range(count):
            assert [found[k].info[n] for n in COUNTS] == [flights[k].info[n] for n in COUNTS]
        assert (found.ends == 0.3).all()
        work = [flight.info["work_J"]["torques"] for flight in flights[:count]]
        np.testing.assert_allclose(found.audit.work["torques"], work, rtol=1e-8, atol=1e-16)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
def test_the_tolerance_holds_against_scipy(rtol):
    q, v = starts(tail(), 9)
    settings = {"t_span": 0.3, "output_step": 0.05, "controller": DAMPING}
    found = st.simulate(tail(), q, v, method="tsit5", rtol=rtol, atol=rtol, **settings)
    assert found.info["abreast"] == 8
    for k in range(9):
        exact = st.simulate(tail(), q[k], v[k], method="dop853", rtol=1e-12, **settings)
        assert block_error(found.v[k], exact.v) <= 300 * rtol


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", [None, LAWS["table"], PHASES], ids=["none", "table", "phases"])
def test_the_reproducible_profile_gives_the_same_bits(law):
    model = st.load(tail().folder, profile="reproducible")
    q, v = unlike(11)
    found = st.simulate(model, q, v, **FLIGHT | {"controller": law})
    assert found.info["abreast"] == 8
    same(found, alone(model, q, v, **FLIGHT | {"controller": law}))


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize(
    ("sizes", "options", "digits"),
    [
        ((2, 2), {"emission": "loops"}, 1e-11),
        ((2, 2), {"baked": True}, 1e-11),
        ((2, 2), {"real": "float"}, 3e-3),
        ((2, None), {}, 1e-11),
    ],
    ids=["loops", "baked", "float", "continuum"],
)
def test_every_form_of_a_model_has_lanes(sizes, options, digits):
    model = st.load(model_folder(*sizes, name="form", functions=WANTED, **options))
    q, v = starts(model, 19)
    settings = {"t_span": 0.05, "method": "tsit5", "controller": LAWS["table"]}
    found = st.simulate(model, q, v, **settings)
    assert found.info["abreast"] == (16 if options.get("real") == "float" else 8)
    near(found, alone(model, q, v, **settings), digits)


@pytest.mark.usefixtures("any_number_is_many")
def test_controllers_and_parameters_are_those_of_the_run_in_the_lane():
    q, v = unlike(13)
    given = [None, DAMPING, PHASES, LAWS["table"], LAWS["jumps"]] * 2 + [None, DAMPING, PHASES]
    mass = np.linspace(0.002, 0.02, 13)
    found = st.simulate(tail(), q, v, controller=given, parameters={"tail_mass": mass}, **FLIGHT)
    assert found.info["abreast"] == 8
    flights = []
    for k, law in enumerate(given):
        model = tail().with_parameters(tail_mass=mass[k])
        flights.append(st.simulate(model, q[k], v[k], controller=law, **FLIGHT))
    near(found, flights)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize(
    "settings", [{"first_step": 1e-3}, {"most_step": 2e-3}, {"least_step": 1e-5}]
)
def test_settings_of_steps_hold_in_lanes(settings):
    q, v = unlike(9)
    found, flights = (
        st.simulate(tail(), q, v, **FLIGHT | settings),
        alone(tail(), q, v, **FLIGHT | settings),
    )
    near(found, flights)
    assert found.info["steps"] == sum(flight.info["steps"] for flight in flights)


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("threads", [1, 3])
def test_a_run_that_fails_loses_no_other(threads):
    q, v = unlike(20)
    v[[0, 2]] *= 1e160  # overflow at once
    v[5] = [1e200] + [0.0] * (v.shape[1] - 1)  # has no energy
    v[11] *= 40  # takes too many steps
    settings = FLIGHT | {"most_steps": 200, "threads": threads}
    found = st.simulate(tail(), q, v, **settings)
    for k in range(20):
        try:
            flight = st.simulate(tail(), q[k], v[k], **FLIGHT | {"most_steps": 200})
        except st.SimulationError as error:
            assert str(found.errors[k]) == str(error)
        else:
            assert found.errors[k] is None
            np.testing.assert_allclose(found.q[k], flight.q, rtol=0, atol=1e-11)
            assert np.isfinite(found.q[k]).all() and np.isfinite(found.v[k]).all()
    failed = {k for k in range(20) if found.errors[k]}
    assert failed >= {0, 2, 5, 11} and len(failed) < 10


@pytest.mark.usefixtures("any_number_is_many")
def test_runs_that_go_well_are_not_made_again_alone(monkeypatch):
    go, again = AdaptiveRuns.go, []

    def told(self, runs, ended):
        for numbers, outcome in go(self, runs, ended):
            again.extend([] if outcome else numbers)
            yield numbers, outcome

    monkeypatch.setattr(AdaptiveRuns, "go", told)
    found = st.simulate(tail(), *unlike(21), **FLIGHT)
    assert again == [] and found.errors == [None] * 21


@pytest.mark.usefixtures("any_number_is_many")
def test_runs_do_not_depend_on_their_order_or_on_threads():
    q, v = unlike(40)
    order = np.random.default_rng(3).permutation(40)
    first = st.simulate(tail(), q, v, threads=1, **FLIGHT)
    other = st.simulate(tail(), q[order], v[order], threads=5, **FLIGHT)
    np.testing.assert_array_equal(other.q, first.q[order])
    np.testing.assert_array_equal(other.v, first.v[order])


@pytest.mark.parametrize(("price", "lanes"), [(1e-9, 8), (1.0, 1)])
def test_pilots_tell_whether_compiling_pays(monkeypatch, price, lanes):
    monkeypatch.setattr("serpentail.model.batch.library_in_cache", lambda *_: None)
    monkeypatch.setattr(batched_runs, "COMPILE_S_PER_BYTE", price)
    monkeypatch.setattr(parallel_runs, "PILOTS", 5)
    model = st.load(tail().folder)
    q, v = unlike(19)
    found = st.simulate(model, q, v, **FLIGHT)
    assert found.info["abreast"] == lanes and found.errors == [None] * 19
    flights = alone(model, q, v, **FLIGHT)
    near(found, flights)
    np.testing.assert_array_equal(found.q[:5], [flight.q for flight in flights[:5]])
