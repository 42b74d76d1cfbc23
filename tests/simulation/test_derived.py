"""What a run tells: its samples while it is watched, and what follows when somebody asks."""

import copy
import dataclasses
import pickle
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import serpentail as st
from serpentail.motion.derived import LATER
from serpentail.motion.trajectory import DERIVED
from serpentail.simulation import callback
from serpentail.simulation.runs import single
from tests.support import zoo
from tests.support.rows import row

from .runs import ARRAYS, DAMPING, LEGS, Q0, V0, fly, rat, tail


def held(motion):
    """Names of the derived fields that a motion has already."""
    return {name for name in DERIVED if name in vars(motion)}


def test_nothing_is_derived_before_it_is_asked_for_and_samples_are_one_s_own():
    motion, other = fly(), fly()
    motion.q, motion.t, motion.attitude, motion.tail, motion.segments  # noqa: B018
    assert held(motion) == set()
    assert motion.kinetic is motion.kinetic and held(motion) == {"kinetic", "potential"}
    assert motion.contact is None and "info" not in held(motion)
    assert motion.info is motion.info
    with pytest.raises(AttributeError):
        motion.nothing  # noqa: B018
    for name in ("t", "q", "v", "tau", "kinetic", "linear_momentum"):
        array = getattr(motion, name)
        assert not array.flags.writeable and array.dtype == np.float64
        assert not np.shares_memory(array, getattr(other, name))


def timeless(info):
    return {k: v for k, v in info.items() if not k.endswith("seconds")}


def test_whatever_is_asked_for_first_and_copies_have_all_fields(tmp_path):
    copies = {
        "file": lambda motion: st.Trajectory.load(motion.save(tmp_path / "motion")),
        "pickle": lambda motion: pickle.loads(pickle.dumps(motion)),
        "copy": copy.copy,
        "deepcopy": copy.deepcopy,
        "replace": dataclasses.replace,
    }
    uses = copies | {
        "resample": lambda motion: motion.resample(motion.t[::2]),
        "summary": lambda motion: st.summary(tail(), motion),
    }
    for name in (*DERIVED, "warnings"):
        uses[name] = lambda motion, name=name: getattr(motion, name)
    whole = dataclasses.replace(fly())
    for first, use in uses.items():
        motion = fly()
        twin = use(motion)
        with row(first):
            assert timeless(motion.info) == timeless(whole.info)
            for name in DERIVED[:4]:
                np.testing.assert_array_equal(getattr(motion, name), getattr(whole, name))
            if first in copies:
                assert held(twin) == {*DERIVED} and LATER not in vars(twin)
                assert twin.info == motion.info and twin.contact is None
                for name in ARRAYS:
                    one, other = getattr(twin, name), getattr(motion, name)
                    assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())


def test_a_run_tells_how_long_it_took():
    begun = time.perf_counter(), time.process_time()
    info = fly().info
    whole = time.perf_counter() - begun[0], time.process_time() - begun[1]
    for name, most in zip(("seconds", "cpu_seconds"), whole, strict=True):
        assert 0 < info[name] <= most, name


def test_threads_that_ask_at_once_get_one_array():
    motion, together = fly(), threading.Barrier(8)

    def ask(_):
        together.wait()
        return motion.kinetic, motion.info

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(ask, range(8)))
    assert all(kinetic is motion.kinetic and info is motion.info for kinetic, info in found)


@pytest.mark.parametrize(("name", "fast"), [("m2_n2", 1e160), ("single", 1e25)])
def test_what_no_number_may_hold_is_told_at_once(name, fast):
    """An energy beyond the largest number ends the run, as before, and is no surprise later."""
    one, how = zoo.model(name), {"t_span": 1e-3, "method": "rk4"}
    q0, v0 = np.eye(1, one.nq, 3)[0], np.zeros(one.nv)
    v0[0] = fast
    words = r"^from t = 0 s to 0\.001 s, by sample: energy: .*state 0"
    with pytest.raises(st.SimulationError, match=words):
        st.simulate(one, q0, v0, **how)
    v0[0] = fast**0.3  # held, but not beyond doubt
    motion = st.simulate(one, q0, v0, **how)
    assert held(motion) == {*DERIVED} and np.isfinite(motion.kinetic).all()
    v0 = np.outer([0, fast, fast**0.625], np.eye(1, one.nv))
    runs = st.simulate(one, q0, v0, **how)
    assert [error is None for error in runs.errors] == [True, False, True]
    assert "by sample: energy:" in str(runs.errors[1])
    assert np.isfinite(runs.kinetic[[0, 2]]).all() and np.isnan(runs.kinetic[1]).all()
    assert held(runs[2]) == {*DERIVED} and held(runs[0]) == set()


@pytest.mark.parametrize("name", ["m2_n2", "single"])
def test_many_runs_are_measured_when_somebody_asks(name):
    one = zoo.model(name)
    q0 = np.tile([0, 0, 1.0, 1, 0, 0, 0, 0.3, -0.2, 0.1, 0.2], (5, 1))
    how = {"t_span": 0.1, "parameters": {"tail_mass": np.linspace(0.004, 0.006, 5)}}
    eps = float(np.finfo(np.float32 if name == "single" else float).eps)
    for threads in (1, 3):
        runs = st.simulate(one, q0, np.ones(one.nv), threads=threads, **how)
        assert not {*DERIVED} & {*vars(runs)} - {"info"} and runs.errors == [None] * 5
        for k in range(5):
            motion = runs[k]
            assert held(motion) == set()
            for field in DERIVED[:4]:
                found = getattr(runs, field)
                assert found is getattr(runs, field) and not found.flags.writeable
                np.testing.assert_array_equal(found[k], getattr(motion, field))
            left = pytest.approx(runs.audit.relative[k], abs=eps)  # in sums of another order
            assert motion.info["imbalance"]["relative"] == left
        twin = pickle.loads(pickle.dumps(runs))
        np.testing.assert_array_equal(twin.kinetic, runs.kinetic)


METHODS = ["tsit5", "dp8", "ros34pw2", "rk4", "implicit_euler", "dop853", "lsoda"]


@pytest.fixture(autouse=True)
def at_every_look(monkeypatch):
    monkeypatch.setattr(callback, "EVERY", 0.0)
    monkeypatch.setattr(single, "PAUSE", 10)  # steps to the first


def joined(parts, name):
    return np.concatenate([getattr(part, name) for part in parts])


def test_each_sample_comes_once_and_nothing_changes():
    parts = []
    st.Scenario(tail(), Q0, V0, 0.1).simulate(watch=parts.append)
    assert parts[-1].t[-1] == 0.1
    for method in METHODS:
        parts = []
        how = {"controller": DAMPING, "t_span": 1.0, "output_step": 0.01}
        motion = fly(method=method, watch=parts.append, **how)
        unwatched = fly(method=method, **how)
        for name in ARRAYS:
            with row(method, name):
                assert np.array_equal(joined(parts, name), getattr(motion, name))
                assert np.array_equal(getattr(unwatched, name), getattr(motion, name))
        assert len(parts) > 1 and all(part.model is tail() for part in parts)
        assert all("imbalance" not in part.info for part in parts) and "imbalance" in motion.info


def test_on_the_ground_contacts_come_too_and_a_stop_is_the_last_sample():
    q = [0, 0, 0.06, 1, 0, 0, 0, 0.1, 0]
    law, stop = (lambda t, q, v: [0.0, 0.0]), [("touch_down", "feet")]
    for own in ({}, {"controller": law}, {"stop_at": stop, "output_step": 0.01}):
        parts, how = [], {"legs": LEGS, "t_span": 0.2, "rtol": 1e-6} | own
        motion = st.simulate(rat(), q, np.zeros(8), watch=parts.append, **how)
        assert joined(parts, "t").tolist() == motion.t.tolist()
        assert (motion.t[-1] < 0.2) == ("stop_at" in own)
        for name in ("points", "forces", "bristles", "legs"):
            told = np.concatenate([getattr(part.contact, name) for part in parts])
            assert np.array_equal(told, getattr(motion.contact, name)), name
        assert len(parts) > 1


def test_a_run_that_ends_early_is_told_up_to_there():
    """By an error of its controller or of what watches it, or by Ctrl-C."""

    def tired(t, q, v):
        if t > 0.1:
            raise st.SimulationError("it is tired")
        return np.zeros(4)

    def refuse(part):
        raise ArithmeticError("no more")

    def stop(part):
        if part.t[-1] > 0.05:
            raise KeyboardInterrupt

    for method in ("tsit5", "dop853"):
        parts = []
        with pytest.raises(st.SimulationError, match="it is tired") as caught:
            fly(controller=tired, method=method, watch=parts.append)
        assert joined(parts, "t").tolist() == caught.value.trajectory.t.tolist()
        assert not any("failure" in part.info for part in parts)
    for method in ("rk4", "dop853"):
        with row(method), pytest.raises(ArithmeticError, match="no more"):
            fly(method=method, watch=refuse)
    with pytest.raises(KeyboardInterrupt) as caught:
        fly(t_span=50.0, method="rk4", watch=stop, output_step=0.01)
    assert 0.05 < caught.value.motion.t[-1] < 50


def test_it_is_called_after_a_pause_at_the_least(monkeypatch):
    monkeypatch.setattr(callback, "EVERY", 0.02)
    calls = []
    how = {"t_span": 1.0, "method": "rk4", "step": 1e-5, "output_step": 0.01}
    fly(watch=lambda part: calls.append(time.perf_counter()), **how)
    between = np.diff(calls[:-1])  # the last is at the end
    assert len(calls) > 2 and between.min() >= 0.02
