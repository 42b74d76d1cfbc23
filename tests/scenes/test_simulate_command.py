"""`serpentail simulate`: what it prints, draws and refuses."""

import json
import re
from pathlib import Path

import pytest

import serpentail as st
from serpentail import cli
from tests.scenes.conftest import SIMPLE

# The command line.


def test_simulate_prints_one_json_object(scene, capsys):
    arguments = [
        "simulate",
        scene(),
        "--set",
        "mu=0.5",
        "--set",
        "duration=0.01",
        "--save",
        "a.npz",
        "--json",
        "-",
    ]
    assert cli.main(arguments) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert out.count("\n") == 1 and not err
    names = (
        "take_off_s apex_m com_rise_m recontact_s pitch_at_end_rad upright_end peak_foot_force_N "
        "steps cpu_s"
    )
    assert set(names.split()) | {"real_time_factor", "method"} <= set(summary)
    saved = st.Trajectory.load("a.npz")
    assert saved.t[-1] == 0.01 and saved.info["parameters"]["mu"] == 0.5


def test_simulate_prints_a_table_and_draws(scene, capsys):
    assert cli.main(["simulate", scene(), "--film", "a.png"]) == 0
    assert re.search(r"^upright_end +1\.0", capsys.readouterr().out, re.MULTILINE)
    assert Path("a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("mu=-1", "mu: value -1"),
        ("mu", "--set mu: needs NAME=VALUE"),
        ("duration=0", "needs a number above 0"),
    ],
)
def test_wrong_sets_are_status_2(scene, capsys, given, words):
    assert cli.main(["simulate", scene(), "--set", given, "--json", "-"]) == 2
    out, err = capsys.readouterr()
    assert not out and words in err


def test_a_missing_model_is_generated_first(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("simple.toml").write_text(SIMPLE.replace('kind = "art', 'name = "simple"\nkind = "art'))
    assert cli.main(["simulate", "simple.toml", "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["model"] == "simple" and "generated/simple: " in err


def test_a_scene_that_cannot_be_generated_is_status_2(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("wrong.toml").write_text(SIMPLE.replace("links = 2", "links = 0"))
    assert cli.main(["simulate", "wrong.toml"]) == 2
    assert "could not be generated: " in capsys.readouterr().err


def test_a_flight_is_a_scene_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    functions = '["energy", "momentum", "rollout", "tail_points"]'
    text = (
        "kind = 'articulated'\nsegments = 1\nlinks = 1\nfunctions = "
        f"{functions}\n[simulate]\nduration = 0.1\n"
    )
    Path("tumble.toml").write_text(
        text + "start = { height = 1.0, velocity = [0, 0, 2], rate = [9, 0, 0] }\n"
    )
    assert cli.main(["simulate", "tumble.toml", "--json", "-", "--film", "tumble.png"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["method"] == "tsit5" and summary["take_off_s"] is summary["standing_end"] is None
    assert summary["com_rise_m"] == pytest.approx(2 * 0.1 - 4.9 * 0.01, abs=0.01)
    Path("still.toml").write_text(text + "start = { settle = {} }\n")
    assert cli.main(["simulate", "still.toml"]) == 2 and "cannot settle" in capsys.readouterr().err
