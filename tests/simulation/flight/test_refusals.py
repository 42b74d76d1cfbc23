"""What a single run refuses: starts, settings, controllers; and what it warns of."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

from ..runs import NQ, NT, NV, Q0, V0, fly, tail

STARTS = [
    ((Q0[:-1], V0), rf"q0 .*\({NQ - 1},\).*\({NQ},\)"),
    ((Q0, [*V0, 0]), rf"v0 .*\({NV + 1},\).*\({NV},\)"),
    (([[Q0]], V0), r"q0 .*\(1, 1, \d+\)"),
    ((0.0, V0), r"q0 .*\(\)"),
    ((None, V0), "q0: type"),
    (([[1], [1, 2]], V0), "q0: type"),
    (([str(x) for x in Q0], V0), "q0: type"),
    ((Q0, V0.astype(complex)), "v0: type"),
    ((Q0, V0 > 0), "v0: type"),
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
    ({"method": "dop853", "step": 1}, "dop853 .*'step'.*rtol, atol, output_step"),
    ({"stp": 1}, "'stp'"),
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
        for d in (-1.0, np.nan, (1, 2), "1", None, [[0.0] * NT])
    ),
    (lambda: TABLE(TIMES, [[0] * NT]), r"times \(2,\) and torques \(1, 4\)"),
    (lambda: TABLE([], []), "TorqueTable"),
    (lambda: TABLE(0, [0] * NT), "TorqueTable"),
    (lambda: TABLE([1, 1], [[0] * NT] * 2), "increasing times"),
    (lambda: TABLE([0], [[np.nan] * NT]), "value nan"),
    (lambda: TABLE(["0"], [[0] * NT]), "TorqueTable: times: type"),
    (lambda: TABLE(TIMES, [[0] * NT, [0]]), "TorqueTable: torques: type"),
    (lambda: TABLE([0], [[0] * NT], damping=-1), "damping: value -1"),
    (lambda: st.Phases([]), "one or more"),
    (lambda: st.Phases([(0, None), (0, None)]), "increasing times"),
    (lambda: st.Phases([(1, None), (0, None)]), "increasing times"),
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
    "feedback": (V0, {"controller": lambda t, q, v: 1e3 * v[6:]} | COARSE),
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
    for bends, place in (
        ([[0, 0], [90, 0]], ""),
        ([np.zeros((2, 2)), [[90, 0], [0, 0]]], r"\[0\]"),
    ):
        words = rf"bends\[1\]\[0\]{place}: value 90 rad: .*radians\(90\)"
        with pytest.warns(st.UnusualSize, match=words) as caught:
            st.Reference.of_bends(tail(), [0, 0.3], bends)
        assert [each.filename for each in caught] == [__file__]
