"""Touches by events, and what tells a landing from a tumble: motions made by hand, and one whose
animal falls on its back and rolls onto its feet.
"""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.motion.summary import summary

from .conftest import at_height, made, scene_of

LANDS, ROWS = 0.5, 1001  # s of 1


def down(group, time):
    return {"time": time, "group": group, "kind": "touch_down"}


def off(group, time):
    return {"time": time, "group": group, "kind": "take_off"}


def fallen(model, rotations, events=None, standing=True):
    """A motion of 1 s that falls, lands at 0.5 s, and turns as told; at the end on its feet."""
    t = np.linspace(0, 1, ROWS)
    q = at_height(model, 0.1, ROWS)
    q[:, 2] += np.maximum(LANDS - t, 0)
    q[:, 3:7] = np.roll(rotations(t).as_quat(), 1, axis=1)
    forces = np.zeros((ROWS, sum(model.contacts.values()), 3))
    forces[-1, 0, 2] = 1.0 if standing else 0.1  # N, of a weight of 1.07 N
    events = [down("feet", LANDS)] if events is None else events
    return made(model, q, t=t, forces=forces, events=events)


def roll(angle):
    return lambda t: Rotation.from_euler("y", angle(np.maximum(t - LANDS, 0))[:, None])


def test_a_landing(rat):
    """Rocks once by 0.3 rad to and fro: it has turned by 4 * 0.3."""
    told = summary(rat, fallen(rat, roll(lambda s: 0.3 * np.sin(4 * np.pi * s))))
    assert told["recontact_s"] == LANDS and told["landing_group"] == "feet"
    assert told["least_upright_landing"] == pytest.approx(np.cos(0.3), abs=1e-5)
    assert told["turned_landing_rad"] == pytest.approx(1.2, abs=1e-3)
    assert told["standing_end"] is told["landed"] is True


def test_a_tumble_that_ends_on_the_feet_is_no_landing(rat):
    told = summary(rat, fallen(rat, roll(lambda s: 3 * 2 * np.pi * (s / 0.5) ** 2)))
    assert told["standing_end"] is True and told["landed"] is False
    assert told["least_upright_landing"] == pytest.approx(-1, abs=1e-3)
    assert told["turned_landing_rad"] == pytest.approx(6 * np.pi, rel=1e-6)
    assert told["tilt_max_deg"] == pytest.approx(180, abs=2)
    assert told["tilt_end_deg"] == pytest.approx(0, abs=1e-5)


def test_who_does_not_stand_has_not_landed(rat):
    told = summary(rat, fallen(rat, roll(lambda s: 0 * s), standing=False))
    assert told["least_upright_landing"] == 1 and told["landed"] is told["standing_end"] is False


def test_a_somersault_before_the_landing_does_not_count(rat):
    def before(t):
        return Rotation.from_euler("x", 2 * np.pi * np.minimum(t / LANDS, 1)[:, None])

    told = summary(rat, fallen(rat, before))
    assert told["landed"] is True and told["turned_landing_rad"] == pytest.approx(0, abs=1e-6)
    assert told["pitch_at_end_rad"] == pytest.approx(2 * np.pi)


def test_the_turn_is_the_integral_of_the_horizontal_angular_velocity(rat):
    """Whatever the motion, with yaw: against rotation vectors between times 5 us apart."""

    def rotations(t):
        angles = [3 * np.sin(7 * t), np.cos(9 * t), 4 * t**2]
        return Rotation.from_euler("ZXY", np.stack(angles, axis=-1))

    told = summary(rat, fallen(rat, rotations))
    fine = np.linspace(LANDS, 1, 100_001)
    after = rotations(fine)
    turns = (after[1:] * after[:-1].inv()).as_rotvec()
    expected = np.linalg.norm(turns[:, :2], axis=1).sum()
    assert told["turned_landing_rad"] == pytest.approx(expected, rel=1e-4)
    assert expected < 0.9 * np.linalg.norm(turns, axis=1).sum()  # yaw is more than a little


def test_who_falls_on_its_back_and_rolls_onto_its_feet_stands_but_has_not_landed():
    """Self-recovery, thrown up by 1 m/s before it begins: it lands flat on its back."""
    times = (1.5, 1.9, 2.2, 2.3, 2.8)
    scene = scene_of("self_recovery", **{"reference.times": times, "duration": 4.0})
    v = scene.v0.copy()
    v[2] = 1.0
    motion = dataclasses.replace(scene, v0=v).simulate(rtol=1e-4)
    told = scene.summary(motion)
    assert told["standing_end"] is True and told["upright_end"] > 0.97
    assert told["landed"] is False and told["landing_group"] == "torso"
    assert told["least_upright_landing"] < -0.99
    assert told["turned_landing_rad"] > np.pi  # over its side, at least
    turning = motion.t >= told["recontact_s"]
    rates = np.einsum(
        "kij,kj->ki",
        Rotation.from_quat(np.roll(motion.q[:, 3:7], -1, 1)).as_matrix(),
        motion.v[:, 3:6],
    )
    level = np.linalg.norm(rates[turning, :2], axis=1)
    assert told["turned_landing_rad"] == pytest.approx(
        np.trapezoid(level, motion.t[turning]), rel=0.02
    )


def of_groups(told):
    """Return what is told of groups, without the single feet."""
    return {name: value for name, value in told.items() if "_foot" not in name}


def test_each_foot_touches_by_the_forces_at_the_samples():
    """The right foot at samples 1 and 2, the left one from sample 2 on, 0.1 s apart."""
    model = scene_of("tail_support_jump").model
    t, forces = np.linspace(0, 0.5, 6), np.zeros((6, 18, 3))
    forces[1:3, 2, 2], forces[2:, 4, 2], forces[:, 9, 2] = 0.5, 0.2, 1
    told = summary(model, made(model, at_height(model, 0.1, 6), t=t, forces=forces))
    spans = {side: told["touching_s"][side] for side in ("right_foot", "left_foot")}
    assert spans == pytest.approx({"right_foot": 0.2, "left_foot": 0.3})
    down, up = told["first_touch_down_s"], told["last_take_off_s"]
    assert (down["right_foot"], down["left_foot"]) == pytest.approx((0.1, 0.2))
    assert up["right_foot"] == pytest.approx(0.3) and up["left_foot"] is None


def test_each_foot_of_a_hop_by_a_threshold_of_its_forces():
    """The legs straighten at different times; a foot's force counts as zero below 1e-12 N."""
    scene = scene_of("kick")
    gamma, delta = scene.legs.curve.at(0.0)[0][:2]
    times = [0, 0.05, 0.07, 0.12]
    legs = st.Legs(times, gamma, delta - np.array([[0, 0], [0, 0], [1, 0], [1, 1]]))
    motion = st.simulate(scene.model, scene.q0, scene.v0, legs=legs, t_span=0.3)
    told = summary(scene.model, motion)
    for first, side in enumerate(("right_foot", "left_foot")):
        sizes = np.linalg.norm(motion.contact.forces[:, 3 * first : 3 * first + 3], axis=2)
        pushed = sizes.max(axis=1) > 1e-12
        edges = np.flatnonzero(np.diff(pushed)) + 1
        assert len(edges)
        assert told["last_take_off_s"][side] == motion.t[edges[~pushed[edges]]][-1]
        assert told["touching_s"][side] == pytest.approx(
            sum(pushed[:-1]) * (motion.t[1] - motion.t[0])
        )
    assert told["last_take_off_s"]["right_foot"] != told["last_take_off_s"]["left_foot"]


def test_touching_times_by_hand():
    """Feet touch from the start to 0.3, from 0.6 to 0.7, and from 0.9 on; the tail never leaves.

    Then the other way round: the feet are not pushed at the start, but leave the ground later.
    """
    model = scene_of("tail_support_jump").model
    events = [off("feet", 0.3), down("feet", 0.6), off("feet", 0.7), down("feet", 0.9)]
    t, forces = np.linspace(0, 1, 3), np.zeros((3, 18, 3))
    forces[0, [1, 7], 2] = 0.5
    told = summary(model, made(model, at_height(model, 0.1), t=t, forces=forces, events=events))
    assert of_groups(told["touching_s"]) == pytest.approx({"feet": 0.5, "tail": 1.0})
    assert of_groups(told["first_touch_down_s"]) == {"feet": 0.6, "tail": None}
    assert of_groups(told["last_take_off_s"]) == {"feet": 0.7, "tail": None}
    assert told["landed"] is told["landing_group"] is told["recontact_s"] is None
    quiet = made(model, at_height(model, 0.1), t=t, events=events)
    told = summary(model, quiet)["touching_s"]
    assert told == {"feet": pytest.approx(0.5), "tail": 0, "right_foot": 0, "left_foot": 0}


def test_touching_times_of_the_leap(leap):
    """Where the feet's force is not zero, by samples 1 ms apart."""
    told = summary(leap.model, leap)
    for group in ("feet", "tail"):
        pushed = (leap.contact.of(group).forces[..., 2] > 0).any(axis=1).mean() * leap.t[-1]
        assert told["touching_s"][group] == pytest.approx(pushed, abs=0.01)
    assert told["landing_group"] == "feet" and told["landed"] is told["standing_end"] is True


def test_the_landing_of_a_part_of_a_motion(leap):
    """A motion sampled anew has the events of the whole: what is outside does not count."""
    before = leap.resample(leap.t[leap.t < 1.0])
    assert summary(leap.model, before)["landing_group"] is None
    after = leap.resample(leap.t[leap.t > 0.6])
    told = summary(leap.model, after)
    assert told["take_off_s"] is None
    assert told["recontact_s"] == summary(leap.model, leap)["recontact_s"]
    assert told["touching_s"]["feet"] == pytest.approx(1.5 - told["recontact_s"], abs=1e-3)


def test_who_starts_in_the_ground_but_is_not_pushed_flies(rat):
    """Thrown upward, out of the ground that it lies in."""
    points = np.full((3, 6, 3), -1e-3)
    motion = made(rat, at_height(rat, 0.1), points=points, events=[down("feet", 1.5)])
    told = summary(rat, motion)
    assert told["recontact_s"] == 1.5 and of_groups(told["touching_s"]) == {"feet": 0.5}
