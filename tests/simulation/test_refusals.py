"""What one run and what many refuse: starts, settings, parameters, controllers; what they warn of;
and a run that fails is its own error, and loses no other.
"""

import threading
import warnings
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from .runs import LEGS, NQ, NT, NV, PER_RUN, Q0, V0, alone, fly, rat, same, starts, tail

STARTS = [
    ((Q0[:-1], V0), rf"q0 .*\({NQ - 1},\).*\({NQ},\)"),
    ((Q0, [*V0, 0]), rf"v0 .*\({NV + 1},\).*\({NV},\)"),
    (([[Q0]], V0), r"q0 .*\(1, 1, \d+\)"),
    ((0.0, V0), r"q0 .*\(\)"),
    *(((q, V0), "q0: type") for q in (None, [[1], [1, 2]])),
    (([str(x) for x in Q0], V0), r"q0: value \['.*not texts"),
    *(((Q0, v), "v0: type") for v in (V0.astype(complex), V0 > 0)),
    (([*Q0[:-1], np.nan], V0), rf"q0\[{NQ - 1}\]: value nan"),
    ((Q0, [np.inf, *V0[1:]]), r"v0\[0\]: value inf"),
    ((np.zeros(NQ), V0), r"q0\[3:7\].*zero quaternion"),
]


def test_a_wrong_start_is_named():
    for start, words in STARTS:
        with row(words), pytest.raises(st.StateError, match=words):
            st.simulate(tail(), *start)


SPANS = [0, -1, (1, 1), (2, 1), (0, np.nan), (0, np.inf), (0, 1, 2), "1"]
SPANS += [None, (), [[0], [1]], ("0", "1"), (0, None), True, (0, 1j)]
LENGTHS = (0, -1e-3, np.nan, np.inf, "1", True, [1], 1j)
SETTINGS = [
    *(({"t_span": span}, "t_span") for span in SPANS),
    *(({name: x}, name) for name in ("step", "output_step") for x in LENGTHS),
    *(({"method": "dop853", name: 0}, name) for name in ("rtol", "atol")),
    ({"method": "euler"}, "method: value 'euler'.*'lsoda'"),
    ({"gravity": 1.6}, r"gravity: .*with_parameters\(gravity=1\.6\)"),
    ({"duration": 1}, "duration: .*t_span=1"),
    ({"method": "rk4", "rtol": 1e-6}, "rk4 .*'rtol'.*step, output_step"),
    ({"step": 1e-6, "rtol": 1e-6}, "rk4 .*'rtol'"),
    ({"method": "dop853", "step": 1}, "dop853 .*'step'.*rtol, atol, most_steps, output_step"),
    ({"stp": 1}, "'stp'.*'step'"),
    ({"controler": None}, "'controler'.*'controller'"),
    ({"colour": 1}, "'colour'.*rtol"),
    *(({"watch": watch}, "watch: value ") for watch in (3, "print")),
    ({"output_step": 1e-8, "t_span": 1}, "more than 10000000 samples: give 1e-07 s"),
    ({"output_step": 1e-11, "t_span": (1e6, 1e6 + 1e-9)}, "too short to move the time"),
    *(({name: [1]}, f"^{name} .*no contacts") for name in ("legs", "bristles0", "stop_at")),
]


def test_a_wrong_setting_is_named():
    for settings, words in SETTINGS:
        with row(settings), pytest.raises(st.SimulationError, match=words):
            fly(**settings)


TABLE, TIMES = st.TorqueTable, [0, 1]
CONTROLLERS = [
    (lambda: 3.0, r"controller: value 3\.0"),
    *(
        (lambda d=d: st.Damping(d), "damping")
        for d in (-1.0, np.nan, (1, 2), "1", None, [[0] * NT])
    ),
    (lambda: TABLE(TIMES, [[0] * NT]), r"times \(2,\) and torques \(1, 4\)"),
    (lambda: TABLE([], []), "TorqueTable"),
    (lambda: TABLE(0, [0] * NT), "TorqueTable"),
    (lambda: TABLE([1, 1], [[0] * NT] * 2), "increasing times"),
    (lambda: TABLE([0], [[np.nan] * NT]), "value nan"),
    (lambda: TABLE(["0"], [[0] * NT]), r"TorqueTable: times: value \['0'\]"),
    (lambda: TABLE(TIMES, [[0] * NT, [0]]), "TorqueTable: torques: type"),
    (lambda: TABLE([0], [[0] * NT], damping=-1), "damping: value -1"),
    (lambda: st.Phases([]), "one or more"),
    (lambda: st.Phases([(0, None), (0, None)]), "increasing times"),
    (lambda: st.Phases([(0, st.Phases([(0, None)]))]), "one list"),
    (lambda: st.Phases(3), "needs pairs"),
    (lambda: st.Phases([(0, 3)]), "controller: value 3"),
    (lambda: Path("nowhere"), "controller: value PosixPath"),  # has parts
    (lambda: st.TorqueCurve(3), "Piecewise of 4 channels"),
    (lambda: st.NativeTorque("f"), "ctypes function or an address"),
    (lambda: st.Sampled(None, 100.0), "function: value None"),
    (lambda: st.Sampled(len, 0.0), "rate: value 0.0"),
    (lambda: st.Sampled(len, 100.0, -1.0), "delay: value -1.0"),
    (lambda: st.Reference(TIMES, [[0] * 4] * 2, "cubic"), "blend: value 'cubic'.*'quintic'"),
    (lambda: st.Reference([1, 0], [[0] * 4] * 2), "increasing times"),
    (lambda: st.Reference([0], [[0] * 4]), "one node only"),
    (lambda: st.Pfl(tail(), st.Reference(TIMES, [[0] * 2] * 2)), "2 angles, the tail 4"),
]


def test_a_wrong_controller_is_named():
    for make, words in CONTROLLERS:
        with row(words), pytest.raises(st.SimulationError, match=words):
            fly(controller=make())


def test_functions_left_out_are_named_before_the_flight():
    q, v, law = np.eye(1, 9, 3)[0], np.zeros(8), lambda *_: pytest.fail("was called")
    with pytest.raises(st.ModelError, match=r"bare .*'rollout'.*'energy'.*'momentum'"):
        st.simulate(zoo.model("bare"), q, v, controller=law)


PUSH = st.TorqueTable([0], [[1e6] * NT])
COARSE = {"step": 0.05, "output_step": 0.05}
DIVERGING = {
    "table": (V0, {"controller": PUSH} | COARSE),
    "function": (V0, {"controller": lambda t, q, v: [1e6] * NT} | COARSE),
    "dop853": (V0, {"controller": st.TorqueTable([0], [[1e300] * NT]), "method": "dop853"}),
    "dop853 at once": (V0 * 1e160, {"method": "dop853"}),
    "auto at once": (V0 * 1e160, {}),
}


def test_a_diverging_run_names_the_time():
    for name, (start, settings) in DIVERGING.items():
        with row(name), warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(st.SimulationError, match=r"^at t = 5(\.\d+)? s ") as caught:
                st.simulate(tail(), Q0, start, **{"t_span": (5, 6)} | settings)
            assert caught.value.__cause__ is None


def test_degrees_are_told_where_they_are_given():
    """At the start, in one row or in one of several, and in bends."""
    upright, v = np.eye(1, NQ, 3)[0], np.zeros(NV)
    q = upright + 30 * np.eye(1, NQ, 8)[0]
    words = r"q0\[{}8\]: value 30 rad: .*np\.radians\(30\)"
    with pytest.warns(st.UnusualSize, match=words.format("")) as caught:
        st.simulate(tail(), q, v, t_span=1e-3)
    with pytest.warns(st.UnusualSize, match=words.format(r"1\]\[")) as again:
        st.simulate(tail(), [upright, q], v, t_span=1e-3)
    assert {each.filename for each in (*caught, *again)} == {__file__}
    words, bends = r"bends{}: value 90 rad: .*radians\(90\)", np.zeros((2, 2, 2))
    bends[1, 0, 0] = 90
    for given, place in ((bends[:, 0], r"\[1\]\[0\]"), (bends, r"\[1\]\[0\]\[0\]")):
        with pytest.warns(st.UnusualSize, match=words.format(place)) as caught:
            st.Reference.of_bends(tail(), [0, 0.3], given)
        assert [each.filename for each in caught] == [__file__]


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


@pytest.mark.parametrize("method", ["tsit5", "rk4", "dop853", "lsoda"])
def test_what_a_function_raises_ends_all_but_a_simulation_error_its_run(method):
    q, v = starts(tail(), 3)
    q[1, 0] = 50.0
    calls, threads = [], set()

    def law(error, begin=0.005):
        def torque(t, q, v):
            calls.append(t)
            threads.add(threading.current_thread())
            if q[0] > 40 and t > begin:
                raise error
            return [0.0] * NT

        return torque

    settings = {"t_span": 0.01, "output_step": 1e-3, "method": method}
    with pytest.raises(KeyError, match="mine"):
        st.simulate(tail(), q, v, controller=law(KeyError("mine")), **settings)
    found = st.simulate(tail(), q, v, controller=law(st.SimulationError("mine")), **settings)
    assert [str(error) for error in found.errors] == ["None", "mine", "None"]
    assert found.info["threads"] == 1 and threads == {threading.current_thread()}
    assert len(found.errors[1].trajectory.t) > 2
    calls.clear()
    with pytest.raises(KeyError):
        st.simulate(tail(), q[1:], v[1:], controller=law(KeyError("mine"), -1), **settings)
    assert len(calls) == 1


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
    ({"torso_inertia": [[1, 1, x] for x in (1, 3, 1, 1)]}, r"torso_inertia of run 1: value \[1.0"),
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
    how = {"t_span": 0.01, "output_step": 1e-3}
    same(st.simulate(baked, q, v, parameters={}, **how), alone(baked, q, v, **how))


@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnusualSize")
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
    for wrong in (q, (q[0], v[0])):
        with pytest.raises(st.StateError, match="one start state after another"):
            st.settle(rat(), wrong, legs=LEGS)
