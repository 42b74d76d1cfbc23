"""The verb identify: of a scene and a recording, and tables that are wrong."""

import json
import re

import numpy as np

from examples import front
from serpentail import cli, write_markers
from tests.identification.flights import flown, placed, scene, start, tracks
from tests.support import zoo
from tests.support.rows import row

SCENE = front.ROOT / "scenes" / "identify_tail.toml"


def test_it_finds_what_the_recording_was_made_with(tmp_path, capsys):
    model, times = zoo.model("m1_n1"), np.linspace(0, 0.15, 31)
    data = tracks(model, times, flown(model, times, start(model)), 5e-4, gaps=0.1)
    recording, study = write_markers(data, tmp_path / "run.trc"), tmp_path / "study.toml"
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
    """Before the recording is read."""
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
