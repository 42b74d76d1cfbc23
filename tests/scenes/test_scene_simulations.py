"""The motions of scene files: those of the paper, and what their tables mean."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import serpentail as st
from serpentail.pictures.skeleton import leg_joints
from serpentail_codegen.scene.parse import load_scene
from tests.support.models import folder_of

SCENES = Path(__file__).parents[2] / "scenes"


@cache
def made(name):
    """The generated folder of a scene of the repository."""
    return folder_of(load_scene(SCENES / f"{name}.toml"))


def simulated(name, **changes):
    scene = st.scenario(SCENES / f"{name}.toml", made(name), changes)
    motion = scene.simulate()
    return scene, motion, scene.summary(motion)


# The paper's motions; figures of docs/contact.md.


def test_kick_is_the_papers():
    _, motion, summary = simulated("kick")
    expected = {"take_off_s": (0.404, 1e-3), "com_rise_m": (0.619, 1e-3), "apex_m": (0.632, 2e-3)}
    expected |= {"recontact_s": (1.095, 2e-3), "peak_foot_force_N": (400, 40)}
    for name, (value, tolerance) in expected.items():
        assert summary[name] == pytest.approx(value, abs=tolerance), name
    at = int(np.argmin(np.abs(motion.t - 0.5)))
    pitch = st.pitch_roll_yaw(motion.q, unwrap=True)[:, 0]
    assert pitch[at] == pytest.approx(3.80, abs=0.01) and motion.v[at, 3] == pytest.approx(
        26.2, abs=0.1
    )
    assert pitch[np.argmin(np.abs(motion.t - 1.08))] == pytest.approx(18.7, abs=0.05)
    assert summary["pitch_at_end_rad"] == pitch[-1] and summary["method"] == "ros34pw2"


def test_kick_starts_at_rest():
    scene, motion, _ = simulated("kick")
    before = motion.t < 0.4
    assert (
        np.abs(motion.q[before] - scene.q0).max() < 1e-3 and np.abs(motion.v[before]).max() < 1e-2
    )
    assert np.degrees(st.pitch_roll_yaw(scene.q0)[0]) == pytest.approx(12.8, abs=0.2)
    loads = motion.contact.forces[0, :3, 2]
    assert loads[:2].min() > 5 * loads[2] > 0  # on A and M


def test_less_friction_is_a_parameter():
    assert simulated("kick", mu=0.2)[2]["apex_m"] != pytest.approx(
        simulated("kick")[2]["apex_m"], abs=1e-4
    )
    changed = simulated("kick", **{"legs.moves.0.rate": 60.0, "duration": 0.6})
    assert changed[1].t[-1] == 0.6 and changed[2]["take_off_s"] > simulated("kick")[2]["take_off_s"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tail_support_jump", "tail_support_jump_continuum"])
def test_tail_support_jump_stands_again(name):
    summary = simulated(name)[2]
    assert summary["apex_m"] == pytest.approx(0.647, abs=3e-3)
    assert summary["standing_end"] is True and summary["upright_end"] > 0.9
    passive = simulated(name, controller={"kind": "damping", "damping": 1e-3})[2]
    assert passive["standing_end"] is False and passive["upright_end"] < 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["self_recovery", "self_recovery_continuum"])
def test_self_recovery_stands(name):
    scene, _, summary = simulated(name)
    assert scene.q0[2] == pytest.approx(0.0167, abs=2e-4)
    assert st.rotation_matrix(scene.q0[3:7])[2, 2] < -0.99
    assert summary["standing_end"] is True and summary["upright_end"] == pytest.approx(
        0.976, abs=2e-3
    )
    assert simulated(name, controller={"kind": "damping", "damping": 1e-3})[2]["upright_end"] < 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tail_support_jump", "self_recovery", "self_recovery_continuum"])
def test_without_tail_contact_none_stands(tmp_path, name):
    text = (SCENES / f"{name}.toml").read_text()
    source = tmp_path / f"{name}_without.toml"
    source.write_text(text.replace('"feet", "tail"', '"feet"'))
    scene = st.scenario(source, folder_of(load_scene(source)))
    summary = scene.summary(scene.simulate())
    assert summary["standing_end"] is False and summary["upright_end"] < 0


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_scene_is_sound(path):
    assert load_scene(path).name == path.stem


# Starts, schedules and controllers of tables.


def test_bends_are_shared_among_links(scene):
    path = scene("[simulate.reference]\ntimes = [0.01, 0.02]\nbends = [[0.4], [[0.6]]]\n")
    with pytest.raises(st.SimulationError, match="bends"):
        st.scenario(path)
    given = "[simulate.reference]\ntimes = [0.01, 0.02]\nbends = [[[0.4, -0.2]], [[0.6, 0.0]]]\n"
    given += '[simulate.controller]\nkind = "pfl"\nkp = 1e4\nkd = 200.0\n'
    found = st.scenario(scene(given))
    np.testing.assert_allclose(found.q0[7:], [0.2, -0.1])
    # The quintic's terms, 10, 15 and 6 times a rise of 0.1 rad, cancel at its end. Powers, products
    # and sums round each at most 14 times by 2^-53 of itself: 14 * 3.1 * 2^-53 = 5e-15 rad is left.
    np.testing.assert_allclose(found.controller.curve.at(0.03)[0], [0.3, 0], rtol=0, atol=5e-15)
    assert (found.controller.kp, found.controller.kd) == (1e4, 200)
    assert found.simulate().t[-1] == 0.02


def test_pose_is_yaw_pitch_roll(scene):
    found = st.scenario(scene(), changes={"start.pitch": 0.3, "start.roll": -0.2, "start.yaw": 2.0})
    np.testing.assert_allclose(st.pitch_roll_yaw(found.q0), [0.3, -0.2, 2.0], atol=1e-14)
    np.testing.assert_array_equal(found.q0[:3], [0, 0, 0.1])


def test_controllers_follow_one_another(scene):
    path = scene(
        '[[simulate.controller]]\nbegin = 0.0\nkind = "none"\n'
        '[[simulate.controller]]\nbegin = 0.01\nkind = "torques"\ntimes = [0.0, 1.0]\n'
        "torques = [[1e-4, 0.0], [1e-4, 0.0]]\n"
    )
    motion = st.scenario(path).simulate()
    apart = np.abs(motion.t - 0.01) > 1e-9
    np.testing.assert_allclose(motion.tau[apart, 0], np.where(motion.t < 0.01, 0, 1e-4)[apart])


def test_a_settled_start_is_at_rest(scene):
    found = st.scenario(scene(height="height = 0.05\nsettle = { rounds = 8, duration = 0.25 }"))
    assert found.settings["bristles0"].shape == (8, 2) and not found.v0.any()
    motion = found.simulate()
    assert np.abs(motion.q[-1] - found.q0).max() < 1e-3


def test_a_saved_motion_is_a_reference(scene, tmp_path):
    flight = st.scenario(scene()).simulate()
    flight.save(tmp_path / "flight.npz")
    found = st.scenario(
        scene('[simulate.reference]\nfile = "flight.npz"\n[simulate.controller]\nkind = "pfl"\n')
    )
    np.testing.assert_allclose(
        found.controller.curve.at(0.01)[0], flight.resample([0.01]).tail[0], atol=1e-9
    )


def test_moves_follow_each_other():
    moves = [
        {"at": 0.4, "delta": -1.3, "rate": 70.0},
        {"at": 0.6, "delta": -0.5, "gamma": 3.0, "duration": 0.1},
    ]
    curve = st.Legs.moves(3.6, -0.2, moves).curve
    values, rates, _ = curve.at([0.0, 0.4, 0.5, 0.65, 1.0])
    np.testing.assert_allclose(values[:, 0], [3.6, 3.6, 3.6, 3.3, 3.0])
    np.testing.assert_allclose(values[:, 1], [-0.2, -0.2, -1.3, -0.9, -0.5])
    np.testing.assert_allclose(rates[:, 1], [0, -70, 0, 8, 0], atol=1e-12)
    np.testing.assert_array_equal(values[:, :2], values[:, 2:])
    assert len(curve.times) == 4


# Drawings.


def test_drawn_feet_are_where_the_model_has_them(scene):
    found = st.scenario(scene(), changes={"start.pitch": 0.3, "start.roll": -0.2, "start.yaw": 2.0})
    motion = found.simulate()
    joints = leg_joints(found.model, motion, found.legs.curve.at(motion.t)[0])
    feet = motion.contact.of("feet").points.reshape(-1, 2, 3, 3)
    np.testing.assert_allclose(joints[:, :, 3:], feet, atol=1e-15)


def test_films_have_legs_where_the_model_has_their_joints(scene):
    found = st.scenario(scene())
    motion = found.simulate()
    marks = []
    for _ in range(2):
        (key,) = motion.filmstrip(frames=2)[0].legends
        marks.append([text.get_text() for text in key.get_texts()])
        found.model.kernels.pop("leg_points", None)
    assert "leg" in marks[0] and "leg" not in marks[1]
