"""The verb identify, on the recording that an example of the gallery generates."""

import json
import runpy
import tempfile

import matplotlib.pyplot as plt
import pytest

from examples import front
from serpentail import cli

SCENE = str(front.ROOT / "scenes" / "identify_tail.toml")
EXAMPLE = str(front.ROOT / "examples" / "gallery" / "plot_10_identify.py")


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """The names of the example, after it has run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(tmp_path_factory.mktemp("recording")))
        patch.setattr(plt, "show", lambda: None)
        patch.setenv("MPLBACKEND", "agg")
        names = runpy.run_path(EXAMPLE)
        plt.close("all")
    return names


@pytest.fixture
def recording(example):
    return example["file"]


def test_it_finds_what_the_recording_was_made_with(example, recording, tmp_path, capsys):
    page, motion = tmp_path / "page.html", tmp_path / "motion.npz"
    words = ["identify", SCENE, str(recording), "--json", "-"]
    assert cli.main([*words, "--view", str(page), "--save", str(motion)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["success"] and report["undetermined"] == []
    truth = {name.split("[")[0]: name for name in report["parameters"]}
    for name, value in example["truth"].items():
        row = report["parameters"][truth[name]]
        assert row["low"] < value < row["high"] and row["high"] - row["low"] < 0.5 * value
    assert 4.5e-4 < report["noise_m"] < 5.5e-4
    assert '"markers"' in page.read_text() and motion.is_file()
    assert cli.main(words[:3]) == 0
    out = capsys.readouterr().out
    assert out.startswith("tail_mass") and "95%: " in out and "rms_m, nose" in out


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('torques = "none"', 'torques = "some"', "identify.torques: value 'some': needs std"),
        ('torques = "none"', "torques = {std = 1e-3}", "needs std and time"),
        ('name = "left"', 'name = "nose"', r"identify.marker\[1\]: .* no other marker has"),
        ("tail = 0.25", "tial = 0.25", "did you mean 'tail'"),
        ('"-25, -20, 20 mm"', '"-25, -20, 20 g"', "a mass where a length is needed"),
        ("estimate =", "estimates =", "did you mean 'estimate'"),
        ("[identify]", "[plan]", r"has no table \[identify\]; add one"),
    ],
)
def test_wrong_tables_are_told(recording, tmp_path, capsys, old, new, words):
    import re

    text = front.ROOT.joinpath("scenes", "identify_tail.toml").read_text()
    assert old in text
    text = text.replace(old, new)
    if old == "[identify]":
        text = text.replace("identify.marker", "plan.marker")
    scene = tmp_path / "scene.toml"
    scene.write_text(text)
    assert cli.main(["identify", str(scene), str(recording)]) == 2
    assert re.search(words, capsys.readouterr().err)
