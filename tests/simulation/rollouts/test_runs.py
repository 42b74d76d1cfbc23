"""Many runs at once give what each gives alone, bit for bit, in any order, on any core."""

import pickle

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import ARRAYS, DAMPING, LEGS, NQ, NT, PER_RUN, alone, rat, same, starts, tail


def own_info(info):
    """What does not depend on the machine, or on the other runs."""
    return {name: x for name, x in info.items() if name not in ("seconds", "cpu_seconds", "reason")}


TABLE = st.TorqueTable([0.0, 0.02], [[1e-5] * NT, [-1e-5] * NT], 1e-6)
SETTINGS = [
    {"method": "tsit5"},
    {"method": "ros34pw2"},
    {"method": "rk4", "step": 1e-3},
    {"method": "implicit_euler", "step": 1e-3},
    {"method": "dop853"},
    {},
    {"controller": st.Damping(1e-2)},  # stiff
    {"controller": TABLE, "t_span": (-0.01, 0.05)},
    {"controller": lambda t, q, v: -1e-6 * v[6:]},
    {"controller": st.Phases([(0.0, None), (0.02, DAMPING)])},
]


def test_each_run_is_what_it_is_alone():
    q, v = starts(tail(), 5)
    for own in SETTINGS:
        with row(own):
            settings = {"t_span": 0.05, "output_step": 5e-3, "controller": DAMPING} | own
            flights, found = alone(tail(), q, v, **settings), st.simulate(tail(), q, v, **settings)
            same(found, flights)
            assert len(found) == 5 and found.errors == [None] * 5
            assert found.info["method"] == flights[0].info["method"]
            assert found.info["steps"] == sum(flight.info["steps"] for flight in flights)
            for k, flight in enumerate(flights):
                assert own_info(found[k].info) == own_info(flight.info)
                assert found.ends[k] == flight.t[-1]
                np.testing.assert_array_equal(found[k].q, flight.q)


def test_a_tracked_reference_and_single_precision():
    for model in (tail(), zoo.model("single")):
        law = st.Pfl(model, st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT]))
        settings, (q, v) = {"t_span": 0.05, "method": "tsit5"}, starts(model, 3)
        found = st.simulate(model, q, v, controller=law, **settings)
        same(found, alone(model, q, v, controller=law, **settings))
        assert found.q.dtype == found.kinetic.dtype == np.float64


@pytest.mark.parametrize("method", ["ros34pw2", "tsit5", "implicit_euler"])
def test_on_the_ground(method):
    settings = {"legs": LEGS, "controller": st.Damping(1e-3), "t_span": 0.3, "output_step": 0.02}
    q, v = starts(rat(), 4)
    flights = alone(rat(), q, v, method=method, **settings)
    found = st.simulate(rat(), q, v, method=method, **settings)
    assert any(flight.events for flight in flights)
    same(found, flights)
    for k, flight in enumerate(flights):
        assert found[k].events == flight.events
        np.testing.assert_array_equal(found.bristles[k], flight.contact.bristles)
        for name in ("points", "forces", "bristles"):
            one, other = getattr(found[k].contact, name), getattr(flight.contact, name)
            np.testing.assert_array_equal(one, other)


def test_runs_that_stop_at_events():
    stop = {"stop_at": [("touch_down", "tail")], "rtol": 1e-6, "legs": LEGS}
    settings = {"t_span": 0.3, "output_step": 0.02} | stop
    q, v = starts(rat(), 6)
    q[0, 2] += 5  # which does not come down in time
    flights, found = alone(rat(), q, v, **settings), st.simulate(rat(), q, v, **settings)
    assert len({len(flight.t) for flight in flights}) > 2
    for k, flight in enumerate(flights):
        rows = len(flight.t) - (flight.t[-1] < 0.3)
        assert found.errors[k] is None and found.ends[k] == flight.t[-1]
        np.testing.assert_array_equal(found.q[k, :rows], flight.q[:rows])
        for name in (*PER_RUN, "bristles"):
            assert np.isnan(getattr(found, name)[k, rows:]).all(), name
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(found[k], name), getattr(flight, name))
    assert not np.isnan(found.q[0]).any() and np.isnan(found.q[1:, -1]).all()


# ---- parameters ----------------------------------------------------------------------------------


def test_each_run_has_its_own_parameters():
    q, v = starts(tail(), 4)
    rng = np.random.default_rng(1)
    own = {"tail_mass": rng.uniform(0.002, 0.005, 4), "tail_mount": 0.02 * rng.normal(size=(4, 3))}
    settings = {"t_span": 0.05, "controller": st.Damping(1e-3)}
    found = st.simulate(tail(), q, v, parameters=own, **settings)
    for k in range(4):
        model = tail().with_parameters(**{name: values[k] for name, values in own.items()})
        flight = st.simulate(model, q[k], v[k], method=found.info["method"], **settings)
        for name in PER_RUN:
            np.testing.assert_array_equal(getattr(found, name)[k], getattr(flight, name))
        assert found[k].info["parameters"] == flight.info["parameters"]
    assert len(np.unique(found.kinetic[:, 0])) == 4


def test_parameters_of_runs_are_those_of_models():
    inertias = [[1e-7, 1e-8, 2e-7], [3e-7, 1e-8, 2e-7], [1e-7, 2e-8, 2e-7]]
    lengths = {"tail_length": [0.1, 0.2, 0.3], "tail_mass": [0.002, 0.003, 0.004]}
    rows = [{"link_radius": [0.001, 0.002, 0.003]}, {"link_inertia": inertias}]
    for own in (*rows, lengths | {"gravity": [0, 1, 9.8]}):
        each = [{name: values[k] for name, values in own.items()} for k in range(3)]
        models = [tail().with_parameters(**changes) for changes in each]
        vectors = tail().parameters_of_runs(own, 3).vectors
        np.testing.assert_array_equal(vectors, [model.parameter_vector for model in models])


def test_the_ground_may_differ_from_run_to_run():
    q, v = starts(rat(), 3)
    own = {"mu": [0.0, 0.5, 1.0], "K_n": [500.0, 1000.0, 2000.0]}
    settings = {"legs": LEGS, "t_span": 0.2}
    found = st.simulate(rat(), q, v, parameters=own, **settings)
    for k in range(3):
        model = rat().with_parameters(mu=own["mu"][k], K_n=own["K_n"][k])
        flight = st.simulate(model, q[k], v[k], **settings)
        np.testing.assert_array_equal(found.q[k], flight.q)
        np.testing.assert_array_equal(found[k].contact.forces, flight.contact.forces)


def test_the_stiffest_run_chooses_the_method():
    q, v = starts(tail(), 3)
    settings = {"controller": st.Damping(1e-2), "t_span": 0.01}
    rows = [([0.1], "tsit5"), ([0.001], "ros34pw2"), ([0.1, 0.1], "tsit5")]
    for masses, method in (*rows, ([0.1, 0.1, 0.001], "ros34pw2")):
        own, k = {"parameters": {"tail_mass": masses}}, len(masses)
        found = st.simulate(tail(), q[:k], v[:k], **own, **settings)
        assert found.info["method"] == method, masses


# ---- order and sharing ---------------------------------------------------------------------------


def test_runs_do_not_depend_on_their_order_or_on_threads():
    q, v = starts(tail(), 40)
    mass = np.random.default_rng(2).uniform(0.002, 0.005, 40)
    order, found = np.random.default_rng(3).permutation(40), []
    for threads in (1, 7):
        how = {"t_span": 0.02, "controller": DAMPING, "method": "tsit5", "threads": threads}
        for rows in (slice(None), order):
            own = {"tail_mass": mass[rows]}
            found.append(st.simulate(tail(), q[rows], v[rows], parameters=own, **how))
            assert found[-1].info["threads"] == threads
    for name in PER_RUN:
        first = getattr(found[0], name)
        np.testing.assert_array_equal(getattr(found[2], name), first)
        for other in found[1::2]:
            np.testing.assert_array_equal(getattr(other, name), first[order])


def test_a_single_state_is_repeated_and_one_row_is_one_of_many():
    q, v = starts(tail(), 3)
    settings = {"t_span": 0.01, "step": 1e-3}
    for state in ((q[0], v), (q, v[0])):
        rows = (np.broadcast_to(a, (3, a.shape[-1])) for a in state)
        same(st.simulate(tail(), *state, **settings), alone(tail(), *rows, **settings))
    found = st.simulate(tail(), q[:1], v[:1], t_span=0.01)
    assert len(found) == 1 and found.q.shape == (1, 201, NQ)
    np.testing.assert_array_equal(found[-1].q, found.q[0])
    with pytest.raises(IndexError):
        found[1]


def test_arguments_are_left_alone_and_results_are_read_only_and_can_be_pickled():
    q, v = starts(rat(), 2)
    given, bristles = [a.copy() for a in (q, v)], np.full((2, 9, 2), 1e-5)
    how = {"t_span": 0.1, "parameters": {"mu": [0.3, 0.6]}}
    found = st.simulate(rat(), q, v, legs=LEGS, bristles0=bristles, **how)
    np.testing.assert_array_equal([*q.ravel(), *v.ravel()], [*given[0].ravel(), *given[1].ravel()])
    assert (bristles == 1e-5).all() and (found.bristles[:, 0] == 1e-5).all()
    with pytest.raises(ValueError, match="read-only"):
        found.q[0, 0, 0] = 1
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again[1].contact.forces, found[1].contact.forces)
