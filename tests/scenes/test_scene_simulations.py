"""The motions of scene files: those of the paper, those of scaled bodies, what tables mean."""

from functools import cache

import numpy as np
import pytest

import serpentail as st
from serpentail.scenes.plan import plan_arguments
from serpentail.show.animal import leg_joints
from serpentail_codegen.scene.parse import load_scene
from tests.support import zoo
from tests.support.models import folder_of
from tests.support.scenes import SCENES

PASSIVE = {"kind": "damping", "damping": 1e-3}


def simulated(source, folder, changes=None):
    """A scene, its motion, and its summary."""
    scene = st.scenario(source, folder, changes)
    motion = scene.simulate()
    return scene, motion, scene.summary(motion)


@cache
def kick(**changes):
    """The kick of a model that tests share; figures of docs/contact.md."""
    changes = {name.replace("__", "."): value for name, value in changes.items()}
    return simulated(SCENES / "kick.toml", zoo.folder("feet"), changes)


def test_kick_is_the_papers():
    """Sect. 4: it starts at rest, and lands at 1.08 s or so (Eq. 48)."""
    scene, motion, summary = kick()
    expected = {"take_off_s": (0.404, 1e-3), "com_rise_m": (0.619, 1e-3), "apex_m": (0.632, 2e-3)}
    expected |= {"recontact_s": (1.095, 2e-3), "peak_ground_force_s": (0.4, 1e-9)}
    for name, (value, tolerance) in expected.items():
        assert summary[name] == pytest.approx(value, abs=tolerance), name
    of_pairs = np.add(*np.split(motion.contact.of("feet").forces, 2, axis=1))
    assert np.linalg.norm(of_pairs, axis=-1).max() == pytest.approx(400, abs=40)
    pitch = st.pitch_roll_yaw(motion.q, unwrap=True)[:, 0]
    assert pitch[np.argmin(np.abs(motion.t - 0.5))] == pytest.approx(3.80, abs=0.01)
    assert pitch[np.argmin(np.abs(motion.t - 1.08))] == pytest.approx(18.7, abs=0.05)
    assert summary["pitch_at_end_rad"] == pitch[-1]
    before = motion.t < 0.4
    assert np.abs(motion.q[before] - scene.q0).max() < 1e-3
    assert np.abs(motion.v[before]).max() < 1e-2
    loads = motion.contact.forces[0, :3, 2]
    assert loads[:2].min() > 5 * loads[2] > 0  # on A and M


def test_changes_are_of_parameters_and_of_keys():
    assert kick(mu=0.2)[2]["apex_m"] != pytest.approx(kick()[2]["apex_m"], abs=1e-4)
    _, motion, summary = kick(legs__moves__0__rate=60.0, duration=0.6)
    assert motion.t[-1] == 0.6 and summary["take_off_s"] > kick()[2]["take_off_s"]


def test_a_scaled_kick_is_the_kick_at_another_scale(tmp_path):
    """Dynamic similarity: all lengths and times of the motion, on the ground too, are scaled.

    Its model has the size of its own; changes are of the scene as it is written.
    """
    scale, path = 1.6, tmp_path / "kick.toml"
    text = (SCENES / "kick.toml").read_text()
    path.write_text(text.replace("links = 3\n", f"links = 3\nbody = {{ scale = {scale} }}\n", 1))
    scene, b, _ = simulated(path, None)
    a = kick()[1]
    np.testing.assert_allclose(b.t, np.sqrt(scale) * a.t, rtol=1e-14)
    np.testing.assert_allclose(b.q[:, :3], scale * a.q[:, :3], atol=1e-4 * scale)
    np.testing.assert_allclose(b.q[:, 3:], a.q[:, 3:], atol=1e-3)
    # at touch-down the torque jumps within a step: a touch found 10 us later counts as the same
    jump = np.abs(np.gradient(a.tau, axis=0)).max(axis=1, keepdims=True)
    assert (np.abs(b.tau / scale**4 - a.tau) <= 1e-3 * np.abs(a.tau).max() + 0.01 * jump).all()
    assert scene.duration == pytest.approx(scale**0.5 * 1.2)
    assert scene.model.parameters["torso_mass"] == pytest.approx(scale**3 * 0.10572)
    changed = st.scenario(path, changes={"duration": 0.1, "torso_mass": 0.2})
    assert changed.duration == pytest.approx(scale**0.5 * 0.1)
    assert changed.model.parameters["torso_mass"] == 0.2
    path.write_text(path.read_text().replace("mu = 1.0", "mu = 0.3"))  # a folder has its own
    assert st.scenario(path, zoo.folder("feet")).model.parameters["mu"] == 1.0


def test_a_plan_has_the_size_of_its_body():
    table = {"start": {"q": [1.0] * 9, "v": [1.0] * 8}, "duration": [0.5, 1.0]}
    table |= {"bounds": {"torque": 0.02, "angle": 1.0}, "goal": {"torso_rate": [1.0, 0, 0]}}
    found = plan_arguments(table, {"kg": 64.0, "m": 4.0, "s": 2.0})
    q, v = found["start"]
    assert q[:3] == [4.0] * 3 and q[3:] == [1.0] * 6 and v[:3] == [2.0] * 3 and v[3:] == [0.5] * 5
    assert found["duration"] == [1.0, 2.0] and found["bounds"].angle == 1.0
    assert found["bounds"].torque == pytest.approx(256 * 0.02)
    assert tuple(found["goal"].torso_rate) == (0.5, 0.0, 0.0)


def of_scene(name):
    """The generated folder of a scene that no other test needs, and that takes long."""
    return folder_of(load_scene(SCENES / f"{name}.toml"))


@pytest.mark.slow
def test_a_jumping_rat_stands_again_by_its_tail():
    for name in ("tail_support_jump", "tail_support_jump_continuum"):
        path, folder = SCENES / f"{name}.toml", of_scene(name)
        _, _, summary = simulated(path, folder)
        assert summary["apex_m"] == pytest.approx(0.647, abs=3e-3), name
        assert summary["standing_end"] is True and summary["upright_end"] > 0.9, name
        passive = simulated(path, folder, {"controller": PASSIVE})[2]
        assert passive["standing_end"] is False and passive["upright_end"] < 0, name


@pytest.mark.slow
def test_a_rat_on_its_back_stands_up_by_its_tail():
    for name in ("self_recovery", "self_recovery_continuum"):
        path, folder = SCENES / f"{name}.toml", of_scene(name)
        scene, _, summary = simulated(path, folder)
        assert scene.q0[2] == pytest.approx(0.0167, abs=2e-4), name
        assert st.rotation_matrix(scene.q0[3:7])[2, 2] < -0.99, name
        assert summary["standing_end"] is True, name
        assert summary["upright_end"] == pytest.approx(0.976, abs=2e-3), name
    assert simulated(path, folder, {"controller": PASSIVE})[2]["upright_end"] < 0


# Starts, schedules and controllers of tables.


@pytest.mark.slow
def test_a_rat_stands_on_a_slope_that_friction_holds_and_else_slides():
    for mu in (0.8, 0.2):
        scene = st.scenario("slope", changes={"mu": mu})
        assert st.summary(scene.model, scene.simulate())["standing_end"] == (mu > np.tan(0.35))


def test_bends_are_shared_among_links(scenario):
    times = "[simulate.reference]\ntimes = [0.01, 0.02]\n"
    with pytest.raises(st.SimulationError, match="bends"):
        scenario(times + "bends = [[0.4], [[0.6]]]\n")
    law = '[simulate.controller]\nkind = "pfl"\nkp = 1e4\nkd = 200.0\n'
    found = scenario(f"{times}bends = [[[0.6, -0.3]], [[0.9, 0.0]]]\n{law}")
    np.testing.assert_allclose(found.q0[7:], [0.2, -0.1], rtol=1e-15)
    # The quintic's terms, 10, 15 and 6 times a rise of 0.1 rad, cancel at its end. Powers, products
    # and sums round each at most 14 times by 2^-53 of itself: 14 * 3.1 * 2^-53 = 5e-15 rad is left.
    np.testing.assert_allclose(found.controller.curve.at(0.03)[0], [0.3, 0], rtol=0, atol=5e-15)
    assert (found.controller.kp, found.controller.kd) == (1e4, 200)
    assert found.simulate().t[-1] == 0.02


def test_controllers_follow_one_another(scenario):
    motion = scenario(
        '[[simulate.controller]]\nbegin = 0.0\nkind = "none"\n'
        '[[simulate.controller]]\nbegin = 0.01\nkind = "torques"\ntimes = [0.0, 1.0]\n'
        "torques = [[1e-4, 0.0], [1e-4, 0.0]]\n"
    ).simulate()
    apart = np.abs(motion.t - 0.01) > 1e-9
    np.testing.assert_allclose(motion.tau[apart, 0], np.where(motion.t < 0.01, 0, 1e-4)[apart])


def test_a_saved_motion_is_a_reference(scenario, tmp_path):
    flight = scenario().simulate()
    flight.save(tmp_path / "flight.npz")
    table = '[simulate.reference]\nfile = "flight.npz"\n[simulate.controller]\nkind = "pfl"\n'
    curve, expected = scenario(table).controller.curve, flight.resample([0.01]).tail[0]
    np.testing.assert_allclose(curve.at(0.01)[0], expected, atol=1e-9)


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


def test_a_pose_is_yaw_pitch_roll_and_legs_are_drawn_there(scenario):
    found = scenario(changes={"start.pitch": 0.3, "start.roll": -0.2, "start.yaw": 2.0})
    np.testing.assert_allclose(st.pitch_roll_yaw(found.q0), [0.3, -0.2, 2.0], atol=1e-14)
    np.testing.assert_array_equal(found.q0[:3], [0, 0, 0.1])
    motion = found.simulate()
    joints = leg_joints(found.model, motion, found.legs.curve.at(motion.t)[0])
    feet = motion.contact.of("feet").points.reshape(-1, 2, 3, 3)
    np.testing.assert_allclose(joints[:, :, 3:], feet, atol=1e-15)

    # only where the model has their joints
    for drawn in (True, False):
        (key,) = motion.filmstrip(frames=2)[0].legends
        assert ("leg" in [text.get_text() for text in key.get_texts()]) is drawn
        found.model.kernels.pop("leg_points", None)
