"""Environments are Gymnasium's: its checker finds nothing, and many are what each is alone."""

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import serpentail as st

TASKS = ("righting", "landing", "self_recovery")
SHORT = {"duration": 0.05, "angle": 100.0}
every_task = pytest.mark.parametrize("task", TASKS)


def actions(rounds, count, nt, seed=1):
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (rounds, count, nt))


@every_task
def test_the_checker_of_gymnasium_finds_nothing(of_task, task):
    check_env(st.environment(of_task(task), task, **SHORT), skip_render_check=True)


@every_task
def test_many_are_what_gymnasium_makes_of_single_ones(of_task, task):
    """Seeds, observations, rewards, ends and new beginnings, step by step."""
    model, count = of_task(task), 9
    ours = st.environments(model, task, count, **SHORT)
    theirs = SyncVectorEnv([lambda: st.environment(model, task, **SHORT)] * count)
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    assert ours.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    for name in ("observation_space", "action_space", "single_observation_space"):
        assert getattr(ours, name) == getattr(theirs, name)
    seen, expected = ours.reset(seed=7)[0], theirs.reset(seed=7)[0]
    assert np.array_equal(seen, expected)
    for action in actions(25, count, 2 * model.segments):
        found, expected = ours.step(action), theirs.step(action)
        for one, other in zip(found[:4], expected[:4], strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)


@every_task
def test_seeds_choose_the_starts(of_task, task):
    worlds = st.environments(of_task(task), task, 5, **SHORT)
    first = worlds.reset(seed=3)[0]
    assert len(np.unique(first, axis=0)) == 5
    assert not np.array_equal(worlds.reset()[0], first)  # goes on drawing
    assert np.array_equal(worlds.reset(seed=3)[0], first)
    assert np.array_equal(worlds.reset(seed=[3, 4, 5, 6, 7])[0], first)
    assert np.array_equal(worlds.reset(seed=[3] * 5)[0][1:], np.tile(first[0], (4, 1)))


@every_task
def test_what_is_seen_and_rewarded_is_of_the_state(of_task, task):
    worlds = st.environments(of_task(task), task, 6, **SHORT)
    worlds.reset(seed=0)
    action = actions(1, 6, 2 * of_task(task).segments)[0]
    seen, rewards, *_ = worlds.step(action)
    q, v = worlds.worlds.q, worlds.worlds.v
    up = st.rotation_matrix(q[:, 3:7])[:, 2, :]
    expected = [up, v[:, 3:6], q[:, 2:3], v[:, 2:3], q[:, 7:], v[:, 6:]]
    np.testing.assert_allclose(seen[:, :-1], np.hstack(expected), rtol=1e-5, atol=1e-6)
    effort = np.mean(np.clip(action, -1, 1) ** 2, axis=1)
    np.testing.assert_allclose(rewards, (1 + up[:, 2]) / 2 - 0.01 * effort, atol=1e-12)


def test_an_action_is_a_torque_that_holds(flyer):
    """Cut at 1, under ten times as short steps."""
    world = st.environment(flyer, "righting", torque=0.004, step=5e-4, substeps=8, spin=4.0)
    world.reset(seed=2)
    q, v = world.worlds.q[0].copy(), world.worlds.v[0].copy()
    assert np.linalg.norm(v[3:6]) > 0
    world.step([0.5, -3.0])
    found = flyer.step(q, v, [0.002, -0.004], 5e-5, steps=80)
    np.testing.assert_allclose(world.worlds.q[0], found[0], atol=1e-8)
    np.testing.assert_allclose(world.worlds.v[0], found[1], atol=1e-6)


def test_episodes_end_by_their_time_and_by_the_tail(flyer):
    worlds = st.environments(flyer, "righting", 4, duration=0.05, angle=0.3)
    worlds.reset(seed=0)
    ends = []
    for _ in range(10):
        _, rewards, terminated, truncated, _ = worlds.step(np.outer([0, 0, 1, 1], [1, 1]))
        ends.append((terminated.copy(), truncated.copy()))
    assert all(not t[:2].any() for t, _ in ends)
    assert [bool(o[0]) for _, o in ends] == [False] * 9 + [True]
    bent = [bool(t[2]) for t, _ in ends]
    assert any(bent)
    # the step after an end begins anew, without reward
    worlds.reset(seed=0)
    for _ in range(bent.index(True) + 1):
        worlds.step(np.outer([0, 0, 1, 1], [1, 1]))
    seen, rewards, terminated, truncated, _ = worlds.step(np.outer([0, 0, 1, 1], [1, 1]))
    assert rewards[2] == 0 and not terminated[2] and not truncated[2]
    assert not seen[2, 8:12].any() and seen[2, -1] == 1 and seen[0, -1] < 1


def test_a_world_that_leaves_what_numbers_hold_ends_alone(flyer):
    worlds = st.environments(flyer, "righting", 9)
    worlds.reset(seed=0)
    worlds.worlds.v[3, 6:] = 1e200
    seen, _, terminated, _, _ = worlds.step(np.zeros((9, 2)))
    assert list(terminated.nonzero()[0]) == [3]
    assert np.isfinite(seen).all() and worlds.observation_space.contains(seen)
    seen, *_ = worlds.step(np.zeros((9, 2)))
    assert not seen[3, 8:12].any()


def test_starts_are_spread_as_asked_for(flyer, walker):
    worlds = st.environments(flyer, "righting", 400, tilt=1.0, spin=5.0, height=0.7)
    seen, _ = worlds.reset(seed=0)
    tilts, spins = np.arccos(seen[:, 2]), np.linalg.norm(seen[:, 3:6], axis=1)
    for found, most in ((tilts, 1.0), (spins, 5.0)):
        assert 0.95 * most < found.max() <= most * 1.001 and 0.4 < found.mean() / most < 0.6
    assert np.abs(seen[:, :2].mean(axis=0)).max() < 0.1
    np.testing.assert_allclose(seen[:, 6], 0.7, rtol=1e-6)
    lying = st.environments(walker, "self_recovery", 50, tilt=0.2)
    seen, _ = lying.reset(seed=0)
    assert (seen[:, 2] < -np.cos(0.3)).all()
    points, _ = walker.contact_points(lying.worlds.q, lying.worlds.v, lying.worlds.given["legs"])
    np.testing.assert_allclose(points[..., 2].min(axis=1), 1e-3, atol=1e-9)


def test_settings_may_be_texts_with_units(flyer):
    texts = {"torque": "20 mN m", "tilt": "90 deg", "step": "1 ms", "height": "30 cm"}
    plain = {"torque": 0.02, "tilt": np.pi / 2, "step": 1e-3, "height": 0.3}
    first, second = (st.environments(flyer, "righting", 3, **each) for each in (texts, plain))
    np.testing.assert_array_equal(first.reset(seed=1)[0], second.reset(seed=1)[0])
    actions = np.full((3, flyer.layout.nt), 0.5)
    np.testing.assert_array_equal(first.step(actions)[0], second.step(actions)[0])
