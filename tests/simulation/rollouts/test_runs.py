"""Many runs at once give what each gives alone, bit for bit: with parameters and a controller of
its own, in any order, on any core.
"""

import pickle

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import ARRAYS, DAMPING, LEGS, NQ, NT, PER_RUN, alone, both, rat, same, starts, tail


def own_info(info):
    """What does not depend on the machine, or on the other runs."""
    return {name: x for name, x in info.items() if name not in ("seconds", "cpu_seconds", "reason")}


TABLE = st.TorqueTable([0.0, 0.02], [[1e-5] * NT, [-1e-5] * NT], 1e-6)
SETTINGS = [
    {"method": "tsit5"},
    {"method": "dp8"},
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
            found, flights = both(tail(), q, v, **settings)
            assert len(found) == 5 and found.errors == [None] * 5
            assert found.info["method"] == flights[0].info["method"]
            assert found.info["steps"] == sum(flight.info["steps"] for flight in flights)
            for k, flight in enumerate(flights):
                assert own_info(found[k].info) == own_info(flight.info)
                assert found.ends[k] == flight.t[-1]
                np.testing.assert_array_equal(found[k].q, flight.q)
    single = zoo.model("single")
    law = st.Pfl(single, st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT]))
    found, _ = both(single, q, v, law, t_span=0.05, output_step=5e-3, method="tsit5")
    assert found.q.dtype == found.kinetic.dtype == np.float64


def test_on_the_ground():
    how = {"legs": LEGS, "controller": st.Damping(1e-3), "t_span": 0.3, "output_step": 0.02}
    for method in ("ros34pw2", "tsit5", "implicit_euler"):
        found, flights = both(rat(), *starts(rat(), 4), method=method, **how)
        assert any(flight.events for flight in flights)
        for k, flight in enumerate(flights):
            assert found[k].events == flight.events
            np.testing.assert_array_equal(found.bristles[k], flight.contact.bristles)
            for name in ("points", "forces", "bristles"):
                one, other = getattr(found[k].contact, name), getattr(flight.contact, name)
                np.testing.assert_array_equal(one, other, err_msg=f"{method}: {name} of run {k}")


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


def test_each_run_has_its_own_parameters():
    """Of the body, and of the ground."""
    rng = np.random.default_rng(1)
    mass, inertias = rng.uniform(0.002, 0.005, 4), rng.uniform(1e-7, 1.5e-7, (4, 3))
    flies = [
        {"tail_mass": mass, "tail_mount": 0.02 * rng.normal(size=(4, 3)), "link_inertia": inertias},
        {"tail_length": [0.1, 0.2, 0.3, 0.4], "link_radius": 0.001 * np.arange(1, 5)},
    ]
    how = {"t_span": 0.05, "controller": st.Damping(1e-3), "output_step": 0.01}
    rows = [(tail(), each | {"gravity": [0, 1, 9.8, 2]}, how) for each in flies]
    ground = {"mu": [0.0, 0.5, 1.0, 0.2], "K_n": [500.0, 1000.0, 2000.0, 700.0]}
    rows.append((rat(), ground, how | {"legs": LEGS}))
    for model, given, how in rows:
        q, v = starts(model, 4)
        found = st.simulate(model, q, v, parameters=given, **how)
        for k in range(4):
            one = model.with_parameters(**{name: values[k] for name, values in given.items()})
            flight = st.simulate(one, q[k], v[k], method=found.info["method"], **how)
            for name in PER_RUN:
                np.testing.assert_array_equal(getattr(found, name)[k], getattr(flight, name))
            assert found[k].info["parameters"] == flight.info["parameters"]
        assert len(np.unique(found.kinetic[:, -1])) == 4


def test_the_stiffest_run_chooses_the_method():
    """By its parameters, or by its controller."""
    q, v = starts(tail(), 3)
    settings = {"controller": st.Damping(1e-2), "t_span": 0.01, "rtol": 1e-4}
    rows = [([0.1], "tsit5"), ([0.001], "ros34pw2"), ([0.1, 0.1], "tsit5")]
    for masses, method in (*rows, ([0.1, 0.1, 0.001], "ros34pw2")):
        own, k = {"tail_mass": masses}, len(masses)
        found = st.simulate(tail(), q[:k], v[:k], parameters=own, **settings)
        assert found.info["method"] == method, masses
    mild, stiff = st.Damping(1e-9), st.Damping(1e-2)
    for law, method in ((mild, "tsit5"), ([mild, stiff, mild], "ros34pw2")):
        assert st.simulate(tail(), q, v, **settings | {"controller": law}).info["method"] == method


def test_runs_do_not_depend_on_their_order_or_on_threads():
    q, v = starts(tail(), 40)
    mass = np.random.default_rng(2).uniform(0.002, 0.005, 40)
    order, found = np.random.default_rng(3).permutation(40), []
    for threads, rows in ((1, slice(None)), (7, order)):
        how = {"t_span": 0.02, "controller": DAMPING, "method": "tsit5", "threads": threads}
        own = {"tail_mass": mass[rows]}
        found.append(st.simulate(tail(), q[rows], v[rows], parameters=own, **how))
        assert found[-1].info["threads"] == threads
    for name in PER_RUN:
        np.testing.assert_array_equal(getattr(found[1], name), getattr(found[0], name)[order])


def test_a_single_state_is_repeated_and_one_row_is_one_of_many():
    q, v = starts(tail(), 3)
    settings = {"t_span": 0.01, "step": 1e-3, "output_step": 1e-3}
    for state in ((q[0], v), (q, v[0])):
        rows = (np.broadcast_to(a, (3, a.shape[-1])) for a in state)
        same(st.simulate(tail(), *state, **settings), alone(tail(), *rows, **settings))
    found = st.simulate(tail(), q[:1], v[:1], t_span=0.01)
    assert len(found) == 1 and found.q.shape == (1, 21, NQ)
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


TIMES = [0.0, 0.0123, 0.031]
SPAN = {"t_span": 0.05, "output_step": 5e-3}


def test_a_list_has_a_controller_of_any_kind_for_each_run():
    reference = st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT])
    ramp = st.TorqueCurve(st.Piecewise(np.array([0.01, 0.02]), np.full((1, NT, 2), 1e-5)))
    tracking = [st.Pfl(tail(), reference, kp=3e4), st.Pfl(tail(), reference, kd=300.0)]
    phases = st.Phases([(0.0, None), (0.02, DAMPING)])
    table = st.TorqueTable([0.0, 0.012], 3e-5 * np.eye(2, NT), 1e-6)
    given = [None, DAMPING, table, ramp, *tracking, phases]
    functions = [lambda t, q, v: -1e-6 * v[6:], DAMPING, lambda t, q, v: [1e-5] * NT]
    q, v = starts(tail(), len(given))
    for method in ({"method": "tsit5"}, {"method": "rk4", "step": 1e-3}, {"method": "ros34pw2"}):
        flights = alone(tail(), q, v, given, **method, **SPAN)
        for threads in (1, 3):
            with row(method, threads):
                how = {"threads": threads} | method | SPAN
                same(st.simulate(tail(), q, v, controller=given, **how), flights)
        assert len({flight.q[-1, -1] for flight in flights}) == len(given)
    for method in ("tsit5", "dop853"):
        both(tail(), q[:3], v[:3], functions, method=method, **SPAN)
    given = (st.Damping(1e-3), st.TorqueTable([0.0], [[1e-4, -1e-4]], 1e-3), st.Damping(2e-3))
    how = {"legs": LEGS, "t_span": 0.2, "output_step": 0.02, "method": "ros34pw2"}
    both(rat(), *starts(rat(), 3), given, **how)


def test_tables_and_damping_may_have_an_axis_of_the_runs():
    torques = 1e-5 * np.random.default_rng(3).normal(size=(3, 3, NT))
    rows, still = np.outer([1, 2, 3], [1e-6] * NT), np.zeros((3, 1, NT))
    nodes = [(TIMES[:1], torques[:, :1], 1e-6), (TIMES, torques, 1e-6), (TIMES[:1], still, rows)]
    cases = [(st.Damping(rows), [st.Damping(tuple(each)) for each in rows])]
    for times, values, damping in nodes:
        own = [damping] * 3 if np.ndim(damping) == 0 else map(tuple, damping)
        each = [st.TorqueTable(times, *pair) for pair in zip(values, own, strict=True)]
        cases.append((st.TorqueTable(times, values, damping), each))
    for law, each in cases:
        both(tail(), *starts(tail(), 3), law, each, method="tsit5", **SPAN)


WRONG = [
    ([None, None], "2 controllers for 3 runs"),
    ([], "0 controllers for 3 runs"),
    ([None, 5, None], "run 1: controller: value 5"),
    ([None, None, st.TorqueTable([0.0], [[0.0]])], "run 2: TorqueTable"),
    (st.TorqueTable([0.0], np.zeros((2, 1, NT))), "2 controllers for 3 runs"),
    (st.TorqueTable([0.0], np.full((3, 1, NT), np.nan)), "run 0.*torques"),
    (st.Damping(np.full((3, NT), -1.0)), "run 0: damping"),
    ([None, [None], None], "run 1: controller: value"),
]


def test_what_is_wrong_is_told_with_its_run():
    for given, words in WRONG:
        with row(words), pytest.raises(st.SimulationError, match=words):
            st.simulate(tail(), *starts(tail(), 3), controller=given, t_span=0.01)
    q, v = starts(tail(), 1)
    with pytest.raises(st.SimulationError, match="watch: many starts"):
        st.simulate(tail(), q, v, watch=print)
    with pytest.raises(st.SimulationError, match="a list of 1, one start"):
        st.simulate(tail(), q[0], v[0], controller=[DAMPING], t_span=0.01)
