"""Rollouts: many runs at once give what each gives alone, bit for bit, its error too, in any order,
on any core.
"""

import ctypes
import signal
import threading
import time

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import batched_runs, parallel_runs

from .many import NT, NV, PER_RUN, starts, tail

# Failures.

PUSHED = {
    "t_span": (5, 6),
    "controller": st.TorqueTable([5.0], [[1e-4] * NT]),
    "output_step": 0.05,
    "method": "tsit5",
}


@pytest.mark.parametrize("threads", [1, 3])
def test_a_run_that_fails_loses_no_other(threads):
    q, v = starts(tail(), 5)
    v[2] *= 1e160  # overflows at once
    v[4] *= 100  # takes too many steps
    settings = PUSHED | {"most_steps": 600}
    found = st.simulate(tail(), q, v, threads=threads, **settings)
    for k in range(5):
        try:
            flight = st.simulate(tail(), q[k], v[k], **settings)
        except st.SimulationError as error:
            own = found.errors[k]
            assert str(own) == str(error) and isinstance(own, st.SimulationError)
            with pytest.raises(st.SimulationError) as caught:
                found[k]
            assert caught.value is own
            flight, rows = (
                error.trajectory,
                0 if error.trajectory is None else len(error.trajectory.t),
            )
            assert (own.trajectory is None) == (flight is None)
            assert rows or np.isnan(found.kinetic[k]).all()
        else:
            assert found.errors[k] is None
            rows = len(flight.t)
        for name in PER_RUN:
            array = getattr(found, name)[k]
            assert np.isnan(array[max(rows, 1) :]).all()
            if rows:
                np.testing.assert_array_equal(array[:rows], getattr(flight, name))
    assert [error is None for error in found.errors] == [True, True, False, True, False]
    assert "most_steps" in str(found.errors[4]) and len(found.errors[4].trajectory.t) > 1
    assert 5 < found.ends[4] < 6 and found.ends[0] == 6


def test_an_energy_beyond_numbers_is_its_runs_error():
    q, v = starts(tail(), 3)
    v[1] = [1e200] + [0] * (NV - 1)
    found = st.simulate(tail(), q, v, t_span=0.5, output_step=0.1, step=0.1)
    assert "energy: the result of state 0 is not finite" in str(found.errors[1])
    assert np.isnan(found.kinetic[1]).all() and np.isfinite(found.kinetic[[0, 2]]).all()


def test_a_function_of_python_runs_in_the_calling_thread():
    q, v = starts(tail(), 4)
    threads = set()

    def law(t, q, v):
        threads.add(threading.current_thread())
        return [0.0] * NT

    assert st.simulate(tail(), q, v, t_span=0.01, controller=law).info["threads"] == 1
    assert threads == {threading.current_thread()}


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
def test_what_a_function_raises_ends_all_but_a_simulation_error_its_run(method):
    q, v = starts(tail(), 3)
    q[1, 0] = 50.0

    def law(error):
        def torque(t, q, v):
            if q[0] > 40 and t > 0.005:
                raise error
            return [0.0] * NT

        return torque

    settings = {"t_span": 0.01, "output_step": 1e-3, "method": method}
    with pytest.raises(KeyError, match="mine"):
        st.simulate(tail(), q, v, controller=law(KeyError("mine")), **settings)
    found = st.simulate(tail(), q, v, controller=law(st.SimulationError("mine")), **settings)
    assert [str(error) for error in found.errors] == ["None", "mine", "None"]
    assert len(found.errors[1].trajectory.t) > 2


@pytest.mark.parametrize("threads", [1, 2])
def test_a_compiled_torque_that_refuses_ends_its_run(threads):
    real = ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, real, real, real)
    def torque(_context, t, q, _v, _tau):
        return int(q[0] > 40 and t > 0.005)

    q, v = starts(tail(), 3)
    q[1, 0] = 50.0
    law = st.NativeTorque(torque)
    found = st.simulate(tail(), q, v, t_span=0.01, controller=law, method="tsit5", threads=threads)
    assert [error is None for error in found.errors] == [True, False, True]
    assert "the compiled torque function returned an error status" in str(found.errors[1])


@pytest.mark.parametrize("abreast", [True, False], ids=["abreast", "alone"])
def test_ctrl_c_ends_all_threads_within_a_second(monkeypatch, abreast):
    monkeypatch.setattr(parallel_runs, "worth_batching", lambda *_: abreast)
    monkeypatch.setattr(batched_runs, "MAX_SHARED_STEPS", 10**12)
    q, v = starts(tail(), 50)
    tail().batch_library.rollouts.function(
        "tail_side_by_side_flights"
    )  # compiled before the clock runs
    before, asked = threading.active_count(), []

    def ask():
        asked.append(time.monotonic())
        signal.raise_signal(signal.SIGINT)

    timer = threading.Timer(1.5, ask)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        st.simulate(tail(), q, v, t_span=20, step=1e-5, method="rk4", output_step=20, threads=2)
    assert time.monotonic() - asked[0] < 1
    timer.join()
    assert threading.active_count() == before
