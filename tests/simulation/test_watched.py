"""A run that is watched: its samples come in order, each once, and it is what it is unwatched."""

import time

import numpy as np
import pytest

import serpentail as st
from serpentail.simulation import compiled_run, watched
from tests.support.models import model_folder

from .rollouts.many import alone, rat, starts, tail

ARRAYS = ("t", "q", "v", "tau", "kinetic", "potential", "linear_momentum", "angular_momentum")
METHODS = ["tsit5", "ros34pw2", "rk4", "implicit_euler", "dop853", "lsoda"]
LEGS = st.Legs.fixed(3.6, -0.3)


@pytest.fixture(autouse=True)
def at_every_look(monkeypatch):
    monkeypatch.setattr(watched, "EVERY", 0.0)
    monkeypatch.setattr(compiled_run, "PAUSE", 10)  # steps to the first


def joined(parts, name):
    return np.concatenate([getattr(part, name) for part in parts])


def start(model):
    q, v = starts(model, 1)
    return q[0], v[0]


@pytest.mark.parametrize("method", METHODS)
def test_each_sample_comes_once_and_nothing_changes(method):
    model, parts = tail(), []
    settings = {
        "controller": st.Damping(1e-6),
        "t_span": 3.0,
        "method": method,
        "output_step": 0.01,
    }
    motion = st.simulate(model, *start(model), watch=parts.append, **settings)
    (unwatched,) = alone(model, *([each] for each in start(model)), **settings)
    for name in ARRAYS:
        assert np.array_equal(joined(parts, name), getattr(motion, name)), name
        assert np.array_equal(getattr(unwatched, name), getattr(motion, name)), name
    assert len(parts) > 1 and all(part.model is model for part in parts)
    assert all("imbalance" not in part.info for part in parts) and "imbalance" in motion.info


@pytest.mark.parametrize("controller", [None, lambda t, q, v: [0.0, 0.0]])
def test_on_the_ground_contacts_come_too(controller):
    parts = []
    q = [0, 0, 0.05, 1, 0, 0, 0, 0.1, 0]
    settings = {"legs": LEGS, "t_span": 0.2, "rtol": 1e-6, "controller": controller}
    motion = st.simulate(rat(), q, np.zeros(8), watch=parts.append, **settings)
    for name in ("points", "forces", "bristles", "legs"):
        told = np.concatenate([getattr(part.contact, name) for part in parts])
        assert np.array_equal(told, getattr(motion.contact, name))
    assert len(parts) > 1


def test_a_stop_at_an_event_is_the_last_sample():
    parts = []
    q = [0, 0, 0.06, 1, 0, 0, 0, 0.1, 0]
    settings = {"legs": LEGS, "stop_at": [("touch_down", "feet")], "output_step": 0.01}
    motion = st.simulate(rat(), q, np.zeros(8), watch=parts.append, **settings)
    assert motion.t[-1] < 1 and joined(parts, "t").tolist() == motion.t.tolist()


@pytest.mark.parametrize("method", ["tsit5", "dop853"])
def test_a_run_that_fails_is_told_up_to_there(method):
    def tired(t, q, v):
        if t > 0.1:
            raise st.SimulationError("it is tired")
        return np.zeros(4)

    parts, model = [], tail()
    with pytest.raises(st.SimulationError, match="it is tired") as caught:
        st.simulate(model, *start(model), controller=tired, method=method, watch=parts.append)
    assert joined(parts, "t").tolist() == caught.value.trajectory.t.tolist()
    assert not any("failure" in part.info for part in parts)


@pytest.mark.parametrize("method", ["rk4", "dop853"])
def test_what_it_raises_ends_the_run(method):
    def refuse(part):
        raise ArithmeticError("no more")

    with pytest.raises(ArithmeticError, match="no more"):
        st.simulate(tail(), *start(tail()), t_span=1.0, method=method, watch=refuse)


def test_ctrl_c_in_it_keeps_the_motion():
    def stop(part):
        if part.t[-1] > 0.05:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        st.simulate(tail(), *start(tail()), t_span=50.0, method="rk4", watch=stop, output_step=0.01)
    assert 0.05 < caught.value.motion.t[-1] < 50


def test_it_is_called_ten_times_a_second_at_most(monkeypatch):
    monkeypatch.setattr(watched, "EVERY", 0.1)
    calls, begun = [], time.perf_counter()

    def note(part):
        calls.append(time.perf_counter())

    settings = {"t_span": 6.0, "method": "rk4", "step": 1e-5, "output_step": 0.01}
    st.simulate(tail(), *start(tail()), watch=note, **settings)
    between = np.diff([*calls[:-1]])  # the last is at the end
    assert calls[0] - begun < 0.5 and len(calls) > 2 and between.min() >= 0.1


@pytest.mark.parametrize("watch", [3, "print"])
def test_what_cannot_be_called_is_refused(watch):
    with pytest.raises(st.SimulationError, match=r"watch: value .*: needs a function"):
        st.simulate(tail(), *start(tail()), watch=watch)


def test_many_starts_are_not_watched():
    with pytest.raises(st.SimulationError, match="watch: many starts are not watched"):
        st.simulate(tail(), *starts(tail(), 2), watch=print)


def test_a_scenes_motion_can_be_watched():
    model = st.load(model_folder(1, 1, functions=["energy", "momentum", "rollout"]))
    q = [0, 0, 0, 1, 0, 0, 0, 0, 0]
    parts = []
    st.Scenario(model, np.array(q, float), np.zeros(8), 0.1).simulate(watch=parts.append)
    assert parts[-1].t[-1] == 0.1
