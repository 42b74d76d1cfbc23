"""The verb identify, and what is drawn of an identification: its page, residuals and torques."""

import base64
import gzip
import json
import re

import numpy as np
import pytest

import serpentail as st
from examples import front
from serpentail import cli
from tests.identification.flights import flown, placed, scene, start, tracks
from tests.support import zoo
from tests.support.rows import row

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


def unpacked(text, rows):
    """Columns of floats, as viewer/src/data.js reads them."""
    planes = np.frombuffer(gzip.decompress(base64.b64decode(text)), np.uint8).reshape(4, -1)
    steps = sum(planes[k].astype(np.uint32) << np.uint32(8 * k) for k in range(4))
    bits = np.cumsum(steps.reshape(-1, rows), axis=1, dtype=np.uint32)
    return bits.view(np.float32).T


def test_page_and_figure_have_what_was_measured_and_its_gaps(tmp_path):
    model, times, page = zoo.model("m1_n3"), np.linspace(0, 0.05, 11), tmp_path / "page.html"
    data = tracks(model, times, flown(model, times, start(model)), 3e-4, gaps=0.1)
    found = st.identify(model, data, placed(model), torques=st.TorquePrior(1e-3, 0.05))
    text = found.view(page).read_text()
    text = re.search(r'<script[^>]*id="data"[^>]*>(.*?)</script>', text, re.DOTALL)[1]
    (run,) = json.loads(text)["runs"]
    seen = found.trials[0].tracks.positions
    assert run["markers"] == 7 and np.isnan(seen).any()
    columns = unpacked(run["arrays"]["markers"], run["rows"])
    np.testing.assert_allclose(columns, seen.reshape(len(times), -1), rtol=1e-6)
    for words, markers in (
        (r"markers: shape \(3, 2\): needs \(11, M, 3\)", [np.zeros((3, 2))]),
        ("markers: 2 entries: needs one of each of 1", [np.zeros((11, 1, 3))] * 2),
    ):
        with row(words), pytest.raises(st.ViewError, match=words):
            st.view(found.trajectory, page, markers=markers)

    _, axes = found.plot(tmp_path / "residuals.png")
    assert [each.get_ylabel() for each in axes] == ["residual [mm]", "torque [mN m]", "power [mW]"]
    curves = [line.get_ydata() for line in axes[0].lines[:-1]]
    distance = 1e3 * np.linalg.norm(found.trials[0].residuals, axis=2)
    np.testing.assert_allclose(np.array(curves).T, distance)
    np.testing.assert_allclose(axes[2].lines[1].get_ydata(), 1e3 * found.trials[0].power[:, 1])
    assert (tmp_path / "residuals.png").stat().st_size > 1000
    with pytest.raises(st.IdentificationError, match="trial: value 1: needs 0 to 0"):
        found.plot(trial=1)
