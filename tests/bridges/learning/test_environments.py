"""Environments are Gymnasium's: many are what each is alone; what they cannot take is refused."""

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import serpentail as st
from tests.support import zoo
from tests.support.rows import row

ACTIONS = np.random.default_rng(1).uniform(-1.2, 1.2, (25, 9, 2))
TASKS = {"righting": "m1_n3", "landing": "ground", "self_recovery": "ground"}
SHORT = {"duration": 0.05, "angle": 100.0}


@pytest.fixture
def flyer():
    return zoo.model("m1_n3")


def many(task, count, **settings):
    return st.environments(zoo.model(TASKS[task]), task, count, **settings)


def test_many_are_what_gymnasium_makes_of_single_ones():
    def single():
        return st.environment(zoo.model(TASKS[task]), task, **SHORT)

    for task in TASKS:
        with row(task):
            check_env(single(), skip_render_check=True)
        ours, theirs = many(task, 9, **SHORT), SyncVectorEnv([single] * 9)
        modes = {each.metadata["autoreset_mode"] for each in (ours, theirs)}
        assert modes == {AutoresetMode.NEXT_STEP}
        for space in ("observation_space", "action_space", "single_observation_space"):
            assert getattr(ours, space) == getattr(theirs, space)
        assert np.array_equal(ours.reset(seed=7)[0], theirs.reset(seed=7)[0])
        for k, action in enumerate(ACTIONS):
            found, expected = ours.step(action), theirs.step(action)
            for one, other in zip(found[:4], expected[:4], strict=True):
                with row(task, k):
                    np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)


def test_seeds_choose_the_starts_and_the_state_what_is_seen_and_rewarded():
    for task in TASKS:
        with row(task):
            worlds = many(task, 5, **SHORT)
            first = worlds.reset(seed=3)[0]
            assert len(np.unique(first, axis=0)) == 5
            assert not np.array_equal(worlds.reset()[0], first)  # goes on drawing
            assert np.array_equal(worlds.reset(seed=3)[0], first)
            assert np.array_equal(worlds.reset(seed=[3, 4, 5, 6, 7])[0], first)
            assert np.array_equal(worlds.reset(seed=[3] * 5)[0][1:], np.tile(first[0], (4, 1)))
            action = ACTIONS[0, :5]
            seen, rewards, *_ = worlds.step(action)
            q, v = worlds.worlds.q, worlds.worlds.v
            up = st.rotation_matrix(q[:, 3:7])[:, 2, :]
            expected = [up, v[:, 3:6], q[:, 2:3], v[:, 2:3], q[:, 7:], v[:, 6:]]
            np.testing.assert_allclose(seen[:, :-1], np.hstack(expected), rtol=1e-5, atol=1e-6)
            expected = (1 + up[:, 2]) / 2 - 0.01 * np.mean(np.clip(action, -1, 1) ** 2, axis=1)
            np.testing.assert_allclose(rewards, expected, atol=1e-12)


def test_an_action_is_a_torque_that_holds(flyer):
    """Cut at 1, under ten times as short steps."""
    more = {"substeps": 8, "spin": 4.0}
    world = st.environment(flyer, "righting", torque="4 mN m", step="0.5 ms", **more)
    world.reset(seed=2)
    q, v = world.worlds.q[0].copy(), world.worlds.v[0].copy()
    assert np.linalg.norm(v[3:6]) > 0
    world.step([0.5, -3.0])
    found = flyer.step(q, v, [0.002, -0.004], 5e-5, steps=80)
    np.testing.assert_allclose(world.worlds.q[0], found[0], atol=1e-8)
    np.testing.assert_allclose(world.worlds.v[0], found[1], atol=1e-6)


def test_episodes_end_by_their_time_by_the_tail_and_where_numbers_end(flyer):
    worlds = st.environments(flyer, "righting", 3, duration=0.05, angle=0.3)
    worlds.reset(seed=0)
    steps = [worlds.step(np.outer([0, 0, 1], [1, 1]))[:4] for _ in range(10)]
    seen, rewards, terminated, truncated = map(np.array, zip(*steps, strict=True))
    assert not terminated[:, :2].any() and list(truncated[:, 0]) == [False] * 9 + [True]
    # the step after an end begins anew, without reward
    after = list(terminated[:, 2]).index(True) + 1
    assert rewards[after, 2] == 0 and not terminated[after, 2] and not truncated[after, 2]
    assert not seen[after, 2, 8:12].any() and seen[after, 2, -1] == 1 and seen[after, 0, -1] < 1
    worlds = st.environments(flyer, "righting", 9)
    worlds.reset(seed=0)
    worlds.worlds.v[3, 6:] = 1e200
    seen, _, terminated, _, _ = worlds.step(np.zeros((9, 2)))
    assert list(terminated.nonzero()[0]) == [3]
    assert np.isfinite(seen).all() and worlds.observation_space.contains(seen)
    seen, *_ = worlds.step(np.zeros((9, 2)))
    assert not seen[3, 8:12].any()


def test_starts_are_spread_as_asked_for(flyer):
    worlds = st.environments(flyer, "righting", 400, tilt="60 deg", spin=5.0, height="70 cm")
    seen, _ = worlds.reset(seed=0)
    tilts, spins = np.arccos(seen[:, 2]), np.linalg.norm(seen[:, 3:6], axis=1)
    for found, most in ((tilts, np.pi / 3), (spins, 5.0)):
        assert 0.95 * most < found.max() <= most * 1.001 and 0.4 < found.mean() / most < 0.6
    assert np.abs(seen[:, :2].mean(axis=0)).max() < 0.1
    np.testing.assert_allclose(seen[:, 6], 0.7, rtol=1e-6)
    lying, walker = many("self_recovery", 50, tilt=0.2), zoo.model("ground")
    seen, _ = lying.reset(seed=0)
    assert (seen[:, 2] < -np.cos(0.3)).all()
    points, _ = walker.contact_points(
        lying.worlds.q, lying.worlds.v, lying.worlds.step_settings["legs"]
    )
    np.testing.assert_allclose(points[..., 2].min(axis=1), 1e-3, atol=1e-9)


REFUSED = [
    *(("task", "cooking", "'righting' or"), ("task", "rihgting", "did you mean 'righting'?")),
    *(("count", 0, "count: value 0"), ("count", 2.5, "count: value 2.5")),
    *(("torque", 0, "torque: value 0"), ("torque", np.nan, "torque: value nan")),
    *(("torque", "2 g", "torque: value '2 g': a mass"), ("step", -1e-3, "step: value -0.001")),
    *(("duration", np.inf, "duration: value inf"), ("tilt", 4, "tilt: value 4: .*0 to 3.14")),
    *(("tilt", 90, 'to 3.14159 rad, or "90 deg"'), ("tilt", 181, "to 3.14159 rad$")),
    *(("spin", "fast", "spin: value 'fast'"), ("spin", -1, "spin: value -1")),
    *(("substeps", 0, "substeps: value 0"), ("substeps", 1001, "substeps: value 1001")),
    ("spins", 1.0, "righting has no setting 'spins'"),
]
MODELS = [
    ("model", 3, "model: value 3"),
    ("task", "landing", "landing: m1_n3 has contacts none: needs 'feet'"),
    ("model", "ground", r"righting: .* needs none.*contacts=\[\]"),
    ("model", "fixed", "righting: fixed has a fixed base"),
    ("model", "bare", "without 'rollout'"),
]


def test_what_is_wrong_is_named(flyer):
    rows = [(*each, st.SimulationError) for each in REFUSED]
    for name, value, words, error in rows + [(*each, st.ModelError) for each in MODELS]:
        changed = zoo.model(value) if name == "model" and value in zoo.ZOO else value
        given = {"model": flyer, "task": "righting", "count": 3} | {name: changed}
        with row(name, value):
            with pytest.raises(error, match=words) as raised:
                st.environments(**given)
            assert "\n" not in str(raised.value)
    worlds = st.environments(flyer, "righting", 3)
    with pytest.raises(st.SimulationError, match=r"call reset\(\) first"):
        worlds.step(np.zeros((3, 2)))
    worlds.reset(seed=0)
    for action, words in (
        (np.zeros((3, 3)), r"action has shape \(3, 3\), not \(3, 2\)"),
        (np.full((3, 2), np.nan), r"action\[0, 0\]: value nan"),
        ("left", "action: value 'left'.*not a text"),
    ):
        with row(words), pytest.raises(st.StateError, match=words):
            worlds.step(action)
    for seed in (-1, 1.5, [1, 2], 2**63):
        with row(seed), pytest.raises(st.SimulationError, match="seed: value"):
            worlds.reset(seed=seed)
    for made in (worlds, st.environment(flyer, "righting")):
        with pytest.raises(st.SimulationError, match="options: value"):
            made.reset(options={"height": 3})
