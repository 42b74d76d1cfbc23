"""What tells a landing from a tumble, and when feet and tail touch, by motions made by hand."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.model.weight import weight_of
from tests.support import zoo
from tests.support.rows import row

from .conftest import at_height, made, motion, told

LANDS, ROWS = 0.5, 1001  # s of 1
WEIGHT = 1.0705  # N


def fallen(model, rotations, share=1.0, speed=0.0, group="feet"):
    """A motion of 1 s that falls, lands at 0.5 s, and turns as told; at the end a group carries a
    share of its weight, and it falls with a speed (m/s).
    """
    t = np.linspace(0, 1, ROWS)
    q = at_height(model, 0.1, ROWS)
    q[:, 2] += np.maximum(LANDS - t, 0)
    q[:, 3:7] = np.roll(rotations(t).as_quat(), 1, axis=1)
    forces = np.zeros((ROWS, sum(model.contacts.values()), 3))
    groups = [*model.contacts]
    first = sum(model.contacts[name] for name in groups[: groups.index(group)])
    forces[-1, first, 2] = share * WEIGHT
    motion = made(model, q, t=t, forces=forces, events=[("touch_down", group, LANDS)])
    v = motion.v.copy()
    v[-1, 2] = -speed
    return dataclasses.replace(motion, v=v)


def roll(angle):
    return lambda t: Rotation.from_euler("y", angle(np.maximum(t - LANDS, 0))[:, None])


def test_landings_and_tumbles_that_end_on_the_feet(rat):
    """Rocks once by 0.3 rad to and fro: it has turned by 4 * 0.3; then rolls three times; then
    turns a somersault before it lands, which does not count.
    """
    of = told(fallen(rat, roll(lambda s: 0.3 * np.sin(4 * np.pi * s))))
    assert of["recontact_s"] == LANDS and of["landing_group"] == "feet"
    assert of["least_upright_landing"] == pytest.approx(np.cos(0.3), abs=1e-5)
    assert of["turned_landing_rad"] == pytest.approx(1.2, abs=1e-3)
    assert of["standing_end"] is of["landed"] is True
    of = told(fallen(rat, roll(lambda s: 3 * 2 * np.pi * (s / 0.5) ** 2)))
    assert of["standing_end"] is True and of["landed"] is False
    assert of["least_upright_landing"] == pytest.approx(-1, abs=1e-3)
    assert of["turned_landing_rad"] == pytest.approx(6 * np.pi, rel=1e-6)
    assert of["tilt_max_deg"] == pytest.approx(180, abs=2)
    assert of["tilt_end_deg"] == pytest.approx(0, abs=1e-5)
    turn = 2 * np.pi / LANDS
    of = told(fallen(rat, lambda t: Rotation.from_euler("x", turn * np.minimum(t, LANDS)[:, None])))
    assert of["landed"] is True and of["turned_landing_rad"] == pytest.approx(0, abs=1e-6)
    assert of["pitch_at_end_rad"] == pytest.approx(2 * np.pi)


def test_who_does_not_stand_has_not_landed(rat):
    """It stands with more than half of its weight on the feet, slower than 5 cm/s, upright by 0.9:
    the cosine of its tilt.
    """
    for share, speed, up, stands in (
        *((0.7, 0, 1, True), (0.4, 0, 1, False), (0.52, 0, 1, True), (0.48, 0, 1, False)),
        *((1, 0.049, 1, True), (1, 0.051, 1, False), (1, 0, 0.905, True), (1, 0, 0.895, False)),
    ):
        tilt = np.arccos(up)
        of = told(fallen(rat, roll(lambda s, tilt=tilt: 2 * tilt * s), share, speed))
        with row(share, speed, up):
            assert of["least_upright_landing"] == pytest.approx(up)
            assert of["landed"] is of["standing_end"] is stands


def test_a_tree_stands_on_its_limbs_alone():
    tree = zoo.model("tree_ground")
    for group in tree.contacts:
        of = told(
            fallen(tree, roll(lambda s: 0 * s), weight_of(tree.parameters) / WEIGHT, 0, group)
        )
        with row(group):
            assert of["landing_group"] == group
            assert of["landed"] is of["standing_end"] is group.startswith(("leg", "arm"))


def test_the_turn_is_the_integral_of_the_horizontal_angular_velocity(rat):
    """Whatever the motion, with yaw: against rotation vectors between times 25 us apart."""

    def rotations(t):
        angles = [3 * np.sin(7 * t), np.cos(9 * t), 4 * t**2]
        return Rotation.from_euler("ZXY", np.stack(angles, axis=-1))

    after = rotations(np.linspace(LANDS, 1, 20_001))
    turns = (after[1:] * after[:-1].inv()).as_rotvec()
    expected = np.linalg.norm(turns[:, :2], axis=1).sum()
    found = told(fallen(rat, rotations))["turned_landing_rad"]
    assert found == pytest.approx(expected, rel=1e-4)
    assert expected < 0.9 * np.linalg.norm(turns, axis=1).sum()  # yaw is more than a little


def test_each_foot_touches_by_the_forces_at_the_samples(leap):
    """The right foot at samples 1 and 2, the left one from sample 2 on, 0.1 s apart."""
    t, forces = np.linspace(0, 0.5, 6), np.zeros((6, 18, 3))
    forces[1:3, 2, 2], forces[2:, 4, 2], forces[:, 9, 2] = 0.5, 1e-12, 1
    of = told(made(leap.model, t=t, forces=forces))
    names = ("touching_s", "first_touch_down_s", "last_take_off_s")
    right, left = ([of[name][foot] for name in names] for foot in ("right_foot", "left_foot"))
    assert right == pytest.approx([0.2, 0.1, 0.3])
    assert left[:2] == pytest.approx([0.3, 0.2]) and left[2] is None


def test_touching_times_by_hand(leap, rat):
    """Feet touch from the start to 0.3, from 0.6 to 0.7, and from 0.9 on; the tail never leaves.

    Then the other way round: the feet are not pushed at the start, but leave the ground later.
    """
    kinds = ("take_off", "touch_down", "take_off", "touch_down")
    events = [(kind, "feet", t) for kind, t in zip(kinds, (0.3, 0.6, 0.7, 0.9), strict=True)]
    t, forces = np.linspace(0, 1, 3), np.zeros((3, 18, 3))
    forces[0, [1, 7], 2] = 0.5
    of = told(made(leap.model, t=t, forces=forces, events=events))
    feet = {"right_foot": 0.5, "left_foot": 0.0}
    assert of["touching_s"] == pytest.approx({"feet": 0.5, "tail": 1.0} | feet)
    feet = dict.fromkeys(feet)
    assert of["first_touch_down_s"] == {"feet": 0.6, "tail": None} | feet
    assert of["last_take_off_s"] == {"feet": 0.7, "tail": None} | feet | {"right_foot": 0.5}
    assert of["landed"] is of["landing_group"] is of["recontact_s"] is None
    feet = {"right_foot": 0, "left_foot": 0}
    found = told(made(leap.model, t=t, events=events))["touching_s"]
    assert found == pytest.approx({"feet": 0.5, "tail": 0} | feet)
    # in the ground, but not pushed: it flies
    points = np.full((3, 6, 3), -1e-3)
    of = told(made(rat, points=points, events=[("touch_down", "feet", 1.5)]))
    assert of["recontact_s"] == 1.5 and of["touching_s"] == {"feet": 0.5} | feet


def test_the_landing_of_the_leap_and_of_its_parts(leap):
    """A motion sampled anew has the events of the whole: what is outside does not count."""
    of = told(leap)
    assert of["landing_group"] == "feet" and of["landed"] is of["standing_end"] is True
    assert told(leap.resample(leap.t[leap.t < 1.0]))["landing_group"] is None
    after = told(leap.resample(leap.t[leap.t > 0.6]))
    assert after["take_off_s"] is None and after["recontact_s"] == of["recontact_s"]
    assert after["touching_s"]["feet"] == pytest.approx(1.5 - of["recontact_s"], abs=1e-3)


def test_unsound_contacts_are_named():
    points, two = np.zeros((41, 2, 3)), {"feet": 2}
    sound = {"points": points, "forces": points, "bristles": points[..., :2], "groups": two}
    for name, value, words in (
        *(("groups", g, "groups: value") for g in ([], {3: 2}, {"feet": 0}, {"feet": 2.0})),
        ("groups", {"feet": 3}, r"points has shape \(41, 2, 3\): give \(41, 3, 3\)"),
        ("forces", points[:, :1], r"forces has shape \(41, 1, 3\): give \(41, 2, 3\)"),
        ("bristles", points, r"bristles has shape .*: give \(41, 2, 2\)"),
        ("legs", points[:, 0], r"legs has shape \(41, 3\): give \(41, 4\)"),
    ):
        with row(name, words), pytest.raises(ValueError, match=f"contact.{words}"):
            st.Contact(**sound | {name: value})
    with pytest.raises(ValueError, match="contact has 41 samples: give 40"):
        dataclasses.replace(motion(np.arange(40.0)), contact=st.Contact(**sound))
