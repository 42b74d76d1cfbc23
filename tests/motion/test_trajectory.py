"""Laws of sampled motions: interpolation against analytic motions, files bit by bit, angles by
inversion.
"""

import dataclasses
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from serpentail.attitude import pitch_roll_yaw, rotation_matrix
from serpentail.motion.trajectory import Trajectory

PRECESSION, TILT, SPIN = 7.0, 0.6, 11.0  # rad/s, rad, rad/s of a torque-free symmetric top


def top(t):
    """Attitude (w, x, y, z) and body rate of a torque-free symmetric top: R = Rz(a t) Rx(tilt) Rz(b
    t).
    """
    turns = np.stack([PRECESSION * t, TILT + 0 * t, SPIN * t], axis=1)
    rotation = Rotation.from_euler("ZXZ", turns)
    omega = PRECESSION * rotation.as_matrix()[:, 2, :] + [0, 0, SPIN]  # a R^T z + b z
    return rotation.as_quat(canonical=False)[:, [3, 0, 1, 2]], omega


def motion(t, segments=2):
    """A trajectory whose every entry is a known function of time."""
    attitude, omega = top(t)
    phase = 12 * t[:, None] + np.arange(2 * segments)
    position = np.stack([0 * t, 0.6 * t, 2.8 * t - 4.9 * t**2], axis=1)
    rate = np.stack([0 * t, 0.6 + 0 * t, 2.8 - 9.8 * t], axis=1)
    return Trajectory(
        t=t,
        q=np.hstack([position, attitude, 0.5 * np.sin(phase)]),
        v=np.hstack([rate, omega, 6 * np.cos(phase)]),
        tau=np.sign(np.sin(phase)),
        kinetic=1 + rate[:, 2] ** 2 / 2,
        potential=9.8 * position[:, 2],
        linear_momentum=rate,
        angular_momentum=np.tile([1e-3, 2e-3, 3e-3], (len(t), 1)),
        info={
            "method": "analytic",
            "steps": len(t),
            "parameters": {"gravity": 9.8, "torso_inertia": (1, 2, 3)},
        },
    )


def fields(trajectory):
    """The nine arrays and the info of a trajectory by name."""
    found = {
        entry.name: getattr(trajectory, entry.name) for entry in dataclasses.fields(trajectory)
    }
    return {name: value for name, value in found.items() if value is not None}


def assert_same(first, second):
    """Every array bit-equal, every info equal."""
    for name, value in fields(first).items():
        other = getattr(second, name)
        if name == "info":
            assert value == other
        else:
            assert value.dtype == other.dtype == np.float64
            assert value.tobytes() == other.tobytes()
            assert value.shape == other.shape


@pytest.fixture
def flight():
    """Forty-one samples of the analytic motion."""
    return motion(np.linspace(0, 0.4, 41))


def test_properties(flight):
    assert flight.segments == 2
    assert np.array_equal(flight.energy, flight.kinetic + flight.potential)
    assert np.array_equal(flight.attitude, flight.q[:, 3:7])
    assert np.array_equal(flight.tail, flight.q[:, 7:])


def test_fields_are_private_and_read_only():
    given = fields(motion(np.linspace(0, 1, 201)))
    given = {name: value if name == "info" else value.copy() for name, value in given.items()}
    trajectory = Trajectory(**given)
    given["q"][0, 0] = 99
    given["info"]["parameters"]["gravity"] = 0
    assert trajectory.q[0, 0] == 0
    assert trajectory.info["parameters"]["gravity"] == 9.8
    with pytest.raises(ValueError, match="read-only"):
        trajectory.v[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        trajectory.t = given["t"]


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("t", lambda t: t[:0], r"t has shape \(0,\): give"),
        ("t", lambda t: t[:, None], r"t has shape \(41, 1\): give"),
        ("t", lambda t: t[::-1], r"t\[1\] = .* follows .*: give strictly increasing"),
        ("q", lambda q: q[:, :-1], r"q has shape \(41, 10\): give \(41, 7 \+ 2m\)"),
        ("q", lambda q: q[0], r"q has shape \(11,\): give"),
        ("q", lambda q: q[1:], r"q has shape \(40, 11\): give \(41, 11\)"),
        ("q", lambda q: 2 * q, r"q\[\d+, 3:7\] has norm 2: give unit quaternions"),
        ("q", lambda q: q * 1j, "q: type complex128: needs real numbers"),
        ("q", lambda q: [[0.0], [0.0, 1.0]], "q: type list: needs real numbers .*inhomogeneous"),
        ("v", lambda v: v[:, 1:], r"v has shape \(41, 9\): give \(41, 10\)"),
        (
            "v",
            lambda v: np.where(v > 0, np.nan, v),
            r"v\[0, 1\]: value nan: needs a finite number",
        ),
        ("tau", lambda tau: tau[:, :0], r"tau has shape \(41, 0\): give \(41, 4\)"),
        ("kinetic", lambda kinetic: kinetic[:, None], r"kinetic has shape \(41, 1\): give \(41,\)"),
        (
            "potential",
            lambda potential: potential[:-1],
            r"potential has shape \(40,\): give \(41,\)",
        ),
        ("linear_momentum", lambda p: p.T, r"linear_momentum has shape \(3, 41\): give \(41, 3\)"),
        ("angular_momentum", lambda h: h * np.inf, r"angular_momentum\[0, 0\]: value inf"),
        (
            "angular_momentum",
            lambda h: h.astype(str),
            "angular_momentum: type .*: needs real numbers",
        ),
        ("info", lambda info: info | {"seconds": np.nan}, "info is not JSON-ready .*: convert"),
        (
            "info",
            lambda info: info | {"seconds": np.zeros(2)},
            "info is not JSON-ready .*: convert",
        ),
        ("info", lambda info: [info], "info is a list: give a dict"),
    ],
)
def test_unsound_fields_are_named_with_a_remedy(flight, name, change, message):
    given = fields(flight)
    with pytest.raises(ValueError, match=message):
        Trajectory(**given | {name: change(given[name])})


@pytest.mark.parametrize("segments", [0, 1, 3])
def test_load_returns_what_was_saved_bit_by_bit(tmp_path, segments):
    trajectory = motion(np.sort(np.random.default_rng(1).uniform(0, 1, 57)), segments)
    path = trajectory.save(tmp_path / "new" / "run.npz")
    assert path == tmp_path / "new" / "run.npz"
    assert_same(trajectory, Trajectory.load(path))
    assert Trajectory.load(path).segments == segments


def test_suffix_is_added_to_any_name(tmp_path, flight):
    assert flight.save(tmp_path / "run") == tmp_path / "run.npz"
    assert flight.save(str(tmp_path / "run.v2")) == tmp_path / "run.v2.npz"
    assert_same(flight, Trajectory.load(tmp_path / "run"))


def test_equal_trajectories_make_equal_files(tmp_path, flight):
    first, second = flight.save(tmp_path / "a"), flight.save(tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()


def test_a_save_cut_short_leaves_the_old_file_and_nothing_else(tmp_path, flight, monkeypatch):
    path = flight.save(tmp_path / "run")
    before = path.read_bytes()

    def cut_short(stream, **arrays):
        stream.write(b"half a file")
        raise OSError("no space left")

    monkeypatch.setattr(np, "savez", cut_short)
    with pytest.raises(OSError, match="no space left"):
        motion(np.linspace(0, 1, 301)).save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no trajectory file .*gone\.npz'"):
        Trajectory.load(tmp_path / "gone")


@pytest.mark.parametrize("content", [b"", b"not a zip file", b"PK\x03\x04" + bytes(200)])
def test_damaged_file(tmp_path, content):
    (tmp_path / "run.npz").write_bytes(content)
    with pytest.raises(ValueError, match=r"run\.npz' is damaged or not a trajectory"):
        Trajectory.load(tmp_path / "run.npz")


def test_a_flipped_byte_or_a_cut_is_an_error_or_harmless(tmp_path):
    trajectory = motion(np.linspace(0, 0.02, 3), segments=1)
    path = trajectory.save(tmp_path / "run")
    whole, refusals = path.read_bytes(), []
    for place in range(0, len(whole), 5):
        flipped = bytearray(whole)
        flipped[place] ^= 0x55
        for content in (flipped, whole[:place]):
            path.write_bytes(content)
            try:
                loaded = Trajectory.load(path)
            except ValueError as error:
                refusals.append(str(error))
            else:
                assert_same(trajectory, loaded)
    assert len(refusals) > len(whole) / 4
    assert all("run.npz" in refusal for refusal in refusals)


def test_other_archives_are_refused_without_unpickling(tmp_path, flight):
    np.savez(tmp_path / "other.npz", t=flight.t)
    with pytest.raises(ValueError, match=r"other\.npz' is not a trajectory: .*q"):
        Trajectory.load(tmp_path / "other.npz")
    np.savez(tmp_path / "pickle.npz", **fields(flight) | {"info": np.array([{}], dtype=object)})
    with pytest.raises(ValueError, match=r"pickle\.npz' is damaged or not a trajectory"):
        Trajectory.load(tmp_path / "pickle.npz")
    np.savez(tmp_path / "short.npz", **fields(flight) | {"info": json.dumps({}), "v": flight.v[1:]})
    with pytest.raises(ValueError, match=r"short\.npz' holds no sound trajectory: v has shape"):
        Trajectory.load(tmp_path / "short.npz")


def test_resample_reproduces_the_samples(flight):
    again = flight.resample(flight.t)
    assert again.info == flight.info
    for name in ("t", "q", "tau"):
        np.testing.assert_allclose(getattr(again, name), getattr(flight, name), rtol=0, atol=4e-16)
    for name in ("v", "kinetic", "potential", "linear_momentum", "angular_momentum"):
        np.testing.assert_allclose(
            getattr(again, name), getattr(flight, name), rtol=1e-14, atol=1e-15
        )


def attitude_error(trajectory):
    """Largest angle between sampled and true attitudes, rad, and largest error of the other
    coordinates.
    """
    truth = motion(trajectory.t)
    turn = rotation_matrix(truth.attitude).swapaxes(1, 2) @ rotation_matrix(trajectory.attitude)
    angle = np.linalg.norm(turn - np.eye(3), axis=(1, 2)).max() / np.sqrt(2)
    return np.array(
        [angle, np.abs(trajectory.tail - truth.tail).max(), np.abs(trajectory.v - truth.v).max()]
    )


def test_resample_converges_to_the_free_top_and_the_sines():
    fine = np.linspace(0, 0.4, 1234)
    coarse, half = (attitude_error(motion(np.linspace(0, 0.4, n)).resample(fine)) for n in (41, 81))
    assert coarse[0] < 2e-5
    np.testing.assert_allclose(np.log2(coarse / half)[:2], 4, atol=0.1)
    assert np.log2(coarse / half)[2] > 1.9


def test_resample_is_exact_for_a_parabolic_flight_and_keeps_unit_quaternions(flight):
    t = np.linspace(0, 0.4, 997)
    dense = flight.resample(t)
    np.testing.assert_allclose(dense.q[:, :3], motion(t).q[:, :3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(dense.v[:, :3], motion(t).v[:, :3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(dense.attitude, axis=1), 1, rtol=0, atol=4e-16)


def test_resample_does_not_depend_on_quaternion_signs(flight):
    q = flight.q.copy()
    q[:, 3:7] *= np.random.default_rng(2).choice([-1.0, 1.0], len(q))[:, None]
    q[0, 3:7] = flight.q[0, 3:7]
    t = np.linspace(0, 0.4, 333)
    np.testing.assert_array_equal(
        dataclasses.replace(flight, q=q).resample(t).q, flight.resample(t).q
    )


def test_torque_is_linear_and_energies_do_not_overshoot(flight):
    t = np.linspace(0, 0.4, 777)
    step = np.where(flight.t < 0.2, 0.0, 1.0)
    dense = dataclasses.replace(flight, kinetic=step).resample(t)
    assert dense.kinetic.min() == 0
    assert dense.kinetic.max() == 1
    expected = np.stack([np.interp(t, flight.t, column) for column in flight.tau.T], axis=1)
    np.testing.assert_allclose(dense.tau, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("t", "first"), [([0.1, 0.5, 0.6], "0.5"), ([-0.25, 0.1], "-0.25")])
def test_the_first_time_outside_is_named(flight, t, first):
    with pytest.raises(
        ValueError, match=f"t = {first} s is outside the trajectory: give times from 0.0 to 0.4 s"
    ):
        flight.resample(t)


def test_rounding_at_the_ends_is_inside(flight):
    assert flight.resample([0.0, np.nextafter(0.4, 1)]).t[-1] == 0.4


@pytest.mark.parametrize("t", [[], [0.2, 0.1], [[0.1, 0.2]], [np.nan], 0.1])
def test_bad_times_are_errors(flight, t):
    with pytest.raises(ValueError, match=r"^t"):
        flight.resample(t)


def test_one_sample_and_no_tail_resample_too():
    alone = motion(np.array([0.1]), segments=0)
    again = alone.resample([0.1])
    np.testing.assert_allclose(again.q, alone.q, rtol=0, atol=4e-16)
    assert_same(dataclasses.replace(again, q=alone.q), alone)
    assert motion(np.linspace(0, 1, 101), segments=0).resample([0.5]).tau.shape == (1, 0)


def euler(angles):
    """R = Rz(phi_z) Rx(phi_x) Ry(phi_y) of angles (..., 3) ordered x, y, z."""
    return Rotation.from_euler("ZXY", angles[..., [2, 0, 1]].reshape(-1, 3)).as_matrix()


def configurations(quaternion):
    """Configurations (..., 7) with these attitudes."""
    return np.concatenate([np.zeros((*quaternion.shape[:-1], 3)), quaternion], axis=-1)


def test_rotation_matrix_agrees_with_scipy():
    quaternion = np.random.default_rng(3).normal(size=(4, 50, 4))
    expected = Rotation.from_quat(quaternion.reshape(-1, 4)[:, [1, 2, 3, 0]]).as_matrix()
    np.testing.assert_allclose(
        rotation_matrix(quaternion).reshape(-1, 3, 3), expected, rtol=0, atol=1e-15
    )


def test_pitch_roll_yaw_inverts_the_product_of_rotations():
    quaternion = np.random.default_rng(4).normal(size=(5, 200, 4))
    angles = pitch_roll_yaw(configurations(quaternion))
    assert angles.shape == (5, 200, 3)
    assert np.abs(angles[..., 0]).max() <= np.pi / 2
    np.testing.assert_allclose(
        euler(angles), rotation_matrix(quaternion).reshape(-1, 3, 3), rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_about_one_axis_is_that_angle(axis):
    quaternion = np.zeros(4)
    quaternion[0], quaternion[1 + axis] = np.cos(0.35), np.sin(0.35)
    np.testing.assert_allclose(
        pitch_roll_yaw(configurations(quaternion)), 0.7 * np.eye(3)[axis], rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("short", [0, 1e-3, 1e-8, 1e-12])
def test_pitch_roll_yaw_inverts_near_the_singularity(short):
    angles = np.stack(np.broadcast_arrays(np.pi / 2 - short, 0.4, np.linspace(-3, 3, 50)), axis=-1)
    rotation = euler(angles)
    quaternion = Rotation.from_matrix(rotation).as_quat()[:, [3, 0, 1, 2]]
    np.testing.assert_allclose(
        euler(pitch_roll_yaw(configurations(quaternion))), rotation, rtol=0, atol=2e-15
    )


def test_unwrapped_pitch_counts_the_turns_of_a_somersault():
    angle = np.linspace(0, 5 * np.pi, 300)
    quaternion = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)
    unwrapped = pitch_roll_yaw(configurations(quaternion), unwrap=True)
    np.testing.assert_allclose(
        unwrapped, np.stack([angle, 0 * angle, 0 * angle], axis=1), rtol=0, atol=1e-12
    )


def test_unwrapped_angles_are_continuous_and_still_the_attitude():
    t = np.linspace(0, 2, 4001)
    attitude, _ = top(t)
    unwrapped = pitch_roll_yaw(configurations(attitude), unwrap=True)
    assert np.abs(np.diff(unwrapped, axis=0)).max() < 0.1
    np.testing.assert_allclose(euler(unwrapped), rotation_matrix(attitude), rtol=0, atol=2e-14)


def test_unwrapping_needs_a_time_axis():
    with pytest.raises(ValueError, match=r"give \(K, 7 \+ 2m\)"):
        pitch_roll_yaw(np.array([0, 0, 0, 1.0, 0, 0, 0]), unwrap=True)
