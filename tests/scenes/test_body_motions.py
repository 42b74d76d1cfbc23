"""Motions of scaled bodies: those of the scene, in another size."""

import numpy as np
import pytest

import serpentail as st
from tests.scenes.test_scene_simulations import SCENES


def kick(tmp_path, body):
    """The kick of a body."""
    text = (SCENES / "kick.toml").read_text()
    path = tmp_path / "kick.toml"
    path.write_text(text.replace("links = 3\n", f"links = 3\n{body}\n", 1))
    return st.scenario(path)


@pytest.mark.parametrize("scale", [0.3, 1.6])
def test_a_scaled_kick_is_the_kick_at_another_scale(tmp_path, scale):
    """Dynamic similarity: all lengths and times of the motion, on the ground too, are scaled."""
    one, other = kick(tmp_path, ""), kick(tmp_path, f"body = {{ scale = {scale} }}")
    a, b = one.simulate(), other.simulate()
    np.testing.assert_allclose(b.t, np.sqrt(scale) * a.t, rtol=1e-14)
    np.testing.assert_allclose(b.q[:, :3], scale * a.q[:, :3], atol=1e-4 * scale)
    np.testing.assert_allclose(b.q[:, 3:], a.q[:, 3:], atol=1e-3)
    np.testing.assert_allclose(b.tau, scale**4 * a.tau, atol=1e-3 * scale**4 * np.abs(a.tau).max())


def test_changes_are_of_the_scene_as_it_is_written(tmp_path):
    scene = kick(tmp_path, "body = { scale = 4.0 }")
    assert scene.duration == pytest.approx(2 * 1.2)
    path = tmp_path / "kick.toml"
    assert st.scenario(path, changes={"duration": 0.1}).duration == pytest.approx(0.2)
    assert st.scenario(path, changes={"torso_mass": 0.2}).model.parameters["torso_mass"] == 0.2
    assert scene.model.parameters["torso_mass"] == pytest.approx(64 * 0.10572)


def test_a_plan_has_the_size_of_its_body():
    from serpentail.scenes.plan import plan_arguments

    table = {"start": {"q": [1.0] * 9, "v": [1.0] * 8}, "duration": [0.5, 1.0]}
    table |= {"bounds": {"torque": 0.02, "angle": 1.0}, "goal": {"torso_rate": [1.0, 0, 0]}}
    found = plan_arguments(table, {"kg": 64.0, "m": 4.0, "s": 2.0})
    q, v = found["start"]
    assert q[:3] == [4.0] * 3 and q[3:] == [1.0] * 6 and v[:3] == [2.0] * 3 and v[3:] == [0.5] * 5
    assert found["duration"] == [1.0, 2.0] and found["bounds"].angle == 1.0
    assert found["bounds"].torque == pytest.approx(256 * 0.02)
    assert tuple(found["goal"].torso_rate) == (0.5, 0.0, 0.0)
