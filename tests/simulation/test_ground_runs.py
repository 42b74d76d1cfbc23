"""Runs on the ground that are paused or stopped in between go on, and end, as they were."""

import time

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import compiled_run

from .test_ground import kick, rat


def test_where_a_run_stops_its_friction_springs_are_told():
    """An implicit step from there is the run's own: with the bristles of the start it is not."""
    stopped = kick(rtol=1e-6, stop_at=[("take_off", "feet")], output_step=1e-3)
    bristles = stopped.contact.bristles
    change = np.abs(np.diff(bristles, axis=0)).max(axis=(1, 2))
    assert np.abs(bristles[-1] - bristles[0]).max() > 10 * change[-1]
    assert change[-1] <= 2 * change[-10:-1].max()


@pytest.mark.parametrize(
    "settings",
    [{"method": "ros34pw2"}, {"method": "tsit5"}, {"method": "implicit_euler", "step": 1e-3}],
    ids=lambda settings: settings["method"],
)
def test_a_run_that_is_paused_after_each_few_steps_gives_the_same_bits(settings, monkeypatch):
    settings = settings | {"t_span": 0.5, "output_step": 0.01}
    whole = kick(**settings)
    monkeypatch.setattr(compiled_run, "PAUSE", 3)
    paused = kick(**settings)
    for name in ("q", "v", "tau", "kinetic"):
        np.testing.assert_array_equal(getattr(paused, name), getattr(whole, name))
    np.testing.assert_array_equal(paused.contact.bristles, whole.contact.bristles)
    assert paused.events == whole.events and paused.info["steps"] == whole.info["steps"]


@pytest.mark.parametrize("output_step", [0.1, 1e-2, 1e-3])
def test_a_run_that_stops_has_all_samples_before(output_step):
    stopped = kick(stop_at=[("touch_down", "feet")], t_span=1.2, output_step=output_step)
    times = np.linspace(0, 1.2, round(1.2 / output_step) + 1)
    np.testing.assert_allclose(stopped.t[:-1], times[times < stopped.t[-1]], rtol=0, atol=1e-12)


def test_times_that_a_run_took_are_told():
    begun = time.perf_counter(), time.process_time()
    info = kick(t_span=0.1).info
    assert 0 < info["seconds"] <= time.perf_counter() - begun[0]
    assert 0 <= info["cpu_seconds"] <= time.process_time() - begun[1]


@pytest.mark.parametrize("begin", [1e-160, 1e-180, 1e-300, 5e-324])
@pytest.mark.parametrize("method", ["tsit5", "ros34pw2", "rk4"])
def test_a_step_may_be_so_short_that_its_square_is_zero(begin, method):
    """A phase that begins after next to no time: the first step ends there."""
    model = rat("feet")
    q, v = np.zeros(model.nq), np.full(model.nv, 0.1)
    q[2:4] = 0.3, 1.0
    how = {"t_span": 2e-3, "legs": st.Legs.fixed(3.6, -0.3), "method": method}
    phases = st.Phases([(0.0, st.Damping(1e-3)), (begin, None)])
    found = st.simulate(model, q, v, controller=phases, **how)
    assert found.events == [] and found.info["steps"] < 300
    plain = st.simulate(model, q, v, **how)
    np.testing.assert_allclose(found.q, plain.q, rtol=0, atol=1e-12)
