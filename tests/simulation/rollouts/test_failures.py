"""A run that fails is its own error, and loses no other; what is wrong is named with its run."""

import ctypes
import threading

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import LEGS, NQ, NT, PER_RUN, alone, rat, same, starts, tail


def test_a_run_that_fails_loses_no_other():
    q, v = starts(tail(), 5)
    v[2] *= 1e160  # overflows at once
    v[4] *= 100  # takes too many steps
    law = st.TorqueTable([5.0], [[1e-4] * NT])
    settings = {"t_span": (5, 6), "controller": law, "output_step": 0.05, "method": "tsit5"}
    settings["most_steps"] = 600
    for threads in (1, 3):
        found = st.simulate(tail(), q, v, threads=threads, **settings)
        for k in range(5):
            with row(threads, k):
                check_alone(found, k, (q[k], v[k]), settings)
        assert [error is None for error in found.errors] == [True, True, False, True, False]
        assert "most_steps" in str(found.errors[4]) and len(found.errors[4].trajectory.t) > 1
        assert 5 < found.ends[4] < 6 and found.ends[0] == 6


def check_alone(found, k, state, settings):
    """Run k of rollouts is, or fails as, the one that starts alone."""
    try:
        flight = st.simulate(tail(), *state, **settings)
    except st.SimulationError as error:
        own, flight = found.errors[k], error.trajectory
        assert str(own) == str(error) and isinstance(own, st.SimulationError)
        with pytest.raises(st.SimulationError) as caught:
            found[k]
        assert caught.value is own and (own.trajectory is None) == (flight is None)
    else:
        assert found.errors[k] is None
    rows = 0 if flight is None else len(flight.t)
    assert rows or np.isnan(found.kinetic[k]).all()
    for name in PER_RUN:
        array = getattr(found, name)[k]
        assert np.isnan(array[max(rows, 1) :]).all()
        if rows:
            np.testing.assert_array_equal(array[:rows], getattr(flight, name))


def test_a_function_of_python_runs_in_the_calling_thread():
    threads = set()

    def law(t, q, v):
        threads.add(threading.current_thread())
        return [0.0] * NT

    found = st.simulate(tail(), *starts(tail(), 4), t_span=0.01, controller=law)
    assert found.info["threads"] == 1 and threads == {threading.current_thread()}


@pytest.mark.parametrize("method", ["tsit5", "rk4", "dop853", "lsoda"])
def test_what_a_function_raises_ends_all_but_a_simulation_error_its_run(method):
    q, v = starts(tail(), 3)
    q[1, 0] = 50.0
    calls = []

    def law(error, begin=0.005):
        def torque(t, q, v):
            calls.append(t)
            if q[0] > 40 and t > begin:
                raise error
            return [0.0] * NT

        return torque

    settings = {"t_span": 0.01, "output_step": 1e-3, "method": method}
    with pytest.raises(KeyError, match="mine"):
        st.simulate(tail(), q, v, controller=law(KeyError("mine")), **settings)
    found = st.simulate(tail(), q, v, controller=law(st.SimulationError("mine")), **settings)
    assert [str(error) for error in found.errors] == ["None", "mine", "None"]
    assert len(found.errors[1].trajectory.t) > 2
    calls.clear()
    with pytest.raises(KeyError):
        st.simulate(tail(), q[1:], v[1:], controller=law(KeyError("mine"), -1), **settings)
    assert len(calls) == 1


def test_a_compiled_torque_that_refuses_ends_its_run():
    real = ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, real, real, real)
    def torque(_context, t, q, _v, _tau):
        return int(q[0] > 40 and t > 0.005)

    q, v = starts(tail(), 3)
    q[1, 0] = 50.0
    how = {"t_span": 0.01, "controller": st.NativeTorque(torque), "method": "tsit5"}
    for threads in (1, 2):
        found = st.simulate(tail(), q, v, threads=threads, **how)
        assert [error is None for error in found.errors] == [True, False, True]
        assert "error status" in str(found.errors[1])


def row_with(array, where, value):
    changed = array.copy()
    changed[where] = value
    return changed


def test_wrong_states_are_named_with_their_run():
    Q, V = starts(tail(), 4)
    rows = [
        ((row_with(Q, (2, 1), np.nan), V), r"q0\[1\] of run 2: value nan"),
        ((Q, row_with(V, (3, 0), np.inf)), r"v0\[0\] of run 3: value inf"),
        ((row_with(Q, (1, slice(3, 7)), 0), V), r"q0\[3:7\] of run 1 .*zero quaternion"),
        ((Q, V[:3]), "q0 has 4 runs, v0 3"),
        ((Q[:, 1:], V), rf"q0 has shape \(4, {NQ - 1}\)"),
        ((Q[:0], V[:0]), rf"q0 has shape \(0, {NQ}\)"),
    ]
    for states, words in rows:
        with row(words), pytest.raises(st.StateError, match=words):
            st.simulate(tail(), *states)
    with pytest.raises(st.SimulationError, match=r"4 runs: give 4e-07 s"):
        st.simulate(tail(), Q, V, t_span=1.0, output_step=1e-7)


WRONG_PARAMETERS = [
    ({"tail_mas": [1.0] * 4}, "tail_mas: .*'tail_mass'"),
    ({"tail_mass": [0.1] * 3}, r"tail_mass: value \[0.1, 0.1, 0.1\].*4 runs"),
    ({"tail_mass": 0.1}, r"tail_mass: value 0.1.*4 runs"),
    ({"tail_mount": [0.1] * 4}, r"tail_mount: value .*4 runs"),
    ({"tail_mass": [0.1, 0.1, -0.1, 0.1]}, r"tail_mass of run 2: value -0.1"),
    ({"gravity": [0.1, np.nan, 0.1, 0.1]}, r"gravity of run 1: value nan"),
    (
        {"torso_inertia": [[1, 1, 1], [1, 1, 3], [1, 1, 1], [1, 1, 1]]},
        r"torso_inertia of run 1: value \[1.0",
    ),
    ({"link_radius": [0.1] * 4, "link_inertia": [[1, 1, 1]] * 4}, "not both"),
    ([("tail_mass", 1.0)], "needs a mapping"),
]


def test_wrong_parameters_are_named_with_their_run():
    Q, V = starts(tail(), 4)
    for own, words in WRONG_PARAMETERS:
        with row(own), pytest.raises(st.ModelError, match=words):
            st.simulate(tail(), Q, V, parameters=own)
    with pytest.raises(st.ModelError, match="one start only"):
        st.simulate(tail(), Q[0], V[0], parameters={"tail_mass": 0.1})
    baked = zoo.model("baked")
    q, v = starts(baked, 4)
    with pytest.raises(st.ModelError, match="baked"):
        st.simulate(baked, q, v, parameters={"tail_mass": [0.1] * 4})
    same(st.simulate(baked, q, v, t_span=0.01, parameters={}), alone(baked, q, v, t_span=0.01))


@pytest.mark.filterwarnings("ignore::serpentail.errors.UnusualSize")
def test_bodies_of_unlike_size_in_one_run_are_warned_of_where_it_is_called():
    own, how = {"tail_length": [0.2, 200.0, 0.2, 0.2]}, {"t_span": 1e-3, "step": 1e-3}
    with pytest.warns(st.UnlikeBodies, match=r"factor of 3\.9e\+06") as caught:
        st.simulate(tail(), *starts(tail(), 4), parameters=own, **how)
    assert {warning.filename for warning in caught} == {__file__}


def test_wrong_starts_on_the_ground_are_named():
    q, v = starts(rat(), 3)
    with pytest.raises(st.SimulationError, match=r"q0 of run 1: point \d+ \(\w+\) is \d+ mm deep"):
        st.simulate(rat(), row_with(q, (1, 2), -0.3), v, legs=LEGS)
    heavy = {"tail_mass": [1e308] * 3}
    with pytest.raises(st.ModelError, match="tail_mass and gravity"):
        st.simulate(rat(), q, v, legs=LEGS, t_span=0.002, method="rk4", parameters=heavy)
    with pytest.raises(st.SimulationError, match=r"bristles0 .*\(2, 9, 2\).*\(9, 2\)"):
        st.simulate(rat(), q, v, legs=LEGS, bristles0=np.zeros((2, 9, 2)))
    with pytest.raises(st.StateError, match="one start state after another"):
        st.settle(rat(), q, legs=LEGS)
