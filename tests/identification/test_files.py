"""Files of marker tracks: what is written is read again, by ezc3d too; faults are told."""

import ezc3d
import numpy as np
import pytest

import serpentail as st


def some(frames=6):
    positions = np.random.default_rng(0).normal(size=(frames, 2, 3))
    positions[2, 1] = np.nan
    return st.marker_tracks(0.005 * np.arange(frames), positions, ["nose", "tip"], unit="m")


@pytest.mark.parametrize(("suffix", "unit"), [(".trc", None), (".csv", "m")])
def test_written_tracks_are_read_again(tmp_path, suffix, unit):
    tracks = some()
    path = st.write_markers(tracks, tmp_path / f"run{suffix}")
    found = st.read_markers(path, unit)
    assert found.names == tracks.names
    np.testing.assert_allclose(found.times, tracks.times, rtol=1e-8)
    np.testing.assert_allclose(found.positions, tracks.positions, rtol=1e-7)


def test_c3d_is_read_as_ezc3d_writes_it(tmp_path):
    tracks, file = some(), ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [200]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["nose", "tip"]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    points = np.ones((4, 2, 6))
    points[:3] = np.moveaxis(1e3 * tracks.positions, [0, 1, 2], [2, 1, 0])
    file["data"]["points"] = points
    path = tmp_path / "run.c3d"
    file.write(str(path))
    found = st.read_markers(path)
    assert found.names == tracks.names
    np.testing.assert_allclose(np.diff(found.times), 0.005, rtol=1e-9)
    np.testing.assert_allclose(found.positions, tracks.positions, atol=1e-6)
    with pytest.raises(st.IdentificationError, match="the file states mm: leave unit out"):
        st.read_markers(path, "m")


def test_csv_states_no_unit(tmp_path):
    path = st.write_markers(some(), tmp_path / "run.csv")
    with pytest.raises(st.IdentificationError, match='unit: none is stated: give unit="mm"'):
        st.read_markers(path)


def lines_of(path):
    return path.read_text().splitlines()


TRC = [
    (lambda x: x[:-2], "has 4 frames, its header says 6: the file is cut off"),
    (lambda x: [*x[:-1], x[-1][:40]], r"line 11 has \d of 8 columns: is the file cut off"),
    (lambda x: [*x[:-1], x[-1].replace("\t", "\tx", 3)], "line 11: could not convert"),
    (lambda x: x[:4], "is not a complete TRC file"),
    (lambda x: [x[0], x[1].replace("Units", "Unit"), *x[2:]], "line 3 has no Units"),
    (lambda x: [*x[:2], x[2].replace("mm", "inch"), *x[3:]], "unit: value 'inch'"),
    (lambda x: [*x[:2], x[2].replace("200", "100"), *x[3:]], "DataRate is 100 Hz, but the times"),
    (lambda x: [*x[:3], x[3].replace("tip", ""), *x[4:]], "names 1 markers, NumMarkers is 2"),
    (lambda x: [*x[:2], x[2].replace("6", "six"), *x[3:]], "NumFrames: value 'six'"),
]


@pytest.mark.parametrize(("change", "words"), TRC)
def test_damaged_trc_files_are_refused_by_line(tmp_path, change, words):
    path = st.write_markers(some(), tmp_path / "run.trc")
    path.write_text("\n".join(change(lines_of(path))))
    with pytest.raises(st.IdentificationError, match=words):
        st.read_markers(path)


CSV = [
    (lambda x: [*x[:-1], x[-1][:20]], r"line 7 has \d of 7 columns: is the file cut off"),
    (lambda x: [x[0].replace("nose_y", "nose"), *x[1:]], "line 1 needs time,NAME_x"),
    (lambda x: [], "line 1 needs time,NAME_x"),
    (lambda x: [*x[:4], x[3], *x[4:]], "repeated"),
]


@pytest.mark.parametrize(("change", "words"), CSV)
def test_damaged_csv_files_are_refused_by_line(tmp_path, change, words):
    path = st.write_markers(some(), tmp_path / "run.csv")
    path.write_text("\n".join(change(lines_of(path))))
    with pytest.raises(st.IdentificationError, match=words):
        st.read_markers(path, "m")


@pytest.mark.parametrize("name", ["run.trc", "run.c3d"])
def test_files_that_are_none_are_refused(tmp_path, name):
    path = tmp_path / name
    with pytest.raises(st.IdentificationError, match="cannot be read"):
        st.read_markers(path)
    path.write_bytes(b"\x00\xff" * 300)
    with pytest.raises(st.IdentificationError, match=r"is not a text file|valid c3d file"):
        st.read_markers(path)
