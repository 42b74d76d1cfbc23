"""Trajectories, their files, and motions between samples; products and angles of attitudes."""

import dataclasses
import itertools
import json
import zipfile
from contextlib import nullcontext

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from serpentail.basics.attitude import pitch_roll_yaw, product, quaternion_rate, rotation_matrix
from serpentail.motion.trajectory import Trajectory
from tests.support.rows import row

from .conftest import fields, motion

FLIGHT = motion(np.linspace(0, 0.4, 41))
A, B = np.random.default_rng(5).normal(size=(2, 7, 4))  # quaternions


def near(found, expected, most):
    np.testing.assert_allclose(found, expected, rtol=0, atol=most)


def assert_same(first, second):
    """Every array bit-equal, every info equal."""
    for name, value in fields(first).items():
        other = getattr(second, name)
        if name == "info":
            assert value == other
        else:
            assert value.dtype == other.dtype == np.float64
            assert value.tobytes() == other.tobytes() and value.shape == other.shape


def test_fields_are_private_and_read_only():
    assert FLIGHT.segments == 2
    for name, expected in {
        **{"energy": FLIGHT.kinetic + FLIGHT.potential, "attitude": FLIGHT.q[:, 3:7]},
        **{"tail": FLIGHT.q[:, 7:], "tail_rate": FLIGHT.v[:, 6:]},
    }.items():
        np.testing.assert_array_equal(getattr(FLIGHT, name), expected)
    given = fields(FLIGHT)
    given = {name: value if name == "info" else value.copy() for name, value in given.items()}
    trajectory = Trajectory(**given)
    given["q"][0, 0] = 99
    given["info"]["parameters"]["gravity"] = 0
    assert trajectory.q[0, 0] == 0 and trajectory.info["parameters"]["gravity"] == 9.8
    with pytest.raises(ValueError, match="read-only"):
        trajectory.v[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        trajectory.t = given["t"]


def test_unsound_fields_are_named():
    given = fields(FLIGHT)
    for name, change, words in (
        *(("t", lambda t: t[:0], r"t .*\(0,\)"), ("t", lambda t: t[:, None], r"t .*\(41, 1\)")),
        ("t", lambda t: t[::-1], r"t\[1\] = 0\.39 .*0\.4"),
        ("t", lambda t: np.minimum(t, 0.2), r"t\[21\] = 0\.2 .*0\.2"),
        ("q", lambda q: q[:, :-1], r"q .*\(41, 10\).*\(41, 7 \+ nt\)"),
        ("q", lambda q: q[0], r"q .*\(11,\)"),
        ("q", lambda q: q[1:], r"q .*\(40, 11\): give \(41, 11\)"),
        ("q", lambda q: 2 * q, r"q\[\d+, 3:7\] .*norm 2"),
        ("q", lambda q: q * 1j, "q: .*complex128"),
        ("v", lambda v: v[:, 1:], r"v .*\(41, 9\): give \(41, 10\)"),
        ("v", lambda v: np.where(v > 0, np.nan, v), r"v\[0, 1\]: value nan"),
        ("v", lambda v: np.ma.masked_greater(v, 3.0), r"v: \d+ masked"),
        ("tau", lambda tau: tau[:, :0], r"tau .*\(41, 0\): give \(41, 4\)"),
        ("kinetic", lambda kinetic: kinetic[:, None], r"kinetic .*\(41, 1\): give \(41,\)"),
        ("potential", lambda potential: potential[:-1], r"potential .*\(40,\): give \(41,\)"),
        ("linear_momentum", lambda p: p.T, r"linear_momentum .*\(3, 41\): give \(41, 3\)"),
        ("angular_momentum", lambda h: h * np.inf, r"angular_momentum\[0, 0\]: value inf"),
        ("info", lambda info: info | {"seconds": np.nan}, "info .*JSON"),
        ("info", lambda info: info | {"seconds": np.zeros(2)}, "info .*JSON"),
        ("info", lambda info: [info], "info .*list"),
        *(
            ("info", lambda i, n=n: i | {n: 3}, f"^info.'{n}'. has value 3")
            for n in ("warnings", "doubts")
        ),
        ("info", lambda info: info | {"phases": ["x"]}, "'phases'.*list of tables"),
        ("info", lambda info: info | {"events": [{"time": 1}]}, "'events'.*time, group, kind"),
    ):
        with row(name, words), pytest.raises(ValueError, match=words):
            Trajectory(**given | {name: change(given[name])})

    # quaternions may drift from unit norm by a thousandth
    q = FLIGHT.q.copy()
    for size in (1 - 2e-3, 1 + 2e-3, 1 - 9e-4, 1 + 9e-4):
        q[7, 3:7] = size * FLIGHT.q[7, 3:7]
        refused = pytest.raises(ValueError, match=r"q\[7, 3:7\] has norm")
        with row(size), refused if abs(size - 1) > 1e-3 else nullcontext():
            dataclasses.replace(FLIGHT, q=q)


def test_load_returns_what_was_saved_bit_by_bit(tmp_path):
    """Equal motions make equal files; the suffix is added to any name."""
    path = tmp_path / "new" / "run.v2.npz"
    times = np.sort(np.random.default_rng(1).uniform(0, 1, 57))
    for segments in (0, 1, 3):
        trajectory = motion(times, segments)
        assert trajectory.save(path) == trajectory.save(str(path.with_suffix(""))) == path
        assert_same(trajectory, Trajectory.load(path.with_suffix("")))
        assert Trajectory.load(path).segments == segments
        assert trajectory.save(tmp_path / "other").read_bytes() == path.read_bytes()
    with pytest.raises(FileNotFoundError, match=r"gone\.npz"):
        Trajectory.load(tmp_path / "gone")


def test_a_flipped_byte_or_a_cut_is_an_error_or_harmless(tmp_path):
    trajectory = motion(np.linspace(0, 0.02, 3), segments=1)
    path = trajectory.save(tmp_path / "run")
    whole, refusals = path.read_bytes(), []
    places = range(0, len(whole), 8)
    for place in places:
        flipped = bytearray(whole)
        flipped[place] ^= 0x55
        for content in (flipped, whole[:place], whole[place:] if place else flipped):
            path.write_bytes(content)
            try:
                loaded = Trajectory.load(path)
            except ValueError as error:
                refusals.append(str(error))
            else:
                assert_same(trajectory, loaded)
    assert len(refusals) > 2.25 * len(places)
    assert all("run.npz" in refusal and refusal.isprintable() for refusal in refusals)


def test_other_files_are_refused_without_unpickling_or_filling_the_memory(tmp_path):
    own, great = fields(FLIGHT), np.zeros(10_000_000)
    np.savez(tmp_path / "other.npz", t=FLIGHT.t)
    np.savez(tmp_path / "pickle.npz", **own | {"info": np.array([{}], dtype=object)})
    np.savez(tmp_path / "short.npz", **own | {"info": json.dumps({}), "v": FLIGHT.v[1:]})
    np.savez(tmp_path / "deep.npz", **own | {"info": "[" * 100_000})
    for name, value in {"groups": "{}", "points": np.zeros((41, 1, 3))}.items():  # but no others
        np.savez(tmp_path / f"{name}.npz", **own | {"info": "{}", f"contact_{name}": value})
    np.savez_compressed(tmp_path / "bomb.npz", **own | {"kinetic": great, "info": "{}"})
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1152921504606846,)}\n"
    lie = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    with (
        zipfile.ZipFile(tmp_path / "short.npz") as whole,
        zipfile.ZipFile(tmp_path / "lie.npz", "w") as lying,
    ):
        for name in whole.namelist():  # q tells of more numbers than there are
            lying.writestr(name, lie if name == "q.npy" else whole.read(name))
    for name, content in (("empty", b""), ("text", b"no zip"), ("cut", b"PK\x03\x04" + bytes(200))):
        (tmp_path / f"{name}.npz").write_bytes(content)
    words = {
        "other": "not a trajectory: .*q",
        "short": "v has shape",
        "bomb": r"damaged .*0\.08 GB",
        **dict.fromkeys(("deep", "groups", "points"), "not hold a valid trajectory: "),
    }
    for name in (*words, "pickle", "lie", "empty", "text", "cut"):
        match = rf"{name}\.npz' .*{words.get(name, 'damaged')}"
        with row(name), pytest.raises(ValueError, match=match):
            Trajectory.load(tmp_path / f"{name}.npz")
    np.savez_compressed(tmp_path / "small.npz", **own | {"info": "{}"})
    assert_same(dataclasses.replace(FLIGHT, info={}), Trajectory.load(tmp_path / "small.npz"))


def test_resample_reproduces_the_samples():
    again = fields(FLIGHT.resample(FLIGHT.t))
    for name, wanted in fields(FLIGHT).items():
        if name == "info":
            assert again[name] == wanted
        else:
            rtol = 0 if name in ("t", "q", "tau") else 1e-14
            np.testing.assert_allclose(again[name], wanted, rtol=rtol, atol=4e-16)


def test_resample_converges_to_the_free_top_and_the_sines():
    """Largest errors of attitude (rad), tail and velocities."""
    fine, errors = motion(np.linspace(0, 0.4, 1234)), []
    for samples in (41, 81):
        found = motion(np.linspace(0, 0.4, samples)).resample(fine.t)
        turn = rotation_matrix(fine.attitude).swapaxes(1, 2) @ rotation_matrix(found.attitude)
        angle = np.linalg.norm(turn - np.eye(3), axis=(1, 2)).max() / np.sqrt(2)
        tail, v = (np.abs(getattr(found, n) - getattr(fine, n)).max() for n in ("tail", "v"))
        errors.append([angle, tail, v])
    orders = np.log2(np.divide(*errors))
    np.testing.assert_allclose(orders[:2], 4, atol=0.1)
    assert orders[2] > 3.5 and errors[0][2] < 1e-3 and errors[0][0] < 2e-5


def test_resample_is_exact_for_a_parabola_of_linear_torque_and_does_not_overshoot():
    t = np.linspace(0, 0.4, 997)
    dense = FLIGHT.resample(t)
    near(dense.q[:, :3], motion(t).q[:, :3], 1e-15)
    near(dense.v[:, :3], motion(t).v[:, :3], 1e-14)
    near(np.linalg.norm(dense.attitude, axis=1), 1, 4e-16)
    near(dense.tau.T, [np.interp(t, FLIGHT.t, column) for column in FLIGHT.tau.T], 1e-14)
    step = np.where(FLIGHT.t < 0.2, 0.0, 1.0)
    energy = dataclasses.replace(FLIGHT, kinetic=step).resample(t).kinetic
    assert energy.min() == 0 and energy.max() == 1
    # whatever the signs of the quaternions
    q = FLIGHT.q.copy()
    q[1:, 3:7] *= np.random.default_rng(2).choice([-1.0, 1.0], len(q) - 1)[:, None]
    np.testing.assert_array_equal(dataclasses.replace(FLIGHT, q=q).resample(t).q, dense.q)


def test_no_motion_goes_on_beyond_its_samples():
    """The first time outside is named; what rounding adds at the ends is inside."""
    for t, words in (
        *(([0.1, 0.5, 0.6], "t = 0.5 s .* 0.0 to 0.4"), ([-0.25, 0.1], "t = -0.25 s")),
        *((t, "^t") for t in ([], [0.2, 0.1], [[0.1, 0.2]], [np.nan], 0.1)),
    ):
        with row(t), pytest.raises(ValueError, match=words):
            FLIGHT.resample(t)
    for samples, beyond in itertools.product((1, 2, 41), (-1e-9, 0.4 + 1e-9, 1e9, -1e300)):
        short = motion(np.linspace(0.4, 0, samples)[::-1])
        for t in ([beyond], sorted([0.4, beyond])):
            with row(samples, t), pytest.raises(ValueError, match="outside"):
                short.resample(t)
    assert FLIGHT.resample([0.0, np.nextafter(0.4, 1)]).t[-1] == 0.4
    # one sample and no tail will do
    alone = motion(np.array([0.1]), segments=0)
    again = alone.resample([0.1])
    near(again.q, alone.q, 4e-16)
    assert_same(dataclasses.replace(again, q=alone.q), alone)
    assert motion(np.linspace(0, 1, 101), segments=0).resample([0.5]).tau.shape == (1, 0)


# Attitudes.


def scipys(quaternion):
    """The rotations of quaternions (w, x, y, z)."""
    return Rotation.from_quat(np.roll(quaternion.reshape(-1, 4), -1, axis=-1))


def euler(angles):
    """R = Rz(phi_z) Rx(phi_x) Ry(phi_y) of angles (..., 3) ordered x, y, z."""
    return Rotation.from_euler("ZXY", angles[..., [2, 0, 1]].reshape(-1, 3)).as_matrix()


def configurations(quaternion):
    """Configurations (..., 7) with these attitudes."""
    return np.concatenate([np.zeros((*quaternion.shape[:-1], 3)), quaternion], axis=-1)


def test_a_product_turns_as_one_rotation_after_the_other_and_a_rate_is_half_of_one():
    entries = np.stack(product(A.T, B.T), axis=-1)
    near(rotation_matrix(entries), (scipys(A) * scipys(B)).as_matrix(), 1e-14)
    norms = np.linalg.norm(A, axis=-1) * np.linalg.norm(B, axis=-1)
    np.testing.assert_allclose(np.linalg.norm(entries, axis=-1), norms, rtol=1e-14)
    one, i, j, k = np.eye(4)
    for a, b, expected in ((i, j, k), (j, k, i), (k, i, j), (i, i, -one), (j, i, -k)):
        np.testing.assert_array_equal(product(a, b), expected)
    # a rate is half the product with the angular velocity in the body's axes
    still = np.array([0.0, 1.0, 1.0, 1.0]) * B
    near(quaternion_rate(A.T, B.T[1:]), np.array(product(A.T, still.T)) / 2, 1e-14)


def test_angles_invert_the_product_of_rotations():
    """Of any shape, about single axes, and near the pitch where roll and yaw are not unique."""
    quaternion = np.random.default_rng(4).normal(size=(5, 200, 4))
    rotation = rotation_matrix(quaternion).reshape(-1, 3, 3)
    near(rotation, scipys(quaternion).as_matrix(), 1e-15)
    angles = pitch_roll_yaw(configurations(quaternion))
    assert angles.shape == (5, 200, 3) and np.abs(angles[..., 0]).max() <= np.pi / 2
    near(euler(angles), rotation, 1e-15)
    single = np.hstack([np.full((3, 1), np.cos(0.35)), np.sin(0.35) * np.eye(3)])
    near(pitch_roll_yaw(configurations(single)), 0.7 * np.eye(3), 1e-15)
    for short in (0, 1e-3, 1e-8, 1e-12):
        turns = np.broadcast_arrays(np.pi / 2 - short, 0.4, np.linspace(-3, 3, 50))
        rotation = euler(np.stack(turns, axis=-1))
        steep = np.roll(Rotation.from_matrix(rotation).as_quat(), 1, axis=-1)
        with row("short of the pole by", short):
            near(euler(pitch_roll_yaw(configurations(steep))), rotation, 2e-15)


def test_unwrapped_pitch_counts_the_turns_of_a_somersault():
    """Also over so many samples that they must be unwrapped at once, without loss of digits."""
    for end, count, most in ((5 * np.pi, 300, 1e-12), (3e4, 3 * 10**5, 1e-9)):
        turn = np.linspace(0, end, count)
        quaternion = np.stack([np.cos(turn / 2), np.sin(turn / 2), 0 * turn, 0 * turn], axis=1)
        found = pitch_roll_yaw(configurations(quaternion), unwrap=True)
        near(found, np.stack([turn, 0 * turn, 0 * turn], axis=1), most)
    # a time axis is needed, but may have no sample
    assert pitch_roll_yaw(np.zeros((0, 9)), unwrap=True).shape == (0, 3)
    with pytest.raises(ValueError, match="1 dimensions"):
        pitch_roll_yaw(np.array([0, 0, 0, 1.0, 0, 0, 0]), unwrap=True)


def test_unwrapped_angles_are_the_attitude_and_nearest_to_those_before():
    turns = 2 * np.pi * np.arange(-9, 10)
    for step in (0.05, 0.4, 4.0):
        walk = np.cumsum(step * np.random.default_rng(7).normal(size=(200, 4)), axis=0)
        unwrapped = pitch_roll_yaw(configurations(walk), unwrap=True)
        once = pitch_roll_yaw(configurations(walk))
        for before, angles, found in zip(unwrapped, once[1:], unwrapped[1:], strict=False):
            other = [np.pi - angles[0], angles[1] + np.pi, angles[2] + np.pi]
            ways = [np.add.outer(branch, turns) - before[:, None] for branch in (angles, other)]
            nearest = min(np.abs(way).min(axis=1).sum() for way in ways)
            assert np.abs(found - before).sum() == pytest.approx(nearest, abs=1e-9), step
        near(euler(unwrapped), rotation_matrix(walk), 1e-13)
