"""Numbers of runs of every kind, none where there is none: as JSON, text and tables."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.motion import numbers
from serpentail.motion.text import as_text, as_word
from tests.references.body_set import Animal, Link
from tests.support import zoo

from .conftest import at_height, made, scene_of, told

ROOT = Path(__file__).parents[2]
MASS, GRAVITY = 0.10572 + 0.00351, 9.8  # kg of torso and tail, m/s^2: the rat's
LEGS = st.Legs.fixed(np.radians(210), np.radians(-15))
OF_EVENTS = {
    *("take_off_s", "recontact_s", "landing_group", "least_upright_landing", "landed"),
    *("torso_rate_at_take_off", "torso_rate_at_touch_down", "angular_momentum_at_take_off"),
    *(
        "angular_momentum_at_touch_down",
        "turned_landing_rad",
        "touching_s",
        "first_touch_down_s",
        "last_take_off_s",
    ),
}
OF_THE_GROUND = OF_EVENTS | {
    *("standing_end", "peak_ground_force_N", "peak_ground_force_weights", "peak_group_force_N"),
    *("peak_group_force_weights", "peak_ground_force_s"),
    *("ground_impulse_N_s", "impulse_N_s", "slip_m"),
}


def animal_of(model):
    """The jump's rat as a set of bodies."""
    p = model.parameters
    length, names = p["tail_length"] / (3 * 4), ("torso_mass", "torso_inertia", "tail_mount")
    link = Link(p["tail_mass"] / (3 * 4), length, length / 2, p["link_inertia"])
    return Animal(segments=([link] * 4,) * 3, gravity=GRAVITY, **{name: p[name] for name in names})


def strict(numbers):
    return json.loads(json.dumps(numbers, allow_nan=False))


def test_the_document_s_table_is_that_of_the_numbers():
    text = (ROOT / "docs" / "simulation.md").read_text(encoding="utf-8")
    assert f"<!-- numbers -->\n{numbers.explained()}\n<!-- /numbers -->" in text


def test_text_markdown_and_json_have_values_units_and_meanings(kick):
    of = told(kick)
    lines, width = str(of).splitlines(), len("peak_group_force_weights, right_foot  ")
    rows = {line[:width].rstrip(): line[width:] for line in lines}
    assert rows["apex_m"].split() == [f"{of['apex_m']:.5f}", "m"]
    assert rows["peak_ground_force_weights"].endswith("  body weights")
    assert rows["apex_m"].rindex(" m") == rows["duration_s"].rindex(" s")
    assert rows["landed"] == "no" and rows["steps"].isdigit()
    assert list(of).index("impulse_N_s") < list(of).index("peak_ground_force_N")
    said = [line.removeprefix("warnings").strip() for line in lines if line.startswith("warn")]
    assert said == kick.warnings
    lines, described = of.markdown().splitlines(), strict(of.described())
    assert len(lines) == len(of) + 2 and len({line.count("|") for line in lines}) == 1
    assert {name: each["value"] for name, each in described.items()} == strict(of)
    value, meaning = as_word(of["apex_m"]), described["apex_m"]["meaning"]
    assert f"| apex_m | {value} | m | {meaning} |" in lines and described["apex_m"]["unit"] == "m"


def test_words_and_reports_without_units():
    for value, word in (
        *((0.403754550575, "0.40375"), (764.3260756, "764.33"), (123456.0, "1.2346e+05")),
        *((12345.0, "12345"), (1.0, "1.0000"), (-1e-16, "0.0000"), (1.5e-7, "1.5000e-07")),
        *((957, "957"), (True, "yes"), (None, "-"), ("rk4", "rk4"), ([], "-")),
        ([0.0, -2.5], "0.0000  -2.5000"),
    ):
        assert as_word(value) == word
    report = {"converged": True, "much_longer": 1.0, "parts": {"a": None}, "texts": ["b", "c d"]}
    assert as_text(report).splitlines() == [
        "converged    yes",
        "much_longer  1.0000",
        "parts, a     -",
        "texts        b",
        "texts        c d",
    ]
    assert as_text({}) == ""


def test_a_flight_without_contacts():
    model = zoo.model("arcs2")
    of = told(st.simulate(model, at_height(model, 0)[0], np.zeros(model.nv), t_span=0.1))
    assert all(of[name] is None for name in OF_THE_GROUND)
    assert of["body_weight_N"] > 1 and of["warnings"] == [] and of["tilt_max_deg"] == 0
    assert strict(of) == of and "peak_ground_force_N" in str(of)


def test_a_body_without_feet_a_single_sample_and_a_motion_that_nobody_simulated(kick, rat):
    motion = made(rat, events=[("touch_down", "tail", 1.5)])
    rests, forces = np.zeros((2, 3, 3, 3))
    forces[-1, :, 2] = 1.0
    contact = st.Contact(rests, forces, rests[..., :2], {"tail": 2, "torso": 1})
    of = told(dataclasses.replace(motion, contact=contact))
    assert of["standing_end"] is of["landed"] is None
    assert of["least_upright_landing"] == 1 and of["landing_group"] == "tail"
    assert of["peak_group_force_N"] == {"tail": 2.0, "torso": 1.0} and strict(of) == of
    of = told(kick.resample(kick.t[:1]))
    assert of["duration_s"] == of["energy_change_J"] == 0
    assert of["tilt_max_deg"] == of["tilt_end_deg"] and of["landed"] is None
    assert of["peak_ground_force_N"] == pytest.approx(1.07, abs=0.01) and strict(of) == of
    of = told(dataclasses.replace(made(rat, 1.0), info={}))
    unknown = ("work_J", "imbalance", "impulse_N_s", "cpu_s", "real_time_factor", "touching_s")
    assert all(of[name] is None for name in unknown) and strict(of) == of


def test_a_run_that_failed_and_methods_that_look_for_no_events():
    scene = scene_of("kick")
    with pytest.raises(st.SimulationError) as caught:
        scene.simulate(most_steps=400)
    of = scene.summary(caught.value.trajectory)
    assert of["work_J"] is of["ground_impulse_N_s"] is None
    assert of["peak_ground_force_N"] > 700 and strict(of) == of
    assert {"torso", "ground"} <= {each.split(":")[0] for each in of["warnings"]}
    scene = scene_of("kick", duration=0.01)
    for method in ("dop853", "lsoda"):
        of = scene.summary(scene.simulate(method=method, rtol=1e-6, atol=1e-6))
        assert all(of[name] is None for name in OF_EVENTS)
        assert of["ground_impulse_N_s"][2] == pytest.approx(1.0705 * 0.01, rel=1e-2)
        assert of["standing_end"] is True and strict(of) == of


def test_the_ground_s_impulse_is_what_momentum_and_weight_leave(kick, leap):
    for motion in (kick, leap):
        expected = motion.linear_momentum[-1] - motion.linear_momentum[0]
        expected[2] += MASS * GRAVITY * np.ptp(motion.t)
        found = told(motion)["ground_impulse_N_s"]
        np.testing.assert_allclose(found, expected, rtol=0, atol=5e-5)
        assert expected[2] > 1
        # whereas samples of the force 1 ms apart miss what a blow gives
        sampled = np.trapezoid(motion.contact.forces.sum(axis=1)[:, 2], motion.t)
        assert abs(sampled - expected[2]) > 0.1


def test_peaks_by_hand(leap):
    """Forces of feet (right 0 to 2, left 3 to 5) and tail at three samples."""
    forces = np.zeros((3, 18, 3))
    forces[0, 0], forces[0, 3] = (3, 0, 4), (0, 0, 5)  # a pair: (3, 0, 9)
    forces[1, 1], forces[1, 5] = (0, 0, 8), (0, 6, 0)  # right 8, left 6, both 10
    forces[2, 2], forces[2, 7], forces[2, 17] = (0, 0, 1), (0, 0, 2), (2, 0, 0)
    of, weight = told(made(leap.model, forces=forces)), MASS * GRAVITY
    group = {"feet": 10, "tail": np.sqrt(8), "right_foot": 8, "left_foot": 6}
    assert of["peak_ground_force_N"] == 10
    assert of["peak_ground_force_weights"] == pytest.approx(10 / weight)
    assert of["body_weight_N"] == pytest.approx(weight)
    assert of["peak_group_force_N"] == pytest.approx(group)
    weights = {name: force / weight for name, force in group.items()}
    assert of["peak_group_force_weights"] == pytest.approx(weights)
    assert of["peak_ground_force_s"] == 1
    forces[2] *= 100  # more than a warning allows, where there is a weight
    floating = leap.model.with_parameters(gravity=0.0)
    of = told(made(floating, forces=forces))
    assert of["body_weight_N"] is of["peak_ground_force_weights"] is of["com_rise_m"] is None
    assert of["peak_ground_force_N"] > 200 and not any("weights" in each for each in of["warnings"])
    assert set(of["peak_group_force_weights"].values()) == {None}
    forces[1] = 1e308  # what overflows is no number
    of = told(made(leap.model, forces=forces))
    assert of["peak_ground_force_N"] is of["peak_group_force_N"]["feet"] is None


def test_peaks_do_not_depend_on_the_samples(kick):
    """The legs start to move at once: a jump of the force, between the ends of steps or at one."""
    fine = [told(kick)[f"peak_{name}"] for name in ("ground_force_N", "ground_force_s")]
    assert fine[1] == pytest.approx(0.4, abs=1e-9)
    for step in (1.7e-3, 0.013):
        motion = scene_of("kick", output_step=step).simulate()
        assert motion.contact.total.max() < 0.3 * fine[0]
        of = told(motion)
        assert [of["peak_ground_force_N"], of["peak_ground_force_s"]] == pytest.approx(fine, 1e-6)
        feet = of["peak_group_force_N"]
        assert feet["right_foot"] == feet["left_foot"] == pytest.approx(fine[0] / 2, 1e-3)
        blows = [[each for each in run.warnings if "pushes" in each] for run in (motion, kick)]
        assert blows[0] == blows[1] != []
        scene = scene_of("kick", output_step=step)
        how = scene.settings | {"t_span": scene.duration, "controller": scene.controller}
        starts = np.tile(scene.q0, (2, 1)), np.tile(scene.v0, (2, 1))
        many = st.simulate(scene.model, *starts, legs=scene.legs, **how)
        assert many[1].info["peaks"] == motion.info["peaks"]
        part = motion.resample(motion.t[:2])  # ends before the blow
        assert told(part)["peak_ground_force_N"] < 2


def test_peaks_are_those_between_samples_too(rat):
    """Of a drop and of a kick that begins at once, against samples each 20 us; the trial of the
    first step, which looks ahead into the kick, is no part of the motion.
    """
    kick, drop = scene_of("kick"), at_height(rat, 0.1, 1)[0]
    push = st.Legs.moves(3.67, -0.26, [{"at": 0, "delta": -1.3, "rate": 90, "shape": "accelerate"}])
    crouched = {"bristles0": kick.settings["bristles0"], "legs": push, "t_span": (-0.01, 0.04)}
    for start, how in ((kick.q0, crouched), (drop, {"legs": LEGS, "t_span": 0.2})):
        peaks = []
        for step in (2e-3, 1e-4, 2e-5):
            given = {"controller": st.Damping(1e-3), "output_step": step} | how
            peaks.append(told(st.simulate(rat, start, np.zeros(8), **given)))
        for of in peaks[:2]:
            force, wanted = (x["peak_ground_force_N"] for x in (of, peaks[2]))
            assert 0.99 * wanted < force <= wanted * (1 + 1e-9)
            parts, wanted = (x["peak_group_force_N"] for x in (of, peaks[2]))
            assert parts == pytest.approx(wanted, rel=0.01)
    sampled = st.simulate(rat, start, np.zeros(8), **given).contact.total.max()
    assert sampled == pytest.approx(force, rel=0.01)


def test_the_flight_s_rate_and_angular_momentum(leap):
    """Momentum by the set of bodies, which a flight conserves; the rate at its end is that of a run
    that ends there. A drop has no take-off.
    """
    of, model = told(leap), leap.model
    inside = int(np.searchsorted(leap.t, (of["take_off_s"] + of["recontact_s"]) / 2))
    wanted = animal_of(model).momentum(leap.q[inside], leap.v[inside])[1]
    for when in ("take_off", "touch_down"):
        found = of[f"angular_momentum_at_{when}"]
        np.testing.assert_allclose(found, wanted, atol=2e-4 * np.abs(wanted).max())
    for when, time in (("take_off", of["take_off_s"]), ("touch_down", of["recontact_s"])):
        found = of[f"torso_rate_at_{when}"]
        np.testing.assert_allclose(found, leap.at(time).v[3:6], atol=0.02)
    drop = st.simulate(
        model, at_height(model, 0.2, 1)[0], np.zeros(model.nv), legs=LEGS, t_span=0.25
    )
    of = told(drop)
    assert of["torso_rate_at_take_off"] is of["angular_momentum_at_take_off"] is None
    np.testing.assert_allclose(of["torso_rate_at_touch_down"], 0, atol=1e-6)


def test_the_path_of_sliding_feet_tail_and_torso():
    """Of a rat that comes to rest on the ground, and is then pushed along x. Who sticks does not
    slip, although its springs stretch. With the paper's friction it is the path of the point: its
    springs pull it back, so that it is longer than a sliding block's way.
    """
    wanted, found = 0.3**2 / (2 * 0.05 * GRAVITY), []
    for name, speed, mu in (("ground", 0.3, 0.05), ("ground", 0.01, 1.0), ("paper", 0.3, 0.05)):
        model = zoo.model(name).with_parameters(mu=mu)
        how = {"legs": LEGS, "controller": st.Damping(1e-3)}
        start = at_height(model, 0.06, 1)[0]
        q, v, bristles = st.settle(model, start, rounds=3, duration=0.4, **how)
        v[0] = speed
        how |= {"bristles0": bristles, "t_span": 0.8, "output_step": 2e-3}
        found.append(told(st.simulate(model, q, v, **how))["slip_m"])
    assert found[0] == pytest.approx(dict.fromkeys(["feet", "tail", "torso"], wanted), rel=0.01)
    assert max(found[1].values()) < 1e-4 and found[2]["feet"] > wanted


def test_a_rolling_torso_does_not_slip_and_a_spinning_one_does(rat):
    """A sphere of radius 2 cm that rolls along x by 3 rad in 1 s; then the same without rolling."""
    t, radius, turn = np.linspace(0, 1, 501), 0.02, 3.0
    for rolls in (True, False):
        q = at_height(rat, radius, len(t))
        q[:, 0] = radius * turn * t * rolls
        half = turn * t / 2
        q[:, 3:7] = np.stack([np.cos(half), 0 * t, np.sin(half), 0 * t], axis=1)
        points = q[:, None, :3] * [1, 1, 0]
        v = np.zeros((len(t), rat.nv))
        v[:, 0], v[:, 4] = radius * turn * rolls, turn
        forces = np.tile([0, 0, 1.0], (len(t), 1, 1))
        contact = st.Contact(points, forces, np.zeros((len(t), 1, 2)), {"torso": 1})
        motion = dataclasses.replace(made(rat, q, t=t), v=v, contact=contact)
        wanted = 0.0 if rolls else radius * turn
        assert told(motion)["slip_m"]["torso"] == pytest.approx(wanted, abs=1e-6)
    # a point in the air does not slip, and one on the ground less by what its spring stretches
    points, forces = np.zeros((2, 3, 6, 3))
    points[:, 0, 0] = [0, 1, 3]
    for force, stretch, slip in ((0, 0.0, 0.0), (1, 0.0, 2.0), (1, 0.5, 1.0)):
        forces[1:, 0, 2] = force
        motion = made(rat, points=points, forces=forces)
        contact = dataclasses.replace(motion.contact, bristles=stretch * points[..., :2])
        assert told(dataclasses.replace(motion, contact=contact))["slip_m"] == {"feet": slip}
