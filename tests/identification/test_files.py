"""Marker tracks: arrays, and files that are written and read again; faults are told by place."""

import numpy as np
import pytest

import serpentail as st
from tests.support.rows import row

STEP = 0.005  # s


T, NAMES = np.arange(6.0), ["nose", "tip"]
X = np.random.default_rng(0).normal(size=(6, 2, 3))


def some():
    positions = np.where(np.arange(12).reshape(6, 2, 1) == 5, np.nan, X)
    return st.marker_tracks(STEP * T, positions, NAMES, unit="m")


def test_arrays_that_are_no_tracks_are_refused():
    for words, times, positions, names, how in (
        ("unit: none is stated", T, X, NAMES, {"unit": None}),
        ("unit: value 'inch'", T, X, NAMES, {"unit": "inch"}),
        ("frame 3 .* has 2 s, repeated", np.r_[T[:3], T[2:-1]], X, NAMES, {}),
        ("frame 1 .* before", T[::-1], X, NAMES, {}),
        (r"times have shape \(6, 1\)", T[:, None], X, NAMES, {}),
        (r"shape \(6, 1, 3\): needs \(6, 2, 3\)", T, X[:, :1], NAMES, {}),
        ("two markers are called 'a'", T, X, ["a", "a"], {}),
        ("names: value", T, X, "ab", {}),
        ("names: value", T, X, ["a", " "], {}),
        ("'tip' is at exactly .* in 6 frames", T, X * [[[1], [0]]], NAMES, {}),
        ("never seen: tip", T, X * [[[1], [np.nan]]], NAMES, {}),
        ("infinite", T, X * np.inf, NAMES, {}),
        (r"\(3,\): needs 4 frames", T[:3], X[:3], NAMES, {}),
        ("axes: value 'xzy'", T, X, NAMES, {"axes": "xzy"}),
        ("axes: value '--xyz'", T, X, NAMES, {"axes": "--xyz"}),
        ("axes: value 'xyzx'", T, X, NAMES, {"axes": "xyzx"}),
        ("zeros: value 'maybe'", T, X, NAMES, {"zeros": "maybe"}),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.marker_tracks(times, positions, names, **({"unit": "m"} | how))
    assert len(st.marker_tracks(T[:4], X[:4], NAMES, unit="m").times) == 4
    with pytest.raises(st.IdentificationError, match="arrays: value 'c'"):
        some().of(["nose", "c"])


def test_units_gaps_and_axes_of_arrays():
    x = X.copy()
    x[2, 1] = 0
    x[3, 0, 1] = np.nan
    found = st.marker_tracks(T, x, NAMES, unit="mm", zeros="gap")
    assert np.argwhere(~found.seen).tolist() == [[2, 1], [3, 0]]
    assert np.isnan(found.positions[3, 0]).all()
    np.testing.assert_allclose(found.positions[4], 1e-3 * x[4], rtol=1e-15)
    for axes, columns, signs in (("zxy", [2, 0, 1], 1), ("-yxz", [1, 0, 2], [-1, 1, 1])):
        turned = st.marker_tracks(T, X, NAMES, unit="m", axes=axes).positions
        np.testing.assert_array_equal(turned, X[..., columns] * signs, axes)


def test_written_tracks_are_read_again(tmp_path):
    tracks = some()
    for suffix, unit in ((".trc", None), (".trc", "mm"), (".csv", "m")):
        with row(suffix, unit):
            path = st.write_markers(tracks, tmp_path / f"run{suffix}")
            found = st.read_markers(path, unit)
            assert found.names == tracks.names
            np.testing.assert_allclose(found.times, tracks.times, rtol=1e-8)
            np.testing.assert_allclose(found.positions, tracks.positions, rtol=1e-7)
    with pytest.raises(st.IdentificationError, match=r"path: value .*run\.c3d"):
        st.write_markers(tracks, tmp_path / "run.c3d")


def test_c3d_is_read_as_ezc3d_writes_it(tmp_path):
    """Also from a frame that is not the first."""
    ezc3d = pytest.importorskip("ezc3d")
    tracks, file = some(), ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"], point["UNITS"]["value"] = [200], ["mm"]
    point["LABELS"]["value"] = ["nose", "tip"]
    points = np.ones((4, 2, 6))
    points[:3] = np.moveaxis(1e3 * tracks.positions, [0, 1, 2], [2, 1, 0])
    file["data"]["points"] = points
    for first in (0, 9):
        file["header"]["points"]["first_frame"] = first
        file.write(str(tmp_path / "run.c3d"))
        found = st.read_markers(tmp_path / "run.c3d")
        assert found.names == tracks.names
        np.testing.assert_allclose(found.times, STEP * (first + np.arange(6)), rtol=1e-9)
        np.testing.assert_allclose(found.positions, tracks.positions, atol=1e-6)
    with pytest.raises(st.IdentificationError, match="unit: value 'm': the file states mm"):
        st.read_markers(tmp_path / "run.c3d", "m")
    (tmp_path / "run.c3d").write_bytes(b"\x00\xff" * 300)
    with pytest.raises(st.IdentificationError, match=r"run.c3d: .*c3d file"):
        st.read_markers(tmp_path / "run.c3d")


def header(old, new):
    return lambda x: [*x[:2], x[2].replace(old, new), *x[3:]]


TRC = {
    "has 4 frames, its header says 6": lambda x: x[:-2],
    r"line 11 has \d of 8": lambda x: [*x[:-1], x[-1][:40]],
    "line 11: could not convert": lambda x: [*x[:-1], x[-1].replace("\t", "\tx", 3)],
    "needs PathFileType": lambda x: x[:4],
    "run.trc: .* PathFileType": lambda x: ["", *x[1:]],
    "line 3 has no Units": lambda x: [x[0], x[1].replace("Units", "Unit"), *x[2:]],
    "unit: value 'inch'": header("mm", "inch"),
    "DataRate is 100 Hz, .* 200 Hz": header("200", "100"),
    "DataRate is 194 Hz": header("200", "194"),
    "DataRate is 206 Hz": header("200", "206"),
    "DataRate is 260 Hz": header("200", "260"),
    "names 1 markers, NumMarkers is 2": lambda x: [*x[:3], x[3].replace("tip", ""), *x[4:]],
    "NumFrames: value 'six'": header("6", "six"),
}
CSV = {
    r"line 7 has \d of 7": lambda x: [*x[:-1], x[-1][:20]],
    "line 1 needs time,NAME_x": lambda x: [x[0].replace("nose_y", "nose"), *x[1:]],
    "csv: line 1 needs time": lambda x: [],
    "line 1 needs": lambda x: ["time" for _ in x],
    "repeated": lambda x: [*x[:4], x[3], *x[4:]],
}


def test_damaged_files_are_refused_by_line(tmp_path):
    for suffix, unit, rows in (("trc", None, TRC), ("csv", "m", CSV)):
        path = st.write_markers(some(), tmp_path / f"run.{suffix}")
        lines = path.read_text().splitlines()
        for words, change in rows.items():
            path.write_text("\n".join(change(lines)))
            with row(suffix, words), pytest.raises(st.IdentificationError, match=words):
                st.read_markers(path, unit)
    (tmp_path / "run.trc").write_bytes(b"\x00\xff" * 300)
    for words, path in (
        ("unit: none is stated", st.write_markers(some(), tmp_path / "run.csv")),
        ("data: value 3", 3),
        (r"tracks.xlsx: needs .*\.trc, \.csv, \.c3d", tmp_path / "tracks.xlsx"),
        (r"none.trc: cannot be read", tmp_path / "none.trc"),
        ("is not a text file", tmp_path / "run.trc"),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.read_markers(path)


def test_harmless_oddities_of_files_are_read(tmp_path):
    """A rate that is off by a per cent or is none, empty lines, cells of spaces at the end."""
    path = st.write_markers(some(), tmp_path / "run.trc")
    wanted, lines = st.read_markers(path).positions, path.read_text().splitlines()
    for change in (
        *(header("200", rate) for rate in ("198", "202", "nan", "unknown")),
        lambda x: [*x[:5], "", *x[5:], " "],
        lambda x: [*x[:-1], x[-1] + "\t \t"],
    ):
        path.write_text("\n".join(change(lines)))
        np.testing.assert_array_equal(st.read_markers(path).positions, wanted)
