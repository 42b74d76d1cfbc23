"""A run that is watched: its samples come in order, each once, and it is what it is unwatched."""

import time

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import compiled_run, watched
from tests.support.rows import row

from .runs import ARRAYS, Q0, V0, fly, rat, starts, tail

METHODS = ["tsit5", "ros34pw2", "rk4", "implicit_euler", "dop853", "lsoda"]
LEGS = st.Legs.fixed(3.6, -0.3)


@pytest.fixture(autouse=True)
def at_every_look(monkeypatch):
    monkeypatch.setattr(watched, "EVERY", 0.0)
    monkeypatch.setattr(compiled_run, "PAUSE", 10)  # steps to the first


def joined(parts, name):
    return np.concatenate([getattr(part, name) for part in parts])


def test_each_sample_comes_once_and_nothing_changes():
    for method in METHODS:
        parts = []
        how = {"controller": st.Damping(1e-6), "t_span": 1.0, "output_step": 0.01}
        motion = fly(method=method, watch=parts.append, **how)
        unwatched = fly(method=method, **how)
        for name in ARRAYS:
            with row(method, name):
                assert np.array_equal(joined(parts, name), getattr(motion, name))
                assert np.array_equal(getattr(unwatched, name), getattr(motion, name))
        assert len(parts) > 1 and all(part.model is tail() for part in parts)
        assert all("imbalance" not in part.info for part in parts) and "imbalance" in motion.info


def test_on_the_ground_contacts_come_too():
    q = [0, 0, 0.05, 1, 0, 0, 0, 0.1, 0]
    for controller in (None, lambda t, q, v: [0.0, 0.0]):
        parts, how = [], {"legs": LEGS, "t_span": 0.2, "rtol": 1e-6, "controller": controller}
        motion = st.simulate(rat(), q, np.zeros(8), watch=parts.append, **how)
        for name in ("points", "forces", "bristles", "legs"):
            told = np.concatenate([getattr(part.contact, name) for part in parts])
            assert np.array_equal(told, getattr(motion.contact, name)), name
        assert len(parts) > 1


def test_a_stop_at_an_event_is_the_last_sample():
    parts, q = [], [0, 0, 0.06, 1, 0, 0, 0, 0.1, 0]
    how = {"legs": LEGS, "stop_at": [("touch_down", "feet")], "output_step": 0.01}
    motion = st.simulate(rat(), q, np.zeros(8), watch=parts.append, **how)
    assert motion.t[-1] < 1 and joined(parts, "t").tolist() == motion.t.tolist()


def test_a_run_that_fails_is_told_up_to_there():
    def tired(t, q, v):
        if t > 0.1:
            raise st.SimulationError("it is tired")
        return np.zeros(4)

    for method in ("tsit5", "dop853"):
        parts = []
        with pytest.raises(st.SimulationError, match="it is tired") as caught:
            fly(controller=tired, method=method, watch=parts.append)
        assert joined(parts, "t").tolist() == caught.value.trajectory.t.tolist()
        assert not any("failure" in part.info for part in parts)


def test_what_it_raises_ends_the_run_and_ctrl_c_keeps_the_motion():
    def refuse(part):
        raise ArithmeticError("no more")

    def stop(part):
        if part.t[-1] > 0.05:
            raise KeyboardInterrupt

    for method in ("rk4", "dop853"):
        with row(method), pytest.raises(ArithmeticError, match="no more"):
            fly(method=method, watch=refuse)
    with pytest.raises(KeyboardInterrupt) as caught:
        fly(t_span=50.0, method="rk4", watch=stop, output_step=0.01)
    assert 0.05 < caught.value.motion.t[-1] < 50


def test_it_is_called_after_a_pause_at_the_least(monkeypatch):
    monkeypatch.setattr(watched, "EVERY", 0.02)
    calls = []
    how = {"t_span": 1.0, "method": "rk4", "step": 1e-5, "output_step": 0.01}
    fly(watch=lambda part: calls.append(time.perf_counter()), **how)
    between = np.diff(calls[:-1])  # the last is at the end
    assert len(calls) > 2 and between.min() >= 0.02


def test_what_cannot_watch_or_be_watched_is_refused():
    for watch in (3, "print"):
        with row(watch), pytest.raises(st.SimulationError, match=r"watch: value "):
            fly(watch=watch)
    with pytest.raises(st.SimulationError, match="watch: many starts"):
        st.simulate(tail(), *starts(tail(), 2), watch=print)


def test_a_scenes_motion_can_be_watched():
    parts = []
    st.Scenario(tail(), Q0, V0, 0.1).simulate(watch=parts.append)
    assert parts[-1].t[-1] == 0.1
