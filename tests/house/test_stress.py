"""Drops gain no energy, and what once broke stays mended; parts of studies are made once, whatever
happens.
"""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

import serpentail as st
from checks.stress import drops
from checks.stress.subjects import Subject, changed, exact_of, state
from examples.studies.parts import Part, made
from serpentail.basics.plausible_values import UNLIKE as UNLIKE_FROM
from serpentail.basics.plausible_values import disparity
from tests.references.metrics import mass_matrix_error
from tests.support import tiny_study, zoo
from tests.support.rows import row

ROOT = Path(__file__).parents[2]


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


# Studies.

PATIENCE = 60  # s


def one(folder, of, make, files=()):
    """The result of a part called "one"."""
    return made("study", folder, {"one": Part(make, of, files)})["one"]


def ended(folder):
    """How often each part ended."""
    path = folder / "ended"
    lines = path.read_text().splitlines() if path.exists() else []
    return Counter(int(line.split()[0]) for line in lines)


def test_parts_are_made_once_and_again_where_inputs_change_or_files_are_gone(tmp_path):
    make, picture = partial(tiny_study.square, 3, tmp_path), tmp_path / "picture.png"
    for starts, gone, count in [(2, False, 1), (2, False, 1), (3, False, 2), (3, True, 3)]:
        if gone:
            picture.unlink()
        found = one(tmp_path / "parts", {"starts": (1, starts)}, make, (picture,))
        assert found == {"number": 3, "square": 9, "third": 1.0} and ended(tmp_path) == {3: count}
        picture.touch()


def test_a_part_that_fails_is_told_and_none_is_made_while_another_process_writes(tmp_path):
    with pytest.raises(st.SerpentailError, match="one: ZeroDivisionError: no such part"):
        one(tmp_path, {}, tiny_study.wrong)
    assert tiny_study.titles(tmp_path / "study.rows") == []
    lock = FileLock(tmp_path / "study.rows" / "lock")
    with lock, pytest.raises(st.SerpentailError, match="another process is writing"):
        one(tmp_path, {}, tiny_study.ones)
    assert np.isnan(one(tmp_path, {}, tiny_study.lost)["lost"])  # JSON has no NaN of its own


def started(folder):
    """Start the tiny study in a process; one of its parts has begun, when another ends."""
    return subprocess.Popen(
        [sys.executable, "-m", "tests.support.tiny_study", str(folder)],
        cwd=ROOT,
        env=os.environ | {"SERPENTAIL_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize("whole", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_ctrl_c_ends_all_in_one_line_and_the_same_command_goes_on(tmp_path, whole):
    """From a terminal all processes hear it, from another program the parent alone."""
    store = tmp_path / "parts" / "tiny.rows"
    assert tiny_study.titles(store) == []  # what reads the store is imported before time counts
    process = started(tmp_path)
    while not tiny_study.titles(store):
        time.sleep(0.02)
    (os.killpg if whole else os.kill)(process.pid, signal.SIGINT)
    printed, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and printed == ""
    *told, last = errors.splitlines()
    assert last == "interrupted: the same command goes on from here"
    assert [line for line in told if not line.startswith("sweep")] == []
    counts, kept = ended(tmp_path), [int(title.split()[1]) for title in tiny_study.titles(store)]
    printed, _ = started(tmp_path).communicate(timeout=PATIENCE)
    parts = range(tiny_study.PARTS)
    results = [(f"part {k}", {"number": k, "square": k**2, "third": k / 3}) for k in parts]
    assert printed == f"{results}\n"
    assert all(ended(tmp_path)[k] == counts[k] for k in kept) and {*ended(tmp_path)} == {*parts}
