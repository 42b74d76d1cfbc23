"""What ends a run early keeps its motion; the C tells why by a status; steps end at kinks."""

import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import serpentail as st
from serpentail.model import library
from tests.support import zoo

from ..runs import NT, fly, tail


def test_a_failed_run_keeps_its_trajectory():
    push = {"controller": lambda t, q, v: 1e-3 * v[6:], "method": "rk4", "step": 1e-4}
    with pytest.raises(st.SimulationError, match=r"^at t = 0") as caught:
        fly(t_span=10, output_step=1e-4, **push)
    kept = caught.value.trajectory
    assert 10 < len(kept.t) < 100_001 and kept.t[0] == 0 and np.isfinite(kept.q).all()


def test_steps_that_do_not_suffice_are_told():
    with pytest.raises(st.SimulationError, match="most_steps") as caught:
        fly(most_steps=5, output_step=1e-4)
    assert caught.value.trajectory.t[-1] < 0.2
    with pytest.raises(st.SimulationError, match="too short"):
        fly(rtol=1e-10, least_step=0.01)


def test_a_torque_that_is_far_too_large_is_told():
    words = r"not enough.* 5 N m, and a joint (\S+) rad/s"
    with pytest.raises(st.SimulationError, match=words) as caught:
        fly(controller=lambda t, q, v: [5.0, 0, 0, 0], most_steps=2000)
    assert float(re.search(words, str(caught.value))[1]) > 1000


def test_an_interrupt_ends_a_long_run():
    """Ctrl-C is heard though no Python runs in the loop."""
    script = (
        "import sys, serpentail as st\nm = st.load(sys.argv[1])\n"
        "q = [0, 0, 0, 1] + [0] * (m.nq - 4)\nprint('ready', flush=True)\n"
        "st.simulate(m, q, [1.0] * m.nv, t_span=1e3, output_step=1e2, method='rk4', step=1e-5)"
    )
    command = [sys.executable, "-c", script, str(tail().folder)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stdout.readline() == "ready\n"
    time.sleep(0.5)
    os.kill(run.pid, signal.SIGINT)
    _, errors = run.communicate(timeout=20)
    assert run.returncode != 0 and "KeyboardInterrupt" in errors


KNOWN = ("PAUSED", "STEP_TOO_SMALL", "TOO_MANY_STEPS", "STOPPED_AT_EVENT", "TORQUE_FAILED")
KNOWN += ("STEP_TOO_LONG", "BAD_TIMES")


def statuses(header):
    """Names and numbers of the enumerations that tell how a call or a run stands."""
    found = {}
    for body in re.findall(r"enum \{(.*?)\}", header.read_text(), re.DOTALL):
        if "_OK =" in body or "_PAUSED =" in body:
            found |= dict(re.findall(r"M2_N2_(\w+) = (\d+)", body))
    return {name: int(number) for name, number in found.items()}


def test_statuses_of_the_c_differ_and_the_runtime_knows_them():
    include = zoo.folder("m2_n2") / "include"
    runs = statuses(include / "m2_n2_simulation.h")
    found = statuses(include / "m2_n2.h") | runs
    assert len(runs) == 8 and len(set(found.values())) == len(found) > 9
    assert {name: runs[name] for name in KNOWN} == {n: getattr(library, n) for n in KNOWN}
    assert found["NOT_FINITE"] == library.NOT_FINITE


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


def test_only_jumps_and_kinks_are_stops_in_any_unit():
    rise = np.array([[0.0], [1.0], [2.0], [0.0]])
    for size in (1e-12, 1.0, 1e12):
        assert st.TorqueTable([0, 1, 2, 3], size * rise).parts(1).kinks() == [0, 2, 3], size
        rounding = size * np.array([[[1.0, 0]], [[1.0 + 1e-12, 0]]])
        assert st.Piecewise(np.array([0.0, 1, 2]), rounding).kinks(1).size == 0, size
    assert st.Reference([0, 1, 2], rise[:3] % 2, "spline").curve.kinks(2).tolist() == [0, 2]
    jump = st.Piecewise(np.array([0.0, 1, 2]), np.array([[[0.0, 0]], [[1.0, 0]]]))
    assert jump.kinks(1).tolist() == [1]


def test_phases_act_one_after_another():
    law = st.Phases([(0.0, None), (0.05, st.Damping(3e-5)), (0.15, None)])
    flight = fly(controller=law, output_step=1e-3)
    t, acts = flight.t, np.abs(flight.tau).max(axis=1) > 0
    inside = (t > 0.0505) & (t < 0.1495)
    assert not acts[(t < 0.0495) | (t > 0.1505)].any() and acts[inside].all()
    np.testing.assert_allclose(flight.tau[acts], -3e-5 * flight.v[acts, 6:], rtol=1e-12)


KINKS = st.TorqueTable(
    [0.031, 0.057, 0.093], np.array([[1, -2, 0, 3], [-3, 1, 2, -1], [2, 2, -1, 0]]) * 1e-4
)
EXACT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-14}


def between(t, q, v):
    """The same torques, without a word about kinks."""
    return np.array([np.interp(t, KINKS.times, column) for column in KINKS.torques.T])


def test_kinks_cost_no_accuracy():
    """Steps end at kinks: a table is as accurate as a smooth motion, and so are phases."""
    reference = fly(controller=KINKS, **EXACT)
    phases = st.Phases([(0.0, None), (0.05, st.Damping(2e-5)), (0.1, KINKS)])
    in_phases = fly(controller=phases, **EXACT)

    def error(law, reference):
        return np.abs(fly(controller=law, rtol=1e-9).q - reference.q).max()

    least, blind = error(KINKS, reference), error(between, reference)
    assert least < 3e-8 < blind * 1e3 and least < blind * 3
    assert error(phases, in_phases) < 3e-8


@pytest.mark.parametrize("method", ["rk4", "implicit_euler"])
def test_a_kink_beside_a_sample_takes_no_step_of_its_own(method):
    """What lies between a sample and a kink that rounding sets apart is no full step: the momentum
    of a free fall is M g t, whatever the torques.
    """
    weight = 9.8 * (tail().parameters["torso_mass"] + tail().parameters["tail_mass"])
    for side in (-1, 1):
        kinks = np.nextafter(np.linspace(0, 0.2, 201)[1:-1], side * np.inf)
        torques = 1e-5 * (-1.0) ** np.arange(len(kinks))[:, None] * np.ones(NT)
        table = st.TorqueTable(kinks, torques)
        flight = fly(controller=table, output_step=1e-3, step=1e-4, method=method)
        assert flight.info["steps"] <= 2000 + len(kinks)
        fallen = flight.linear_momentum[0, 2] - flight.linear_momentum[:, 2]
        np.testing.assert_allclose(fallen, weight * flight.t, rtol=0, atol=1e-5 * weight)
