"""Flight: what mechanics conserves stays, what damping takes is accounted for, and torque laws act
as written.
"""

import warnings

import numpy as np
import pytest

import serpentail as st

from ...support.models import model_folder
from .thrown import NQ, NT, NV, Q0, V0

# What is refused


LAST = [*Q0[:-1], np.nan]


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ((Q0[:-1], V0), rf"q0 has shape \({NQ - 1},\), not \({NQ},\)"),
        ((Q0, [*V0, 0]), rf"v0 has shape \({NV + 1},\), not \({NV},\)"),
        (([[Q0]], V0), r"q0 has shape \(1, 1, \d+\).*one start state"),
        ((0.0, V0), r"q0 has shape \(\)"),
        ((None, V0), "q0: type .*: needs real numbers"),
        (([[1], [1, 2]], V0), "q0: type .*: needs real numbers"),
        (([str(x) for x in Q0], V0), "q0: type .*: needs real numbers"),
        ((Q0, V0.astype(complex)), "v0: type .*: needs real numbers"),
        ((Q0, V0 > 0), "v0: type .*: needs real numbers"),
        ((LAST, V0), rf"q0\[{NQ - 1}\]: value .*: needs a finite number"),
        ((Q0, [np.inf, *V0[1:]]), r"v0\[0\]: value .*: needs a finite number"),
        ((np.zeros(NQ), V0), r"q0\[3:7\] is the zero quaternion: upright is \(1, 0, 0, 0\)"),
    ],
)
def test_wrong_start_is_named(model, start, words):
    with pytest.raises(st.StateError, match=words):
        st.simulate(model, *start)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        *[
            ({"t_span": span}, "t_span")
            for span in (0, -1, (1, 1), (2, 1), (0, np.nan), (0, np.inf), (0, 1, 2), "1")
        ],
        *[
            ({"t_span": span}, "t_span")
            for span in (None, (), [[0], [1]], ("0", "1"), (0, None), True, (0, 1j))
        ],
        *[
            ({name: x}, name)
            for name in ("step", "output_step")
            for x in (0, -1e-3, np.nan, np.inf, "1", True, [1], 1j)
        ],
        *[({"method": "dop853", name: 0}, name) for name in ("rtol", "atol")],
        (
            {"method": "euler"},
            "method: value 'euler': needs 'auto' or 'rk4' or 'tsit5' or 'dop853' or 'lsoda'",
        ),
        ({"gravity": 1.6}, r"gravity: .*simulate model\.with_parameters\(gravity=1\.6\)"),
        ({"duration": 1}, "duration: is no setting: the duration is t_span=1"),
        ({"method": "rk4", "rtol": 1e-6}, "rk4 has no setting 'rtol'; it has step, output_step"),
        ({"step": 1e-6, "rtol": 1e-6}, "rk4 has no setting 'rtol'; it has step, output_step"),
        (
            {"method": "dop853", "step": 1},
            "dop853 has no setting 'step'; it has rtol, atol, output_step",
        ),
        ({"stp": 1}, "no setting 'stp'"),
        (
            {"controller": 3.0},
            "controller: value 3.0: needs None, Damping, TorqueTable, .* or a function",
        ),
        *[
            ({"controller": st.Damping(d)}, "damping")
            for d in (-1.0, np.nan, (1, 2), "1", None, [[0.0] * NT])
        ],
        (
            {"controller": st.TorqueTable([0, 1], [[0] * NT])},
            r"times \(2,\) and torques \(1, 4\), not \(K,\) and \(K, 4",
        ),
        ({"controller": st.TorqueTable([], [])}, "TorqueTable"),
        ({"controller": st.TorqueTable(0, [0] * NT)}, "TorqueTable"),
        ({"controller": st.TorqueTable([1, 1], [[0] * NT] * 2)}, "needs increasing times"),
        (
            {"controller": st.TorqueTable([0], [[np.nan] * NT])},
            r"\]: value nan: needs a finite number",
        ),
        (
            {"controller": st.TorqueTable(["0"], [[0] * NT])},
            "TorqueTable: times: type .*: needs real numbers",
        ),
        (
            {"controller": st.TorqueTable([0, 1], [[0] * NT, [0]])},
            "TorqueTable: torques: type .*: needs real numbers",
        ),
        (
            {"controller": st.TorqueTable([0], [[0] * NT], damping=-1)},
            "damping: value -1: needs one or .* numbers from 0",
        ),
    ],
)
def test_wrong_setting_is_named(fly, settings, words):
    with pytest.raises(st.SimulationError, match=words):
        fly(**settings)


@pytest.mark.parametrize("left_out", ["rollout", "energy", "momentum"])
def test_function_left_out_is_named_before_the_flight(left_out):
    wanted = [
        each for each in ("forward_dynamics", "energy", "momentum", "rollout") if each != left_out
    ]
    model = st.load(model_folder(1, 1, name="tail", functions=wanted))
    with pytest.raises(
        st.ModelError, match=f"tail was generated without '{left_out}' .*add it to `functions`"
    ):
        st.simulate(
            model,
            [0, 0, 0, 1, 0, 0, 0, 0, 0],
            [0] * 8,
            controller=lambda *_: pytest.fail("was called"),
        )


# Runs that diverge


PUSH = st.TorqueTable([0], [[1e6] * NT])


@pytest.mark.parametrize(
    ("start", "settings"),
    [
        (V0, {"controller": PUSH, "step": 0.05, "output_step": 0.05}),
        (V0, {"controller": lambda t, q, v: [1e6] * NT, "step": 0.05, "output_step": 0.05}),
        (V0, {"controller": lambda t, q, v: 1e3 * v[6:], "step": 0.05, "output_step": 0.05}),
        (V0, {"controller": st.TorqueTable([0], [[1e300] * NT]), "method": "dop853"}),
        (V0 * 1e160, {"method": "dop853"}),
        (V0 * 1e160, {}),
    ],
    ids=["table", "function", "feedback", "dop853", "dop853 at once", "rk4 at once"],
)
def test_diverging_run_names_the_time(model, start, settings):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(st.SimulationError, match=r"^at t = 5(\.\d+)? s .*: is the ") as caught:
            st.simulate(model, Q0, start, **{"t_span": (5, 6)} | settings)
    assert caught.value.__cause__ is None


def test_energy_beyond_numbers_names_the_sample(model):
    fast = [1e200] + [0] * (NV - 1)
    with pytest.raises(
        st.SimulationError,
        match=r"^from t = 5 s to 5\.5 s, by sample: energy: the result of state 0 is not",
    ):
        st.simulate(model, Q0, fast, t_span=(5, 5.5), step=0.1, output_step=0.1)
