"""Marker tracks: arrays, and files that are written and read again; faults are told by place."""

import numpy as np
import pytest

import serpentail as st
from tests.support.rows import row

STEP = 0.005  # s


def some(frames=6):
    positions = np.random.default_rng(0).normal(size=(frames, 2, 3))
    positions[2, 1] = np.nan
    return st.marker_tracks(STEP * np.arange(frames), positions, ["nose", "tip"], unit="m")


def arrays():
    positions = np.random.default_rng(0).normal(size=(6, 2, 3))
    return np.arange(6.0), positions, ["a", "b"]


def test_arrays_that_are_no_tracks_are_refused():
    t, x, n = arrays()
    for words, times, positions, names, how in (
        ("unit: none is stated", t, x, n, {"unit": None}),
        ("unit: value 'inch'", t, x, n, {"unit": "inch"}),
        ("unit: value 3", t, x, n, {"unit": 3}),
        ("frame 3 .* has 2 s, repeated", np.r_[t[:3], t[2:-1]], x, n, {}),
        ("frame 1 .* before", t[::-1], x, n, {}),
        (r"times have shape \(6, 1\)", t[:, None], x, n, {}),
        (r"shape \(6, 1, 3\): needs \(6, 2, 3\)", t, x[:, :1], n, {}),
        ("two markers are called 'a'", t, x, ["a", "a"], {}),
        ("names: value", t, x, "ab", {}),
        ("names: value", t, x, ["a", " "], {}),
        ("'b' is at exactly .* in 6 frames", t, x * [[[1], [0]]], n, {}),
        ("never seen: b", t, x * [[[1], [np.nan]]], n, {}),
        ("infinite", t, x * np.inf, n, {}),
        (r"\(3,\): needs 4 frames", t[:3], x[:3], n, {}),
        ("axes: value 'xzy'", t, x, n, {"axes": "xzy"}),
        ("axes: value '--xyz'", t, x, n, {"axes": "--xyz"}),
        ("axes: value 'xyzx'", t, x, n, {"axes": "xyzx"}),
        ("zeros: value 'maybe'", t, x, n, {"zeros": "maybe"}),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.marker_tracks(times, positions, names, **({"unit": "m"} | how))
    assert len(st.marker_tracks(t[:4], x[:4], n, unit="m").times) == 4
    with pytest.raises(st.IdentificationError, match="arrays: value 'c'"):
        some().of(["nose", "c"])


def test_units_gaps_and_axes_of_arrays():
    t, x, names = arrays()
    x[2, 1] = 0
    x[3, 0, 1] = np.nan
    found = st.marker_tracks(t, x, names, unit="mm", zeros="gap")
    assert np.argwhere(~found.seen).tolist() == [[2, 1], [3, 0]]
    assert np.isnan(found.positions[3, 0]).all()
    np.testing.assert_allclose(found.positions[4], 1e-3 * x[4], rtol=1e-15)
    for axes, columns, signs in (("zxy", [2, 0, 1], 1), ("-yxz", [1, 0, 2], [-1, 1, 1])):
        turned = st.marker_tracks(t, x, names, unit="m", zeros="gap", axes=axes).positions
        np.testing.assert_array_equal(turned[4:], (x[..., columns] * signs)[4:], axes)


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
    """Change the values of a TRC file's header."""
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
    with pytest.raises(st.IdentificationError, match="unit: none is stated"):
        st.read_markers(st.write_markers(some(), tmp_path / "run.csv"))


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


def test_what_is_no_file_of_tracks_is_refused(tmp_path):
    (tmp_path / "run.trc").write_bytes(b"\x00\xff" * 300)
    for path, words in (
        (3, "data: value 3"),
        (tmp_path / "tracks.xlsx", r"tracks.xlsx: needs .*\.trc, \.csv, \.c3d"),
        (tmp_path / "none.trc", r"none.trc: cannot be read"),
        (tmp_path / "run.trc", "is not a text file"),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.read_markers(path)
