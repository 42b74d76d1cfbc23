"""Trajectories: what their fields must be, and files that give them back bit by bit."""

import dataclasses
import json
import zipfile

import numpy as np
import pytest

from serpentail.motion.trajectory import Trajectory
from tests.support.rows import row

from .analytic import assert_same, fields, motion


def test_fields_are_private_and_read_only(flight):
    assert flight.segments == 2
    assert np.array_equal(flight.energy, flight.kinetic + flight.potential)
    assert np.array_equal(flight.attitude, flight.q[:, 3:7])
    assert np.array_equal(flight.tail, flight.q[:, 7:])
    assert np.array_equal(flight.tail_rate, flight.v[:, 6:])
    given = fields(flight)
    given = {name: value if name == "info" else value.copy() for name, value in given.items()}
    trajectory = Trajectory(**given)
    given["q"][0, 0] = 99
    given["info"]["parameters"]["gravity"] = 0
    assert trajectory.q[0, 0] == 0 and trajectory.info["parameters"]["gravity"] == 9.8
    with pytest.raises(ValueError, match="read-only"):
        trajectory.v[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        trajectory.t = given["t"]


def test_unsound_fields_are_named(flight):
    given = fields(flight)
    for name, change, words in (
        ("t", lambda t: t[:0], r"t .*\(0,\)"),
        ("t", lambda t: t[:, None], r"t .*\(41, 1\)"),
        ("t", lambda t: t[::-1], r"t\[1\] = 0\.39 .*0\.4"),
        ("t", lambda t: np.minimum(t, 0.2), r"t\[21\] = 0\.2 .*0\.2"),
        ("q", lambda q: q[:, :-1], r"q .*\(41, 10\).*\(41, 7 \+ 2m\)"),
        ("q", lambda q: q[0], r"q .*\(11,\)"),
        ("q", lambda q: q[1:], r"q .*\(40, 11\): give \(41, 11\)"),
        ("q", lambda q: 2 * q, r"q\[\d+, 3:7\] .*norm 2"),
        ("q", lambda q: q * 1j, "q: .*complex128"),
        ("q", lambda q: [[0.0], [0.0, 1.0]], "q: type list"),
        ("v", lambda v: v[:, 1:], r"v .*\(41, 9\): give \(41, 10\)"),
        ("v", lambda v: np.where(v > 0, np.nan, v), r"v\[0, 1\]: value nan"),
        ("v", lambda v: np.ma.masked_greater(v, 3.0), r"v: \d+ masked"),
        ("tau", lambda tau: tau[:, :0], r"tau .*\(41, 0\): give \(41, 4\)"),
        ("kinetic", lambda kinetic: kinetic[:, None], r"kinetic .*\(41, 1\): give \(41,\)"),
        ("potential", lambda potential: potential[:-1], r"potential .*\(40,\): give \(41,\)"),
        ("linear_momentum", lambda p: p.T, r"linear_momentum .*\(3, 41\): give \(41, 3\)"),
        ("angular_momentum", lambda h: h * np.inf, r"angular_momentum\[0, 0\]: value inf"),
        ("angular_momentum", lambda h: h.astype(str), "angular_momentum: type"),
        ("info", lambda info: info | {"seconds": np.nan}, "info .*JSON"),
        ("info", lambda info: info | {"seconds": np.zeros(2)}, "info .*JSON"),
        ("info", lambda info: [info], "info .*list"),
    ):
        with row(name, words), pytest.raises(ValueError, match=words):
            Trajectory(**given | {name: change(given[name])})
    nothing_masked = np.ma.masked_greater(flight.v, 1e9)
    np.testing.assert_array_equal(dataclasses.replace(flight, v=nothing_masked).v, flight.v)


def test_quaternions_may_drift_from_unit_norm_by_a_thousandth(flight):
    for norm in (1 - 2e-3, 1 + 2e-3, 1.4, 0.6):
        q = flight.q.copy()
        q[7, 3:7] *= norm
        with row(norm), pytest.raises(ValueError, match=r"q\[7, 3:7\] has norm"):
            dataclasses.replace(flight, q=q)
        q[7, 3:7] *= (1 + np.sign(norm - 1) * 9e-4) / norm
        assert dataclasses.replace(flight, q=q).q[7, 3] == q[7, 3]


def test_load_returns_what_was_saved_bit_by_bit(tmp_path):
    """Whatever the number of segments; equal motions make equal files."""
    for segments in (0, 1, 3):
        times = np.sort(np.random.default_rng(1).uniform(0, 1, 57))
        trajectory = motion(times, segments)
        path = trajectory.save(tmp_path / "new" / "run.npz")
        assert path == tmp_path / "new" / "run.npz"
        assert_same(trajectory, Trajectory.load(path))
        assert Trajectory.load(path).segments == segments
        assert trajectory.save(tmp_path / "other").read_bytes() == path.read_bytes()


def test_suffix_is_added_to_any_name(tmp_path, flight):
    assert flight.save(tmp_path / "run") == tmp_path / "run.npz"
    assert flight.save(str(tmp_path / "run.v2")) == tmp_path / "run.v2.npz"
    assert_same(flight, Trajectory.load(tmp_path / "run"))
    with pytest.raises(FileNotFoundError, match=r"gone\.npz"):
        Trajectory.load(tmp_path / "gone")


def test_a_save_cut_short_leaves_the_old_file_and_nothing_else(tmp_path, flight, monkeypatch):
    path = flight.save(tmp_path / "run")
    before = path.read_bytes()

    def cut_short(stream, **arrays):
        stream.write(b"half a file")
        raise OSError("no space left")

    monkeypatch.setattr(np, "savez", cut_short)
    with pytest.raises(OSError, match="no space left"):
        motion(np.linspace(0, 1, 301)).save(path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_a_flipped_byte_or_a_cut_is_an_error_or_harmless(tmp_path):
    trajectory = motion(np.linspace(0, 0.02, 3), segments=1)
    path = trajectory.save(tmp_path / "run")
    whole, refusals = path.read_bytes(), []
    places = range(0, len(whole), 8)
    for place in places:
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
    assert len(refusals) > 1.25 * len(places)
    assert all("run.npz" in refusal for refusal in refusals)


def lying(path):
    """Let the header of q in a file tell of more numbers than there are."""
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1152921504606846,)}\n"
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()} | {"q.npy": content}
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part)


def test_other_files_are_refused_without_unpickling_or_filling_the_memory(tmp_path, flight):
    own, great = fields(flight), np.zeros(10_000_000)
    np.savez(tmp_path / "other.npz", t=flight.t)
    np.savez(tmp_path / "pickle.npz", **own | {"info": np.array([{}], dtype=object)})
    np.savez(tmp_path / "short.npz", **own | {"info": json.dumps({}), "v": flight.v[1:]})
    np.savez_compressed(tmp_path / "bomb.npz", **own | {"kinetic": great, "info": "{}"})
    lying(flight.save(tmp_path / "lie"))
    for name, content in (("empty", b""), ("text", b"no zip"), ("cut", b"PK\x03\x04" + bytes(200))):
        (tmp_path / f"{name}.npz").write_bytes(content)
    for name, words in {
        **{"other": "not a trajectory: .*q", "pickle": "damaged", "short": "v has shape"},
        **{"bomb": r"damaged .*0\.08 GB", "lie": "damaged", "empty": "damaged"},
        **{"text": "damaged", "cut": "damaged"},
    }.items():
        with row(name), pytest.raises(ValueError, match=rf"{name}\.npz' .*{words}"):
            Trajectory.load(tmp_path / f"{name}.npz")
    np.savez_compressed(tmp_path / "small.npz", **own | {"info": "{}"})
    assert_same(dataclasses.replace(flight, info={}), Trajectory.load(tmp_path / "small.npz"))
