"""Integration methods: coefficients fulfil their order conditions, and the generated loops keep
what these promise.
"""

import inspect
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import serpentail as st

from .trees_and_flights import fly, model

# What ends a run early keeps the motion up to there.


def push(t, q, v):
    return 1e-3 * v[6:]


def test_failed_run_keeps_its_trajectory():
    with pytest.raises(st.SimulationError, match=r"^at t = 0.*: is the ") as caught:
        fly(controller=push, t_span=10, output_step=1e-4, method="rk4", step=1e-4)
    kept = caught.value.trajectory
    assert 10 < len(kept.t) < 10_001 and kept.t[0] == 0 and np.isfinite(kept.q).all()


def test_steps_that_do_not_suffice_are_told():
    with pytest.raises(st.SimulationError, match="most_steps were not enough") as caught:
        fly(most_steps=5, output_step=1e-4)
    assert caught.value.trajectory.t[-1] < 0.2
    with pytest.raises(st.SimulationError, match="steps that are too short"):
        fly(rtol=1e-10, least_step=0.01)


def test_an_interrupted_motion_says_so():
    def law(t, q, v):
        if t > 0.1:
            raise KeyboardInterrupt
        return np.zeros(4)

    with pytest.raises(KeyboardInterrupt) as caught:
        fly(controller=law)
    assert repr(caught.value.motion).endswith("failed: interrupted>")


def test_signatures_are_short():
    assert "q0: 'ArrayLike', v0: 'ArrayLike'" in str(inspect.signature(st.simulate))


def test_a_torque_that_is_far_too_large_is_told():
    def law(t, q, v):
        return [5.0, 0, 0, 0]

    words = r"not enough.* Torques reach 5 N m, and a joint \S+ rad/s: is a torque far too large\?$"
    with pytest.raises(st.SimulationError, match=words) as caught:
        fly(controller=law, most_steps=2000)
    assert float(str(caught.value).split("a joint ")[1].split()[0]) > 1000


def test_degrees_at_the_start_are_told():
    """In one row or in one of several."""
    q, v = np.eye(1, model().nq, 3)[0], np.zeros(model().nv)
    upright = q.copy()
    words = r"q0\[{}8\]: value 30 rad: .* did you mean np\.radians\(30\)\?"
    q[8] = 30.0
    with pytest.warns(st.UnusualSize, match=words.format("")) as caught:
        st.simulate(model(), q, v, t_span=1e-3)
    with pytest.warns(st.UnusualSize, match=words.format(r"1\]\[")):
        st.simulate(model(), [upright, q], v, t_span=1e-3)
    assert {each.filename for each in caught} == {__file__}


@pytest.mark.parametrize("shape", [(2,), (2, 2)])
def test_bends_in_degrees_are_told(shape):
    bends = np.zeros((2, *shape))
    bends[1].flat[0] = 90
    place = r"\[1\]\[0\]" + r"\[0\]" * (len(shape) - 1)
    with pytest.warns(
        st.UnusualSize, match=rf"bends{place}: value 90 rad: .*radians\(90\)"
    ) as caught:
        st.Reference.of_bends(model(), [0, 0.3], bends)
    assert [each.filename for each in caught] == [__file__]


def test_exception_in_a_function_is_itself():
    def law(t, q, v):
        if t > 0.1:
            raise KeyError("mine")
        return np.zeros(4)

    with pytest.raises(KeyError, match="mine"):
        fly(controller=law)


def test_interrupt_ends_a_long_run():
    """Ctrl-C is heard though no Python runs in the loop."""
    script = (
        "import sys, serpentail as st\nm = st.load(sys.argv[1])\nq = [0, 0, 0, 1] + [0] * (m.nq - "
        "4)\n"
        "print('ready', flush=True)\n"
        "st.simulate(m, q, [1.0] * m.nv, t_span=1e3, output_step=1e2, method='rk4', step=1e-5)"
    )
    command = [sys.executable, "-c", script, str(model().folder)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stdout.readline() == "ready\n"
    time.sleep(0.5)
    os.kill(run.pid, signal.SIGINT)
    _, errors = run.communicate(timeout=20)
    assert run.returncode != 0 and "KeyboardInterrupt" in errors


@pytest.mark.parametrize(
    ("controller", "words"),
    [
        (lambda: st.Phases([]), "needs one or more"),
        (lambda: st.Phases([(0, None), (0, None)]), "needs one or more increasing times"),
        (lambda: st.Phases([(1, None), (0, None)]), "needs one or more increasing times"),
        (lambda: st.Phases([(0, st.Phases([(0, None)]))]), "put all pairs in one list"),
        (lambda: st.Phases(3), "needs pairs"),
        (lambda: st.Phases([(0, 3)]), "controller: value 3: needs"),
        (lambda: Path("nowhere"), "controller: value PosixPath('nowhere'): needs"),  # has parts
        (lambda: st.TorqueCurve(3), "needs a Piecewise of 4 channels"),
        (lambda: st.NativeTorque("f"), "needs a ctypes function or an address"),
        (
            lambda: st.Reference([0, 1], [[0] * 4] * 2, "cubic"),
            "blend: value 'cubic': needs 'linear' or 'quintic' or 'spline'",
        ),
        (lambda: st.Reference([1, 0], [[0] * 4] * 2), "needs increasing times"),
        (lambda: st.Reference([0], [[0] * 4]), "one node only"),
        (lambda: st.Pfl(model(), st.Reference([0, 1], [[0] * 2] * 2)), "has 2 angles, the tail 4"),
    ],
)
def test_misuse_is_named(controller, words):
    with pytest.raises(st.SimulationError) as caught:
        fly(controller=controller())
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["legs", "bristles0", "stop_at"])
def test_flight_has_no_ground(name):
    with pytest.raises(
        st.SimulationError, match=f"^{name} .* has no contacts: leave it out, or add `contacts`"
    ):
        fly(**{name: [1]})


# Functions of time.


def test_quintic_blends_rest_at_nodes():
    curve = st.Reference([0.0, 0.5, 0.7, 1.0], [[0.0], [1.0], [1.0], [-2.0]]).curve
    values, rates, accelerations = curve.at(np.array([-1.0, 0.0, 0.5, 0.6, 0.7, 1.0, 3.0]))
    np.testing.assert_allclose(values[:, 0], [0, 0, 1, 1, 1, -2, -2], atol=1e-14)
    np.testing.assert_allclose([rates, accelerations], 0, atol=1e-12)
    s = 0.3
    value, rate, acceleration = (x[0] for x in curve.at(0.5 * s))
    assert value == pytest.approx(10 * s**3 - 15 * s**4 + 6 * s**5)
    assert rate == pytest.approx((30 * s**2 - 60 * s**3 + 30 * s**4) / 0.5)
    assert acceleration == pytest.approx((60 * s - 180 * s**2 + 120 * s**3) / 0.25)
    assert curve.kinks(3).size == 0


def test_only_jumps_and_kinks_are_stops():
    table = st.TorqueTable([0, 1, 2, 3], [[0.0], [1.0], [2.0], [0.0]])
    assert table.parts(1).kinks() == [0, 2, 3]
    assert st.Reference([0, 1, 2], [[0.0], [1], [0]], "spline").curve.kinks(2).tolist() == [0, 2]
    jump = st.Piecewise(np.array([0.0, 1, 2]), np.array([[[0.0, 0]], [[1.0, 0]]]))
    assert jump.kinks(1).tolist() == [1]


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_what_is_a_kink_hangs_on_no_unit(size):
    table = st.TorqueTable([0, 1, 2, 3], size * np.array([[0.0], [1.0], [2.0], [0.0]]))
    assert table.parts(1).kinks() == [0, 2, 3]
    rounding = size * np.array([[[1.0, 0]], [[1.0 + 1e-12, 0]]])
    assert st.Piecewise(np.array([0.0, 1, 2]), rounding).kinks(1).size == 0
