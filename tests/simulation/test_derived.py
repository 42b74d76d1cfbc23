"""What follows from a run is derived when somebody asks, and then is what it always was."""

import copy
import dataclasses
import pickle
import threading

import numpy as np
import pytest

import serpentail as st
from serpentail.motion.derived import LATER
from serpentail.motion.trajectory import DERIVED

from ..support.models import model_folder

QUATERNION = [1, 0, 0, 0]
FEW = ["forward_dynamics", "energy", "momentum", "tail_points", "rollout"]


@pytest.fixture(scope="module")
def model():
    return st.load(model_folder(1, 3, functions=FEW))


def flight(model, **options):
    q0 = np.array([0, 0, 1.0, *QUATERNION, 0.3, -0.2])
    v0 = np.array([0.1, 0, 0, 1, 0.5, -0.2, 0, 2.0])
    return st.simulate(model, q0, v0, t_span=0.3, controller=st.Damping(1e-4), **options)


def held(motion):
    """Names of the derived fields that a motion has already."""
    return {name for name in DERIVED if name in vars(motion)}


def test_nothing_is_derived_before_it_is_asked_for(model):
    motion = flight(model)
    assert held(motion) == set()
    motion.q, motion.t, motion.attitude, motion.tail, motion.segments  # noqa: B018
    assert held(motion) == set()
    assert motion.kinetic is motion.kinetic and held(motion) == {"kinetic", "potential"}
    assert motion.contact is None and "info" not in held(motion)
    assert motion.info is motion.info
    with pytest.raises(AttributeError):
        motion.nothing  # noqa: B018


def test_derived_fields_are_those_of_the_model(model):
    motion = flight(model)
    kinetic, potential = model.energy(motion.q, motion.v)
    linear, angular = model.momentum(motion.q, motion.v)
    expected = {"kinetic": kinetic, "potential": potential}
    expected |= {"linear_momentum": linear, "angular_momentum": angular}
    for name, array in expected.items():
        np.testing.assert_array_equal(getattr(motion, name), array)
    lost = motion.energy[0] - motion.energy[-1]
    assert lost > 0 and motion.info["work_J"]["damping"] == pytest.approx(-lost, rel=1e-5)


@pytest.mark.parametrize("first", [*DERIVED, "save", "replace", "resample", "summary", "warnings"])
def test_whatever_is_asked_for_first(model, first, tmp_path):
    whole = dataclasses.replace(flight(model))
    assert held(whole) == {*DERIVED} and LATER not in vars(whole)
    motion = flight(model)
    uses = {
        "save": lambda: motion.save(tmp_path / "motion"),
        "replace": lambda: dataclasses.replace(motion),
        "resample": lambda: motion.resample(motion.t[::2]),
        "summary": lambda: st.summary(model, motion),
    }
    uses.get(first, lambda: getattr(motion, first))()
    known = {k: v for k, v in whole.info.items() if not k.endswith("seconds")}
    assert {k: v for k, v in motion.info.items() if not k.endswith("seconds")} == known
    for name in DERIVED[:4]:
        np.testing.assert_array_equal(getattr(motion, name), getattr(whole, name))


@pytest.mark.parametrize("way", ["file", "pickle", "copy", "deepcopy", "replace"])
def test_copies_have_all_fields(model, way, tmp_path):
    motion = flight(model)
    ways = {
        "file": lambda: st.Trajectory.load(motion.save(tmp_path / "motion")),
        "pickle": lambda: pickle.loads(pickle.dumps(motion)),
        "copy": lambda: copy.copy(motion),
        "deepcopy": lambda: copy.deepcopy(motion),
        "replace": lambda: dataclasses.replace(motion),
    }
    twin = ways[way]()
    assert held(twin) == {*DERIVED} and LATER not in vars(twin)
    for entry in dataclasses.fields(st.Trajectory):
        one, other = getattr(twin, entry.name), getattr(motion, entry.name)
        if isinstance(one, np.ndarray):
            assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())
    assert twin.info == motion.info and twin.contact is None


def test_threads_that_ask_at_once_get_one_array(model):
    motion, found, together = flight(model), [], threading.Barrier(8)

    def ask():
        together.wait()
        found.append((motion.kinetic, motion.info))

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(kinetic is motion.kinetic and info is motion.info for kinetic, info in found)


def test_samples_are_read_only_and_one_s_own(model):
    one, other = flight(model), flight(model)
    for name in ("t", "q", "v", "tau", "kinetic", "linear_momentum"):
        array = getattr(one, name)
        assert not array.flags.writeable and array.dtype == np.float64
        assert not np.shares_memory(array, getattr(other, name))


@pytest.mark.parametrize("real", ["double", "float"])
def test_what_no_number_may_hold_is_told_at_once(real):
    """An energy beyond the largest number ends the run, as before, and is no surprise later."""
    model = st.load(model_folder(1, 3, functions=FEW, real=real))
    fast = 1e160 if real == "double" else 1e25
    q0, v0 = np.array([0, 0, 1.0, *QUATERNION, 0, 0]), np.zeros(8)
    v0[0] = fast
    with pytest.raises(st.SimulationError, match="by sample: energy: the result"):
        st.simulate(model, q0, v0, t_span=1e-3, method="rk4")
    v0[0] = fast**0.3  # held, but not beyond doubt
    motion = st.simulate(model, q0, v0, t_span=1e-3, method="rk4")
    assert held(motion) == {*DERIVED} and np.isfinite(motion.kinetic).all()


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("threads", [1, 3])
def test_many_runs_are_measured_when_somebody_asks(real, threads):
    model = st.load(model_folder(1, 3, functions=FEW, real=real))
    q0 = np.tile([0, 0, 1.0, *QUATERNION, 0.3, -0.2], (5, 1))
    own = {"tail_mass": np.linspace(0.004, 0.006, 5)}
    runs = st.simulate(model, q0, np.ones(8), t_span=0.1, parameters=own, threads=threads)
    eps = float(np.finfo(np.float32 if real == "float" else float).eps)
    assert not {*DERIVED} & {*vars(runs)} - {"info"} and runs.errors == [None] * 5
    for k in range(5):
        motion = runs[k]
        assert held(motion) == set()
        for name in DERIVED[:4]:
            found = getattr(runs, name)
            assert found is getattr(runs, name) and not found.flags.writeable
            np.testing.assert_array_equal(found[k], getattr(motion, name))
        left = pytest.approx(runs.audit.relative[k], abs=eps)  # in sums of another order
        assert motion.info["imbalance"]["relative"] == left
    twin = pickle.loads(pickle.dumps(runs))
    np.testing.assert_array_equal(twin.kinetic, runs.kinetic)


def test_of_many_runs_one_may_be_beyond_numbers(model):
    q0, v0 = np.array([0, 0, 1.0, *QUATERNION, 0, 0]), np.zeros((3, 8))
    v0[1, 0], v0[2, 0] = 1e160, 1e100
    runs = st.simulate(model, q0, v0, t_span=1e-3, method="rk4")
    assert [error is None for error in runs.errors] == [True, False, True]
    assert "by sample: energy: the result" in str(runs.errors[1])
    assert np.isfinite(runs.kinetic[[0, 2]]).all() and np.isnan(runs.kinetic[1]).all()
    assert held(runs[2]) == {*DERIVED} and held(runs[0]) == set()
