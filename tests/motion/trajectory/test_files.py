"""Laws of sampled motions: interpolation against analytic motions, files bit by bit, angles by
inversion.
"""

import dataclasses
import json
import zipfile

import numpy as np
import pytest

from serpentail.motion.trajectory import Trajectory

from .analytic import assert_same, fields, motion


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
    with pytest.raises(ValueError, match=r"short\.npz' does not hold .*: v has shape"):
        Trajectory.load(tmp_path / "short.npz")


@pytest.mark.parametrize("norm", [1 - 2e-3, 1 + 2e-3, 1.4, 0.6])
def test_quaternions_that_are_no_units_are_refused(flight, norm):
    q = flight.q.copy()
    q[7, 3:7] *= norm
    with pytest.raises(ValueError, match=r"q\[7, 3:7\] has norm"):
        dataclasses.replace(flight, q=q)
    q[7, 3:7] *= (1 + np.sign(norm - 1) * 9e-4) / norm
    assert dataclasses.replace(flight, q=q).q[7, 3] == q[7, 3]


def test_masked_entries_are_no_samples(flight):
    v = np.ma.masked_greater(flight.v, 3.0)
    with pytest.raises(ValueError, match=r"v: \d+ masked entries: .* use filled\(\)"):
        dataclasses.replace(flight, v=v)
    nothing_masked = np.ma.masked_greater(flight.v, 1e9)
    np.testing.assert_array_equal(dataclasses.replace(flight, v=nothing_masked).v, flight.v)


def test_files_that_would_fill_the_memory_are_refused(tmp_path, flight):
    great = np.zeros(10_000_000)
    np.savez_compressed(tmp_path / "bomb.npz", **fields(flight) | {"kinetic": great, "info": "{}"})
    with pytest.raises(ValueError, match=r"bomb\.npz' is damaged .*it would unpack to 0\.08 GB"):
        Trajectory.load(tmp_path / "bomb.npz")
    np.savez_compressed(tmp_path / "small.npz", **fields(flight) | {"info": "{}"})
    assert_same(dataclasses.replace(flight, info={}), Trajectory.load(tmp_path / "small.npz"))
    # a header that tells of more numbers than there are
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1152921504606846,)}\n"
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    with zipfile.ZipFile(flight.save(tmp_path / "lie"), "a") as archive:
        names = [name for name in archive.namelist() if name != "q.npy"]
        parts = {name: archive.read(name) for name in names} | {"q.npy": content}
    with zipfile.ZipFile(tmp_path / "lie.npz", "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    with pytest.raises(ValueError, match=r"lie\.npz' is damaged or not a trajectory"):
        Trajectory.load(tmp_path / "lie.npz")
