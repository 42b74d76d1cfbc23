"""Marker tracks: arrays, and files that are written and read again, faults told by place; and the
verb identify, and what is drawn of an identification: its page, residuals and torques.
"""

import base64
import gzip
import json
import os
import re

import numpy as np
import pytest

import serpentail as st
from examples import front
from serpentail.cli import cli
from tests.identification.flights import flown, placed, scene, start, tracks
from tests.support import zoo
from tests.support.rows import row

STEP = 0.005  # s


T, NAMES = np.arange(6.0), ["nose", "tip"]
X = np.random.default_rng(0).normal(size=(6, 2, 3))


def some():
    positions = np.where(np.arange(12).reshape(6, 2, 1) == 5, np.nan, X)
    return st.marker_tracks(STEP * T, positions, NAMES, unit="m")


def far(y):
    x = X.copy()
    x[2, 1, 1] = y
    return x


def test_a_marker_beyond_100_m_is_named_with_a_remedy():
    """The rule is that of scenes: warn, because most often it is a slip of units."""
    with pytest.warns(st.UnusualSize, match=r"'tip', frame 2 .*, y: value -101 m: .*unit="):
        st.marker_tracks(T, far(-101), NAMES, unit="m")
    st.marker_tracks(T, far(99), NAMES, unit="m")
    st.marker_tracks(T, far(1e5 - 1), NAMES, unit="mm")


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
        ("names: value", T, X, ["a", "b\nc"], {}),
        (r"'tip', frame 2 .*, y: value 1e\+38 m: .*100 m.*unit=", T, far(1e38), NAMES, {}),
        (r"times\[1\]: value 2e\+12: needs seconds", T * 2e12, X, NAMES, {}),
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
    """Harmless oddities, too: a rate that is off by a per cent or is none, empty lines, cells of
    spaces at the end.
    """
    tracks = some()
    for suffix, unit in ((".trc", None), (".trc", "mm"), (".csv", "m")):
        with row(suffix, unit):
            path = st.write_markers(tracks, tmp_path / f"run{suffix}")
            found = st.read_markers(path, unit)
            assert found.names == tracks.names
            np.testing.assert_allclose(found.times, tracks.times, rtol=1e-8)
            np.testing.assert_allclose(found.positions, tracks.positions, rtol=1e-7)
    names = ["=cmd|' /C calc'!A0", 'left, "big"']
    odd = st.marker_tracks(tracks.times, tracks.positions, names, unit="m")
    path = st.write_markers(odd, tmp_path / "odd.csv")
    assert path.read_text().startswith("time,'=cmd")
    assert st.read_markers(path, "m").names == odd.names
    with pytest.raises(st.IdentificationError, match=r"path: value .*run\.c3d"):
        st.write_markers(tracks, tmp_path / "run.c3d")
    path = tmp_path / "run.trc"
    wanted, lines = st.read_markers(path).positions, path.read_text().splitlines()
    for change in (
        *(header("200", rate) for rate in ("198", "202", "nan", "unknown")),
        lambda x: [*x[:5], "", *x[5:], " "],
        lambda x: [*x[:-1], x[-1] + "\t \t"],
    ):
        path.write_text("\n".join(change(lines)))
        np.testing.assert_array_equal(st.read_markers(path).positions, wanted)


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
    "has 0 frames": lambda x: header("6", "0")([*x[:5], " "]),
    "DataRate is 0 Hz, .* 200 Hz": header("200", "0"),
}
CSV = {
    r"line 7 has \d of 7": lambda x: [*x[:-1], x[-1][:20]],
    "line 1 needs time,NAME_x": lambda x: [x[0].replace("nose_y", "nose"), *x[1:]],
    "csv: line 1 needs time": lambda x: [],
    "line 1 needs": lambda x: ["time" for _ in x],
    "repeated": lambda x: [*x[:4], x[3], *x[4:]],
    "cannot be read as CSV": lambda x: [*x[:-1], "1" * 200_000],
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
    os.mkfifo(tmp_path / "pipe.csv")
    for words, path in (
        ("unit: none is stated", st.write_markers(some(), tmp_path / "run.csv")),
        ("data: value 3", 3),
        (r"tracks.xlsx: needs .*\.trc, \.csv, \.c3d", tmp_path / "tracks.xlsx"),
        ("pipe.csv: is no regular file", tmp_path / "pipe.csv"),
        (r"none.trc: cannot be read", tmp_path / "none.trc"),
        ("is not a text file", tmp_path / "run.trc"),
    ):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.read_markers(path)


SCENE = front.ROOT / "scenes" / "identify_tail.toml"


def test_it_finds_what_the_recording_was_made_with(tmp_path, capsys):
    model, times = zoo.model("m1_n1"), np.linspace(0, 0.15, 31)
    data = tracks(model, times, flown(model, times, start(model)), 5e-4, gaps=0.1)
    recording, study = st.write_markers(data, tmp_path / "run.trc"), tmp_path / "study.toml"
    table = ["[parameters]", 'tail_length = "19 cm"', "[identify]", 'estimate = ["tail_length"]']
    study.write_text(scene(placed(model), *table))
    page, motion = tmp_path / "page.html", tmp_path / "motion.npz"
    words = ["identify", str(study), str(recording)]
    further = ["--json", "-", "--view", str(page), "--save", str(motion)]
    assert cli.main([*words, *further]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["success"] and report["undetermined"] == []
    found, truth = report["parameters"]["tail_length"], model.parameters["tail_length"]
    assert found["begin"] == 0.19 and found["low"] < truth < found["high"]
    assert found["high"] - found["low"] < 0.1 * truth
    assert 4e-4 < report["noise_m"] < 6e-4
    assert '"markers"' in page.read_text() and motion.is_file()
    assert cli.main([*words, "--folder", str(zoo.folder("m1_n1"))]) == 0
    out = capsys.readouterr().out
    assert out.startswith("tail_length") and "95%: " in out and "rms_m, nose" in out


def test_wrong_tables_are_told(tmp_path, capsys):
    text, study = SCENE.read_text(), tmp_path / "scene.toml"
    for words, old, new in (
        ("identify.torques: value 'some'", 'torques = "none"', 'torques = "some"'),
        ("needs std and time", 'torques = "none"', "torques = {std = 1e-3}"),
        (r"identify.marker\[1\]: ", 'name = "left"', 'name = "nose"'),
        ("'tail'", "tail = 0.25", "tial = 0.25"),
        ("a mass where a length", '"-25, -20, 20 mm"', '"-25, -20, 20 g"'),
        ("'estimate'", "estimate =", "estimates ="),
        (r"no table \[identify\]", "identify", "plan"),
    ):
        assert old in text
        study.write_text(text.replace(old, new))
        with row(words):
            assert cli.main(["identify", str(study), "none.trc"]) == 2
            assert re.search(words, capsys.readouterr().err)


def test_page_and_figure_have_what_was_measured_and_its_gaps(tmp_path):
    model, times, page = zoo.model("m1_n3"), np.linspace(0, 0.05, 11), tmp_path / "page.html"
    data = tracks(model, times, flown(model, times, start(model)), 3e-4, gaps=0.1)
    found = st.identify(model, data, placed(model), torques=st.TorquePrior(1e-3, 0.05))
    text = found.view(page).read_text()
    text = re.search(r'<script[^>]*id="data"[^>]*>(.*?)</script>', text, re.DOTALL)[1]
    (run,) = json.loads(text)["runs"]
    seen = found.trials[0].tracks.positions
    assert run["markers"] == 7 and np.isnan(seen).any()
    # columns of floats, as viewer/src/data.js reads them
    packed = gzip.decompress(base64.b64decode(run["arrays"]["markers"]))
    planes = np.frombuffer(packed, np.uint8).reshape(4, -1)
    steps = sum(planes[k].astype(np.uint32) << np.uint32(8 * k) for k in range(4))
    columns = np.cumsum(steps.reshape(-1, run["rows"]), axis=1, dtype=np.uint32)
    columns = columns.view(np.float32).T
    np.testing.assert_allclose(columns, seen.reshape(len(times), -1), rtol=1e-6)
    for words, markers in (
        (r"markers: shape \(3, 2\): needs \(11, M, 3\)", [np.zeros((3, 2))]),
        ("markers: 2 entries: needs one of each of 1", [np.zeros((11, 1, 3))] * 2),
    ):
        with row(words), pytest.raises(st.ViewError, match=words):
            st.view(found.trajectory, page, markers=markers)

    _, axes = found.plot(tmp_path / "residuals.png")
    named = [text.get_text() for text in axes[0].get_legend().get_texts()]
    assert named == [*data.names, f"rms of noise: {1e3 * found.noise * 3**0.5:.2g} mm"]
    for label, each in zip(("tail torque\n[mN m]", "power\n[mW]"), axes[1:], strict=True):
        assert each.get_ylabel() == label and len(each.collections) == 2  # bands
        named = [text.get_text() for text in each.get_legend().get_texts()]
        assert named == ["pitch", "yaw", "95 %"]
    bands = found.trials[0].torques
    edge = axes[1].collections[1].get_paths()[0].vertices[:, 1]
    assert edge.min() == pytest.approx(1e3 * bands.low[:, 1].min())
    curves = [line.get_ydata() for line in axes[0].lines[: len(data.names)]]
    distance = 1e3 * np.linalg.norm(found.trials[0].residuals, axis=2)
    np.testing.assert_allclose(np.array(curves).T, distance)
    np.testing.assert_allclose(axes[2].lines[1].get_ydata(), 1e3 * found.trials[0].power[:, 1])
    assert (tmp_path / "residuals.png").stat().st_size > 1000
    with pytest.raises(st.IdentificationError, match="trial: value 1: needs 0 to 0"):
        found.plot(trial=1)


def test_tracks_and_torques_tell_their_shapes_and_priors_take_units():
    model, times = zoo.model("m1_n1"), np.linspace(0, 0.05, 11)
    data = tracks(model, times, flown(model, times, start(model)), 3e-4)
    told = repr(data).splitlines()
    assert len(told) <= 4 and "5 markers at 11 times" in told[0] and "nose, left" in told[1]
    found, same = (
        st.identify(model, data, placed(model), torques=st.TorquePrior(*prior), noise=3e-4)
        for prior in (("4 mN m", "30 ms"), (4e-3, 0.03))
    )
    torques = found.trials[0].torques
    np.testing.assert_array_equal(torques.values, same.trials[0].torques.values)
    np.testing.assert_array_equal(torques[1], torques.values[:, 1])
    assert f"values=array of {len(torques.times)} x 2" in repr(torques)
    for prior, words in ((("4 mm", 1), "torques.std: value '4 mm'"), ((1, "x"), "torques.time")):
        with row(words), pytest.raises(st.IdentificationError, match=words):
            st.identify(model, data, placed(model), torques=st.TorquePrior(*prior))
