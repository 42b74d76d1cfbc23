"""What tells a landing from a tumble: motions made by hand, and one whose animal falls on its back
and rolls onto its feet; touches by events.
"""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.motion.summary import summary
from tests.support.rows import row

from .conftest import at_height, down, made, off, scene_of

LANDS, ROWS = 0.5, 1001  # s of 1
WEIGHT = 1.0705  # N


def fallen(model, rotations, share=1.0, speed=0.0):
    """A motion of 1 s that falls, lands at 0.5 s, and turns as told; at the end its feet carry a
    share of its weight, and it falls with a speed (m/s).
    """
    t = np.linspace(0, 1, ROWS)
    q = at_height(model, 0.1, ROWS)
    q[:, 2] += np.maximum(LANDS - t, 0)
    q[:, 3:7] = np.roll(rotations(t).as_quat(), 1, axis=1)
    forces = np.zeros((ROWS, sum(model.contacts.values()), 3))
    forces[-1, 0, 2] = share * WEIGHT
    motion = made(model, q, t=t, forces=forces, events=[down("feet", LANDS)])
    v = motion.v.copy()
    v[-1, 2] = -speed
    return dataclasses.replace(motion, v=v)


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
    """It stands with more than half of its weight on the feet, slower than 5 cm/s, upright by 0.9:
    the cosine of its tilt.
    """
    for share, speed, up, stands in (
        *((0.7, 0, 1, True), (0.4, 0, 1, False), (0.52, 0, 1, True), (0.48, 0, 1, False)),
        *((1, 0.049, 1, True), (1, 0.051, 1, False), (1, 0, 0.905, True), (1, 0, 0.895, False)),
    ):
        tilt = np.arccos(up)
        told = summary(rat, fallen(rat, roll(lambda s, tilt=tilt: 2 * tilt * s), share, speed))
        with row(share, speed, up):
            assert told["least_upright_landing"] == pytest.approx(up)
            assert told["landed"] is told["standing_end"] is stands


def test_a_somersault_before_the_landing_does_not_count(rat):
    def before(t):
        return Rotation.from_euler("x", 2 * np.pi * np.minimum(t / LANDS, 1)[:, None])

    told = summary(rat, fallen(rat, before))
    assert told["landed"] is True and told["turned_landing_rad"] == pytest.approx(0, abs=1e-6)
    assert told["pitch_at_end_rad"] == pytest.approx(2 * np.pi)


def test_the_turn_is_the_integral_of_the_horizontal_angular_velocity(rat):
    """Whatever the motion, with yaw: against rotation vectors between times 25 us apart."""

    def rotations(t):
        angles = [3 * np.sin(7 * t), np.cos(9 * t), 4 * t**2]
        return Rotation.from_euler("ZXY", np.stack(angles, axis=-1))

    told = summary(rat, fallen(rat, rotations))
    after = rotations(np.linspace(LANDS, 1, 20_001))
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
    attitudes = Rotation.from_quat(np.roll(motion.q[turning, 3:7], -1, 1))
    level = np.linalg.norm(attitudes.apply(motion.v[turning, 3:6])[:, :2], axis=1)
    wanted = np.trapezoid(level, motion.t[turning])
    assert told["turned_landing_rad"] == pytest.approx(wanted, rel=0.02)


# Touches.


def of_groups(told):
    """Return what is told of groups, without the single feet."""
    return {name: value for name, value in told.items() if "_foot" not in name}


def test_each_foot_touches_by_the_forces_at_the_samples(leap):
    """The right foot at samples 1 and 2, the left one from sample 2 on, 0.1 s apart."""
    model = leap.model
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
        spans = sum(pushed[:-1]) * (motion.t[1] - motion.t[0])
        assert told["touching_s"][side] == pytest.approx(spans)
    assert told["last_take_off_s"]["right_foot"] != told["last_take_off_s"]["left_foot"]


def test_touching_times_by_hand(leap, rat):
    """Feet touch from the start to 0.3, from 0.6 to 0.7, and from 0.9 on; the tail never leaves.

    Then the other way round: the feet are not pushed at the start, but leave the ground later.
    """
    model = leap.model
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
    # in the ground, but not pushed: it flies
    points = np.full((3, 6, 3), -1e-3)
    motion = made(rat, at_height(rat, 0.1), points=points, events=[down("feet", 1.5)])
    told = summary(rat, motion)
    assert told["recontact_s"] == 1.5 and of_groups(told["touching_s"]) == {"feet": 0.5}


def test_the_landing_of_the_leap_and_of_its_parts(leap):
    """Where a group's force is not zero, by samples 1 ms apart. A motion sampled anew has the
    events of the whole: what is outside does not count.
    """
    told = summary(leap.model, leap)
    for group in ("feet", "tail"):
        pushed = (leap.contact.of(group).forces[..., 2] > 0).any(axis=1).mean() * leap.t[-1]
        assert told["touching_s"][group] == pytest.approx(pushed, abs=0.01)
    assert told["landing_group"] == "feet" and told["landed"] is told["standing_end"] is True
    before = leap.resample(leap.t[leap.t < 1.0])
    assert summary(leap.model, before)["landing_group"] is None
    after = summary(leap.model, leap.resample(leap.t[leap.t > 0.6]))
    assert after["take_off_s"] is None and after["recontact_s"] == told["recontact_s"]
    assert after["touching_s"]["feet"] == pytest.approx(1.5 - told["recontact_s"], abs=1e-3)
