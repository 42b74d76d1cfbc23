"""Rollouts whose controllers differ: each run is what it is alone with its own, bit for bit."""

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import parallel_runs
from tests.support.rows import row

from ..runs import DAMPING, LEGS, NT, alone, rat, same, starts, tail

TIMES = [0.0, 0.0123, 0.031]
SPAN = {"t_span": 0.05, "output_step": 5e-3}


def table(k):
    """A table of torques of run k, whose kinks are its own."""
    return st.TorqueTable([0.0, 0.01 + 1e-3 * k], 1e-5 * (k + 1) * np.eye(2, NT), 1e-6)


def laws(model):
    """One of each kind."""
    reference = st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT])
    ramp = st.TorqueCurve(st.Piecewise(np.array([0.01, 0.02]), np.full((1, NT, 2), 1e-5)))
    tracking = [st.Pfl(model, reference, kp=3e4), st.Pfl(model, reference, kd=300.0)]
    phases = st.Phases([(0.0, None), (0.02, DAMPING)])
    return [None, DAMPING, table(2), ramp, *tracking, phases]


def test_a_list_has_a_controller_of_any_kind_for_each_run():
    given = laws(tail())
    q, v = starts(tail(), len(given))
    for method in ({"method": "tsit5"}, {"method": "rk4", "step": 1e-3}, {"method": "ros34pw2"}):
        flights = alone(tail(), q, v, given, **method, **SPAN)
        for threads in (1, 3):
            with row(method, threads):
                how = method | SPAN | {"threads": threads}
                found = st.simulate(tail(), q, v, controller=given, **how)
                same(found, flights)
                assert len(np.unique(found.q[:, -1, -1])) == len(given)


def test_functions_of_python_and_scipy_take_their_own_controllers():
    given = [lambda t, q, v: -1e-6 * v[6:], DAMPING, lambda t, q, v: [1e-5] * NT]
    q, v = starts(tail(), 3)
    for method in ("tsit5", "dop853"):
        found = st.simulate(tail(), q, v, controller=given, method=method, **SPAN)
        same(found, alone(tail(), q, v, given, method=method, **SPAN))


def test_on_the_ground_controllers_differ_too():
    given = (st.Damping(1e-3), st.TorqueTable([0.0], [[1e-4, -1e-4]], 1e-3), st.Damping(2e-3))
    q, v = starts(rat(), 3)
    how = {"legs": LEGS, "t_span": 0.2, "output_step": 0.02, "method": "ros34pw2"}
    same(st.simulate(rat(), q, v, controller=given, **how), alone(rat(), q, v, given, **how))


def test_tables_and_damping_may_have_an_axis_of_the_runs():
    q, v = starts(tail(), 3)
    torques = 1e-5 * np.random.default_rng(3).normal(size=(3, 3, NT))
    rows, still = np.outer([1, 2, 3], [1e-6] * NT), np.zeros((3, 1, NT))
    one, three = TIMES[:1], torques[:, :1]
    cases = [
        (st.TorqueTable(one, three, 1e-6), [st.TorqueTable(one, each, 1e-6) for each in three]),
        (
            st.TorqueTable(TIMES, torques, 1e-6),
            [st.TorqueTable(TIMES, each, 1e-6) for each in torques],
        ),
        (st.Damping(rows), [st.Damping(tuple(each)) for each in rows]),
        (
            st.TorqueTable(one, still, rows),
            [st.TorqueTable(one, still[0], tuple(each)) for each in rows],
        ),
    ]
    for law, given in cases:
        found = st.simulate(tail(), q, v, controller=law, method="tsit5", **SPAN)
        same(found, alone(tail(), q, v, given, method="tsit5", **SPAN))


def test_the_stiffest_controller_chooses_the_method():
    q, v = starts(tail(), 2)
    given = [st.Damping(1e-9), st.Damping(1e-2)]
    assert st.simulate(tail(), q, v, controller=given[0], t_span=0.01).info["method"] == "tsit5"
    found = st.simulate(tail(), q, v, controller=given, t_span=0.01)
    assert found.info["method"] == "ros34pw2"


def test_equal_controllers_are_read_once(monkeypatch):
    made, law = [], parallel_runs.Acting._of
    monkeypatch.setattr(parallel_runs.Acting, "_of", lambda *a: made.append(a) or law(*a))
    q, v = starts(tail(), 4)
    given = [DAMPING, table(1), DAMPING, None]
    found = st.simulate(tail(), q, v, controller=given, method="tsit5", **SPAN)
    assert len(made) == 3
    same(found, alone(tail(), q, v, given, method="tsit5", **SPAN))


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
    with pytest.raises(st.SimulationError, match="a list of 1, one start"):
        st.simulate(tail(), q[0], v[0], controller=[DAMPING], t_span=0.01)
