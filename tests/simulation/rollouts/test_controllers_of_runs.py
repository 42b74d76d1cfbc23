"""Rollouts whose controllers differ: each run is what it is alone with its own, bit for bit."""

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import parallel_runs

from .many import DAMPING, LEGS, NT, PER_RUN, alone, rat, same, starts, tail

TIMES = [0.0, 0.0123, 0.031]
SPAN = {"t_span": 0.05, "output_step": 5e-3}


def table(k):
    """A table of torques of run k, whose kinks are its own."""
    return st.TorqueTable([0.0, 0.01 + 1e-3 * k], 1e-5 * (k + 1) * np.eye(2, NT), 1e-6)


def ramp():
    """Torques that rise between two times, at which they jump."""
    return st.TorqueCurve(st.Piecewise(np.array([0.01, 0.02]), np.full((1, NT, 2), 1e-5)))


def laws(model):
    """One of each kind."""
    reference = st.Reference([0.0, 0.05], [[0.0] * NT, [0.3] * NT])
    return [
        None,
        DAMPING,
        table(2),
        ramp(),
        st.Pfl(model, reference, kp=3e4),
        st.Pfl(model, reference, kd=300.0),
        st.Phases([(0.0, None), (0.02, DAMPING)]),
    ]


def flights(model, q, v, controllers, **settings):
    """Each run by a call of its own."""
    runs = zip(q, v, controllers, strict=True)
    return [st.simulate(model, *run[:2], controller=run[2], **settings) for run in runs]


@pytest.mark.parametrize(
    "method", [{"method": "tsit5"}, {"step": 1e-3, "method": "rk4"}, {"method": "ros34pw2"}]
)
@pytest.mark.parametrize("threads", [1, 3])
def test_a_list_has_a_controller_of_any_kind_for_each_run(method, threads):
    given = laws(tail())
    q, v = starts(tail(), len(given))
    found = st.simulate(tail(), q, v, controller=given, threads=threads, **method, **SPAN)
    same(found, flights(tail(), q, v, given, **method, **SPAN))
    assert len(np.unique(found.q[:, -1, -1])) == len(given)


def test_functions_of_python_and_scipy_take_their_own_controllers():
    given = [lambda t, q, v: -1e-6 * v[6:], DAMPING, lambda t, q, v: [1e-5] * NT]
    q, v = starts(tail(), 3)
    for method in ("tsit5", "dop853"):
        found = st.simulate(tail(), q, v, controller=given, method=method, **SPAN)
        same(found, flights(tail(), q, v, given, method=method, **SPAN))


def test_on_the_ground_controllers_differ_too():
    given = (st.Damping(1e-3), st.TorqueTable([0.0], [[1e-4, -1e-4]], 1e-3), st.Damping(2e-3))
    q, v = starts(rat(), 3)
    settings = {"legs": LEGS, "t_span": 0.2, "output_step": 0.02, "method": "ros34pw2"}
    same(
        st.simulate(rat(), q, v, controller=given, **settings),
        flights(rat(), q, v, given, **settings),
    )


@pytest.mark.parametrize("nodes", [1, 3])
def test_a_table_with_an_axis_of_the_runs_is_a_table_each(nodes):
    q, v = starts(tail(), 4)
    torques = 1e-5 * np.random.default_rng(3).normal(size=(4, nodes, NT))
    law = st.TorqueTable(TIMES[:nodes], torques, 1e-6)
    given = [st.TorqueTable(TIMES[:nodes], each, 1e-6) for each in torques]
    found = st.simulate(tail(), q, v, controller=law, method="tsit5", **SPAN)
    same(found, flights(tail(), q, v, given, method="tsit5", **SPAN))


def test_damping_may_have_a_row_a_run():
    q, v = starts(tail(), 3)
    rows = np.outer([1, 2, 3], [1e-6] * NT)
    settings = SPAN | {"method": "tsit5"}
    given = [st.Damping(tuple(row)) for row in rows]
    expected = flights(tail(), q, v, given, **settings)
    same(st.simulate(tail(), q, v, controller=st.Damping(rows), **settings), expected)
    still = np.zeros((3, 1, NT))
    law = st.TorqueTable([0.0], still, rows)
    tables = [st.TorqueTable([0.0], still[0], tuple(row)) for row in rows]
    expected = flights(tail(), q, v, tables, **settings)
    same(st.simulate(tail(), q, v, controller=law, **settings), expected)


def test_the_stiffest_controller_chooses_the_method():
    q, v = starts(tail(), 2)
    given = [st.Damping(1e-9), st.Damping(1e-2)]
    assert st.simulate(tail(), q, v, controller=given[0], t_span=0.01).info["method"] == "tsit5"
    found = st.simulate(tail(), q, v, controller=given, t_span=0.01)
    assert found.info["method"] == "ros34pw2"


@pytest.mark.usefixtures("any_number_is_many")
@pytest.mark.parametrize("law", ["constants", "tables", "mixed"])
def test_torques_of_their_own_fly_abreast(law):
    q, v = starts(tail(), 19)
    rng = np.random.default_rng(4)
    constants = [st.TorqueTable([0.0], 1e-5 * rng.normal(size=(1, NT)), 1e-6) for _ in range(19)]
    tables = [st.TorqueTable(TIMES, 1e-5 * rng.normal(size=(3, NT))) for _ in range(19)]
    mixed = [None, DAMPING, *constants[2:]]
    given = {"constants": constants, "tables": tables, "mixed": mixed}[law]
    settings = SPAN | {"method": "rk4", "step": 3e-4}
    found = st.simulate(tail(), q, v, controller=given, **settings)
    assert found.info["abreast"] == 8 and found.errors == [None] * 19
    expected = flights(tail(), q, v, given, **settings)
    for name in PER_RUN:
        numbers = np.array([getattr(each, name) for each in expected])
        error = np.abs(getattr(found, name) - numbers).max()
        assert error <= 1e-11 * max(np.abs(numbers).max(), 1e-9), name
    work = [each.info["work_J"]["torques"] for each in expected]
    np.testing.assert_allclose(found.audit.work["torques"], work, rtol=1e-9, atol=1e-20)


@pytest.mark.usefixtures("any_number_is_many")
def test_kinks_at_other_times_fly_one_by_one():
    q, v = starts(tail(), 9)
    given = [table(k) for k in range(9)]
    settings = SPAN | {"method": "rk4", "step": 3e-4}
    found = st.simulate(tail(), q, v, controller=given, **settings)
    assert found.info["abreast"] == 1
    same(found, flights(tail(), q, v, given, **settings))


def test_the_same_object_serves_several_runs(monkeypatch):
    made = []
    law = parallel_runs.Acting._of
    monkeypatch.setattr(parallel_runs.Acting, "_of", lambda *a: made.append(a) or law(*a))
    q, v = starts(tail(), 4)
    given = [DAMPING, table(1), DAMPING, None]
    found = st.simulate(tail(), q, v, controller=given, method="tsit5", **SPAN)
    assert len(made) == 3
    same(found, flights(tail(), q, v, given, method="tsit5", **SPAN))


WRONG = {
    "too few": ([None, None], "2 controllers for 3 runs: give one, or one for each run"),
    "none": ([], "0 controllers for 3 runs"),
    "no controller": ([None, 5, None], "controller of run 1: controller: value 5"),
    "wrong table": (
        [None, None, st.TorqueTable([0.0], [[0.0]])],
        "controller of run 2: TorqueTable",
    ),
    "rows": (st.TorqueTable([0.0], np.zeros((2, 1, NT))), "2 controllers for 3 runs"),
    "a row": (st.TorqueTable([0.0], np.full((3, 1, NT), np.nan)), "controller of run 0.*torques"),
    "damping": (st.Damping(np.full((3, NT), -1.0)), "controller of run 0: damping"),
    "nested": ([None, [None], None], "controller of run 1: controller: value"),
}


@pytest.mark.parametrize(("given", "words"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_told_with_its_run(given, words):
    with pytest.raises(st.SimulationError, match=words):
        st.simulate(tail(), *starts(tail(), 3), controller=given, t_span=0.01)


def test_one_start_has_one_controller():
    q, v = starts(tail(), 1)
    with pytest.raises(st.SimulationError, match="a list of 1, one start: give one controller"):
        st.simulate(tail(), q[0], v[0], controller=[DAMPING], t_span=0.01)
    assert alone(tail(), q, v, t_span=0.01, controller=DAMPING)
