"""Drops gain no energy, and what once broke stays mended; parts of studies are made once."""

import sqlite3
from contextlib import closing
from functools import partial

import numpy as np
import pytest

import serpentail as st
from checks.stress import drops
from checks.stress.subjects import Subject, changed, exact_of, state
from examples.studies.parts import Part, made
from serpentail.basics.plausible_values import UNLIKE as UNLIKE_FROM
from serpentail.basics.plausible_values import disparity
from tests.references.metrics import mass_matrix_error
from tests.support import swept, zoo
from tests.support.rows import row


@pytest.mark.parametrize("one_arc", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_drop_gains_no_energy(one_arc):
    """Of one arc: the drop whose samples before the landing once had two thirds too much; dop853
    once gave it up.
    """
    model = drops.falling(1, None) if one_arc else zoo.model("ground_arcs")
    rng = np.random.default_rng(11)
    for _ in range(26):
        q, v = drops.start(model, rng)
        legs = st.Legs.fixed(rng.uniform(2, 4.5), rng.uniform(-1.5, 1))
    settings = {"controller": st.Damping(1e-4), "legs": legs, "t_span": drops.DURATION}
    for method in ("ros34pw2", "tsit5", "dop853"):
        with row(method):
            motion = st.simulate(model, q, v, method=method, output_step=0.01, **settings)
            assert drops.gain(motion) <= drops.GAIN


UNLIKE = {
    "a tail of 1 km": {"tail_length": 1e3},
    "a tail of 1 um": {"tail_length": 1e-6},
    "a torso of 1 mg": {"torso_mass": 1e-6, "torso_inertia": (1e-12, 1e-12, 1e-12)},
    "a mount 1 km away": {"tail_mount": (1e3, -1e3, 1e3)},
}


@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnusualSize")
def test_bodies_of_unlike_size_are_told():
    lying = zoo.model("ground_arcs")
    for name, change in UNLIKE.items():
        with row(name), pytest.warns(st.UnlikeBodies, match=r"factor of .*: H may be off"):
            lying.with_parameters(**change)
        with row(name), pytest.warns(st.UnlikeBodies):
            st.load(lying.folder, parameters=change)


def error_of_mass_matrix(of, rng, bends):
    """Error of H against 30 digits, in units of its diagonal."""
    q, *_ = state(of, rng, bends)
    return mass_matrix_error(of.model.mass_matrix(q), exact_of(of.model).mass_matrix(q))


@pytest.mark.slow
def test_the_warning_is_true():
    """It comes where H is off by more than 1e-12, and an error is never more than it says."""
    lying, worst = zoo.model("ground_arcs"), 0.0
    for change in UNLIKE.values():
        of = changed(Subject("", lying, None), **change)
        dice = map(np.random.default_rng, range(5))
        error = max(error_of_mass_matrix(of, rng, np.zeros(4)) for rng in dice)
        assert error < np.finfo(float).eps * disparity(of.model.parameters)
        worst = max(worst, error)
    assert worst > 1e-12


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnusualSize")
@pytest.mark.parametrize("name", ["feet_tail", "ground_arcs"])
def test_bodies_without_the_warning_keep_their_digits(name):
    """Random bodies as unlike as may be without it."""
    of, rng, quiet = Subject("", zoo.model(name), None), np.random.default_rng(4), 0
    while quiet < 8:
        heavy, long, wide = 10 ** rng.uniform((-4, -3, -3), (4, 3, 3))
        change = {"tail_mass": 3.5e-3 * heavy, "tail_length": 0.2 * long}
        change |= {"tail_mount": (0, -0.04 * wide, 4e-3 * wide)}
        if 1e2 < disparity(of.model.parameters | change) < UNLIKE_FROM:
            other, quiet = Subject("", of.model.with_parameters(**change), None), quiet + 1
            for bends in (np.zeros(of.model.nv - 6), rng.uniform(-1, 1, of.model.nv - 6)):
                assert error_of_mass_matrix(other, rng, bends) < 1e-12


def test_simulations_that_cannot_be_are_refused():
    q = np.array([0, 0, 0.3, 1, 0, 0, 0, 0, 0.0])
    settings = {"legs": st.Legs.fixed(3.6, -0.3), "t_span": 0.01}
    for change, words in [
        ({"method": np.zeros(2)}, "method"),
        ({"stop_at": np.zeros((2, 2))}, "stop_at"),
        ({"method": "rk4", "step": 1e-320}, "step 1e-320"),
        ({"output_step": 1e-320}, "output_step 1e-320"),
        ({"method": "lsoda", "t_span": 1e-320}, "output_step .*give 1e-100"),
        ({"t_span": (1e10, 1e10 + 4e-6)}, "output_step .*give 2.2e-06 s"),
        ({"method": "ros34pw2", "rtol": 1e-320}, "rtol .*give 2.2e-14"),
        ({"method": "dop853", "rtol": 1e-15}, "rtol 1e-15"),
        ({"method": "ros34pw2", "most_step": 1e-200}, "most_step 1e-200"),
    ]:
        with row(change), pytest.raises(st.SimulationError, match=words):
            st.simulate(zoo.model("feet_tail"), q, np.zeros(8), **settings | change)


def test_arguments_that_the_fuzz_once_broke_are_refused():
    model = zoo.model("feet_tail")
    for call, words in [
        (lambda: st.Legs.ramp(3.6, (-0.3, -1.0), 0.4, 1e-320), "inf s"),
        (lambda: model.external_force(moment=(0, np.nan, 0)), r"moment\[1\]: value nan"),
        (lambda: st.polar_to_bend(np.zeros(2), np.zeros(3)), "shapes differ"),
        (lambda: st.polar_to_bend(np.inf, 1.0), "phi: value inf"),
        (lambda: st.bend_to_polar(5e-324, 0.0, 1.0, 1.0), "too large"),
        (lambda: st.rotation_matrix(np.zeros(4)), "a quaternion is zero"),
        (lambda: st.rotation_matrix(np.zeros(3)), "quaternion has shape"),
        (lambda: st.pitch_roll_yaw(3.0), "q has shape"),
    ]:
        with row(words), pytest.raises(st.SerpentailError, match=words):
            call()
    for size in (1e-300, 1e-160, 1e160, 1e300):  # quaternions of any norm are rotations
        q = np.array([0.5, 0.5, -0.5, 0.5])
        np.testing.assert_allclose(st.rotation_matrix(q * size), st.rotation_matrix(q), atol=1e-15)


# Parts of studies.


def one(folder, starts, files=(), **given):
    """The result of a part called "one", and how often it was made."""
    made_of = Part(partial(swept.part, folder, **given), {"starts": (1, starts)}, files)
    found = made("study", folder / "parts", {"one": made_of})["one"]
    return found, (folder / "made").read_text().count("once")


@pytest.mark.slow
def test_parts_are_made_once_and_again_where_inputs_change_files_are_gone_or_one_failed(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("SERPENTAIL_THREADS", "1")  # one process
    picture = tmp_path / "picture.png"
    with pytest.raises(st.SerpentailError, match="one: ZeroDivisionError: division"):
        one(tmp_path, 2, result=1)
    for starts, gone, count in [(2, False, 2), (2, False, 2), (3, False, 3), (3, True, 4)]:
        if gone:
            picture.unlink()
        found, times = one(tmp_path, starts, (picture,))
        assert found["third"] == 1 / 3 and np.isnan(found["lost"])  # JSON has no NaN of its own
        assert times == count
        picture.touch()
    with closing(sqlite3.connect(tmp_path / "parts" / "study.rows", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(st.SerpentailError, match="another process is writing"):
            one(tmp_path, 4)
