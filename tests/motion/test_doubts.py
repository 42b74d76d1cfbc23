"""What cannot be true of an animal is told with its value, against geometry by brute force."""

import dataclasses
import pickle
import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail.motion.plausibility import sunk
from tests.references import contact as reference
from tests.support import zoo
from tests.support.rows import row

from .conftest import at_height, made, scene_of

SEMI_AXES = np.array([0.0315, 0.0495, 0.027])  # m: of the rat's torso, by its inertia
MOUNT, LENGTH = np.array([0, -0.0405, 0.0045]), 0.19466  # m: where its tail begins, how long it is
WEIGHT = (0.10572 + 0.00351) * 9.8


def the(warnings, word):
    """The one warning that begins with a word, and no other."""
    (found,) = [each for each in warnings if each.startswith(word)]
    return found


def millimetres(warnings, word):
    """The depth that such a warning tells."""
    return float(re.search(r": ([\d.]+) mm ", the(warnings, word))[1])


def test_the_kick_is_told_all(kick):
    told = kick.warnings
    assert len(told) == 5
    assert millimetres(told, "torso: ") == pytest.approx(10.7, abs=0.2)
    assert millimetres(told, "tail: 1") == pytest.approx(150, abs=2)
    assert re.search("714 .*t = 0.4 s|t = 0.4 s, 714 ", the(told, "ground: "))
    assert "7.03 rad" in the(told, "tail: segment 1") and the(told, "tail: goes")
    # value, time, limit and remedy
    assert all(re.search(r" at t = [\d.]+ s.*more than [\d.]+.*: \w", each) for each in told)


def test_the_torso_s_depth_by_points_of_its_surface(rat):
    """At random attitudes; the lowest of 40,000 points of the ellipsoid."""
    surface = np.random.default_rng(3).normal(size=(40_000, 3))
    surface *= SEMI_AXES / np.linalg.norm(surface, axis=1, keepdims=True)
    for seed in range(5):
        rotation = Rotation.random(random_state=seed)
        q = at_height(rat, 0.005, 2)
        q[1, 2], q[1, 3:7] = 0.004, np.roll(rotation.as_quat(), 1)
        q[0, 2] = 1.0  # far above
        expected = -1e3 * (rotation.apply(surface)[:, 2].min() + 0.004)
        told = made(rat, q).warnings
        assert millimetres(told, "torso: ") == pytest.approx(expected, rel=0.01)
        assert "t = 1 s" in the(told, "torso: ")


def test_the_depths_of_tail_and_legs_by_hand_and_the_reference(rat):
    """A straight tail that hangs from a torso pitched by 60 degrees; then hip, D and knee, whereas
    ankle and foot are contacts, and may be in the ground.
    """
    q = at_height(rat, 0.15, 1)
    q[0, 3:5] = np.cos(np.pi / 6), np.sin(np.pi / 6)
    tip = reference.attitude(q[0, 3:7]) @ (MOUNT - [0, LENGTH, 0])
    depth = -1e3 * (0.15 + tip[2])
    assert millimetres(made(rat, q).warnings, "tail: ") == pytest.approx(depth, rel=0.01)
    angles = np.radians([210, -40, 210, -75])
    q = at_height(rat, 0.002, 1)
    every = np.array(reference.joints(rat.parameters, angles))
    told, depth = made(rat, q, legs=angles[None]).warnings, -1e3 * (0.002 + every[:, :3, 2].min())
    assert millimetres(told, "legs: ") == pytest.approx(depth, rel=0.01)
    q[0, 2] = -every[:, :3, 2].min()
    assert (every[:, 3:, 2] + q[0, 2]).min() < -0.02
    assert not any("legs" in each for each in made(rat, q, legs=angles[None]).warnings)


def test_a_tenth_of_the_torso_s_length_is_allowed_and_more_where_it_has_contact_or_no_ground(rat):
    """9.9 mm; the straight tail is out of the ground. All samples count, also beyond thousands."""
    for depth, count in ((9.8e-3, 0), (10e-3, 1)):
        assert len(made(rat, SEMI_AXES[2] - depth).warnings) == count
    q = at_height(rat, 1.0, 10_000)
    q[9000, 2] = 0.0
    assert "t = 9000 s" in the(made(rat, q).warnings, "torso: ")
    for model, words in (
        (scene_of("self_recovery").model, []),
        (zoo.model("feet_tail"), ["torso"]),
        (zoo.model("feet"), ["torso", "tail"]),
        (zoo.model("m1_n3"), []),
    ):
        told = made(model, -0.1).warnings
        assert [each.split(":")[0] for each in told] == words
    motion = made(zoo.model("tree_ground"), -0.1)  # each chain for itself
    told = dataclasses.replace(motion, contact=motion.contact.of("leg_right")).warnings
    words = ["torso", "tail", "leg_left", "fin_right", "fin_left", "arm"]
    assert [each.split(":")[0] for each in told[:6]] == words and 'add "leg" to' in told[2]


def through(points, parts=4000):
    """How deep polylines (P, 3) go into the unit ball, by points close together."""
    deepest, left, begin = 0.0, False, min(np.linalg.norm(points[0]), 1)
    for start, end in pairwise(points):
        left |= np.linalg.norm(start) > 1
        line = start + np.linspace(0, 1, parts)[:, None] * (end - start)
        deepest = max(deepest, (1 if left else begin) - np.linalg.norm(line, axis=1).min())
    return deepest


def test_how_deep_a_tail_goes_by_points_close_together():
    for seed in range(5):
        random = np.random.default_rng(seed)
        tails = random.normal(size=(20, 6, 3)) * random.uniform(0.3, 2)
        found = sunk(tails)
        np.testing.assert_allclose(found, [through(tail) for tail in tails], atol=1e-6)
        assert found.any()
    mounts = 0.84 * tails[:, :1] / np.linalg.norm(tails[:, :1], axis=2, keepdims=True)
    assert sunk(np.concatenate([mounts, 4 * mounts], axis=1)).max() == 0  # straight away
    assert sunk(mounts).max() == 0  # no link at all


def test_a_tail_that_comes_back_into_the_torso_is_told(rat):
    """One of three links of 65 mm: the first out, the others folded back by nearly half a turn."""
    q = at_height(rat, 1.0, 2)
    q[1, 7] = 2 * np.pi / 3 * 1.1  # a triangle, whose last link crosses the torso
    q[:, 3:7] = 0.5, 0.7, -0.1, 0.5  # however the torso lies
    points, way = [MOUNT], np.array([0, -LENGTH / 3, 0])
    for _ in range(3):
        way = Rotation.from_rotvec([q[1, 7], 0, 0]).apply(way)
        points.append(points[-1] + way)
    depth = through(np.array(points) / SEMI_AXES)
    found = the(made(rat, q).warnings, "tail: goes")
    assert f"{depth:.2g} of the way" in found and "t = 1 s" in found


def test_blows_beyond_what_legs_of_the_body_s_size_bear(rat):
    """A jumper of 75 kg bears 15.2 body weights, 0.10923 kg so 15.2 (75 / 0.10923)^(1/3) = 134.1,
    and eight times this mass half of that.
    """
    heavy = {name: 8 * rat.parameters[name] for name in ("torso_mass", "tail_mass")}
    for model, most in ((rat, 134.1), (rat.with_parameters(**heavy), 67.05)):
        for share, count in ((0.999, 0), (1.001, 1)):
            forces = np.zeros((3, 6, 3))
            forces[2, :, 2] = share * most * model.parameters["gravity"] / 6
            forces *= sum(model.parameters[name] for name in heavy)
            told = [each for each in made(model, 1.0, forces=forces).warnings if "ground" in each]
            assert len(told) == count
            assert all("t = 2 s" in each and f"than {most:.3g}, which" in each for each in told)


def test_few_drops_push_too_hard():
    """29 tumbling drops from up to half a metre."""
    model, legs = zoo.model("ground"), st.Legs.fixed(np.radians(210), np.radians(-40))
    rng, hard = np.random.default_rng(2), []
    for height in np.linspace(0.05, 0.5, 29):
        q, v = at_height(model, 0.25 + height, 1)[0], np.zeros(model.nv)
        q[3:7], v[3:6] = Rotation.random(random_state=rng).as_quat(), 5 * rng.normal(size=3)
        run = st.simulate(model, q, v, legs=legs, controller=st.Damping(1e-3), t_span=0.5)
        hard += [each for each in run.warnings if "pushes" in each]
    assert len(hard) <= 3


def test_bends_beyond_half_a_turn(rat):
    """Of joints what all links turn together; of arcs the length of (a, b), or theta."""
    along = np.array([np.cos(2.0), np.sin(2.0)])
    for name, segment, bent in (
        *(("m2_n2", 2, [0, -1 / 2]), ("m2_n2", 2, [1 / 2, 0.1]), ("arcs2", 2, along)),
        *(("polar", 1, [0.1, -1]), ("mixed", 1, along), ("mixed", 2, [0.1, 1 / 2])),
    ):
        model = zoo.model(name)
        for bend, expected in ((3.2, []), (3.21, [(str(segment), "3.21", "2")])):
            q = at_height(model, 1.0)
            q[2, 5 + 2 * segment : 7 + 2 * segment] = bend * np.array(bent)
            told = "\n".join(made(model, q).warnings)
            with row(name, segment, bend):
                found = re.findall(r"tail: segment (\d) .* by (\S+) rad at t = (\S+) s", told)
                assert found == expected
    # of more than two turns they are taken for degrees
    for bend, degrees in ((12.5, False), (12.6, True)):
        q = at_height(rat, 1.0)
        q[:, 7] = bend / 3
        assert ("degrees" in the(made(rat, q).warnings, "tail: segment 1")) is degrees


def test_files_and_pickles_keep_what_was_found(kick, rat, tmp_path):
    loaded = st.Trajectory.load(kick.save(tmp_path / "kick.npz"))
    for copy in (loaded, pickle.loads(pickle.dumps(kick))):
        assert copy.model is None and copy.warnings == kick.warnings
    again = st.Trajectory.load(loaded.save(tmp_path / "again.npz"))
    assert again.warnings == kick.warnings and "doubts" not in kick.info
    # of books that do not balance first
    motion = made(rat, 0.0)
    motion.info["warnings"] = ["the books"]
    assert motion.warnings[0] == "the books" and len(motion.warnings) > 1
