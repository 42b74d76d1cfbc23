"""Estimated errors of numbers, against runs at a tolerance of 1e-11, and motions without any."""

import json
import pickle

import numpy as np
import pytest

import serpentail as st
from tests.simulation.runs import Q0, V0, tail
from tests.simulation.test_audit import FIXED, dropped, grounded
from tests.support.rows import row

from .conftest import made, scene_of

TRUE = {"method": "tsit5", "rtol": 1e-11, "atol": 1e-12}
METHODS = (
    *(("tsit5", {"rtol": 1e-4}), ("tsit5", {"rtol": 1e-6}), ("ros34pw2", {"rtol": 1e-3})),
    *(("ros34pw2", {"rtol": 1e-5}), ("rk4", {"step": 2e-4}), ("implicit_euler", {"step": 1e-4})),
)
FOUND = ("apex_m", "com_rise_m", "recontact_s", "pitch_at_end_rad", "tilt_max_deg", "tilt_end_deg")
FOUND += ("peak_ground_force_N", "ground_impulse_N_s", "work_J", "energy_change_J")


def flat(value):
    parts = value.values() if isinstance(value, dict) else value
    return [float(x) for x in parts] if isinstance(value, dict | list) else [value]


def ratios(model, q, v, **how):
    """Estimates over true errors of one run's numbers, of those that are off at all."""
    true = st.summary(model, st.simulate(model, q, v, **how | TRUE))
    for method, settings in METHODS:
        motion = st.simulate(model, q, v, **how, method=method, **settings)
        of = st.summary(model, motion, errors=True)
        for name in FOUND:
            if true[name] is None:
                continue
            values = zip(
                *(flat(each) for each in (of[name], true[name], of.errors[name])), strict=True
            )
            for value, wanted, error in values:
                off = abs(value - wanted)
                if off > 1e-9 * max(1, abs(wanted)):
                    yield error / off


def test_true_errors_are_below_three_times_the_estimates():
    """Of drops that tumble, touch and slide, and of a flight, by all compiled methods."""
    q, v = (each[0] for each in dropped(grounded(), 1))
    found = [*ratios(tail(), Q0, V0, t_span=0.3), *ratios(grounded(), q, v, **FIXED, t_span=0.5)]
    assert len(found) > 70
    assert np.mean(np.array(found) > 1 / 3) > 0.95
    assert np.mean(np.array(found) < 100) > 0.8 and np.median(found) < 20


def test_a_run_that_is_far_off_is_told_with_its_error():
    model = grounded()
    q, v = (each[0] for each in dropped(model, 1))
    how = FIXED | {"t_span": 0.5}
    true = st.simulate(model, q, v, **how, **TRUE).q[-1, :3]
    for settings in ({"method": "implicit_euler", "step": 1e-3}, {"method": "rk4", "step": 5e-4}):
        motion = st.simulate(model, q, v, **how, **settings)
        (told,) = [each for each in st.summary(model, motion, True)["warnings"] if "B is" in each]
        off = 1e3 * np.linalg.norm(motion.q[-1, :3] - true)
        with row(settings):
            assert off > 3 and float(told.split("estimated ")[1].split()[0]) > off / 3
    fine = st.summary(model, st.simulate(model, q, v, **how, rtol=1e-6), True)
    assert not any(each.startswith("errors") for each in fine["warnings"])


def test_errors_are_printed_and_ready_for_json():
    scene = scene_of("kick", duration=0.5)
    of = scene.summary(scene.simulate(), errors=True)
    lines, error = str(of).splitlines(), of.errors["apex_m"]
    assert 0 < error < 1e-3
    assert f"+- {error:.2g}" in next(line for line in lines if line.startswith("apex_m"))
    assert sum("+-" in line for line in lines) > 10 and of.errors["take_off_s"] > 0
    assert f"| {error:.2g} | m |" in of.markdown() and "method" not in of.errors
    told = json.loads(json.dumps([of.errors, of.described()], allow_nan=False))
    assert told[1]["apex_m"]["error"] == told[0]["apex_m"] == error
    plain = scene.summary(scene.simulate())
    assert plain.errors == {} and "+-" not in str(plain) and "error" not in plain.markdown()[:60]


def test_phases_are_made_again_one_after_another():
    scene = scene_of("kick", duration=0.5)
    kick = [{"at": 0.1, "delta": -1.3, "rate": 20.0}]
    phases = [st.Phase("push", 0.45, until="airborne", moves=kick), st.Phase("fly", 0.1)]
    gamma, delta, *_ = scene.legs.curve.at(0.0)[0]
    angles = {"gamma": gamma, "delta": delta}
    run = st.Sequence(scene.model, phases, **angles).simulate(scene.q0, scene.v0)
    fine = {"settings": {"rtol": 1e-8, "atol": 1e-8}}
    true = st.Sequence(scene.model, phases, **angles, **fine).simulate(scene.q0, scene.v0)
    of = st.summary(scene.model, run.trajectory, errors=True)
    wanted = st.summary(scene.model, true.trajectory)
    assert run.complete and len(run.phases) == 2
    assert 0 < abs(of["apex_m"] - wanted["apex_m"]) < 3 * of.errors["apex_m"] < 0.01
    # the schedule of the legs alone decides when the feet leave
    assert abs(of["take_off_s"] - wanted["take_off_s"]) < 1e-14 > of.errors["take_off_s"]


@pytest.mark.filterwarnings("error")
def test_what_cannot_be_made_again_says_so_in_one_line(rat):
    model, how = tail(), {"t_span": 0.05}
    run = st.simulate(model, Q0, V0, **how)
    many = st.simulate(model, np.tile(Q0, (2, 1)), V0, **how)
    law = st.Sampled(lambda t, q, v: np.zeros(4), rate=100)
    remembers = st.Phases([(0.0, None), (0.01, law)])
    for name, motion in {
        "by hand": made(rat),
        "pickled": pickle.loads(pickle.dumps(run)),
        "resampled": run.resample([0.0, 0.01]),
        "of many": many[0],
        "sampled": st.simulate(model, Q0, V0, controller=law, **how),
        "in a phase": st.simulate(model, Q0, V0, controller=remembers, **how),
    }.items():
        of = st.summary(rat if motion.model is rat else model, motion, errors=True)
        with row(name):
            assert of.errors == {} and of["warnings"][-1].startswith("errors: no estimate: ")
            assert "\n" not in of["warnings"][-1]
    # a function is called again; a run that fails when it is made less exactly has no errors
    calls = []
    run = st.simulate(model, Q0, V0, controller=lambda *_: calls.append(1) or np.zeros(4), **how)
    made_by = len(calls)
    assert st.summary(model, run).errors == {} and len(calls) == made_by
    assert st.summary(model, run, errors=True).errors["apex_m"] >= 0 and len(calls) > made_by
    torque = [0.0]
    run = st.simulate(model, Q0, V0, controller=lambda *_: np.full(4, torque[-1]), **how)
    torque.append(np.nan)
    assert "the run fails" in st.summary(model, run, errors=True)["warnings"][-1]
