"""`serpentail simulate`: what it prints, writes, draws and refuses."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from scipy.io import netcdf_file

import serpentail as st
from serpentail.cli import cli
from tests.support import zoo
from tests.support.rows import row
from tests.support.told import besides_progress


@pytest.fixture
def simulate(scene, capsys):
    """Return a function that simulates the simple scene; its status, stdout and stderr."""

    def run(*arguments):
        folder = str(zoo.folder("feet_tail"))
        status = cli.main(["simulate", scene(), "--folder", folder, *arguments])
        out, err = capsys.readouterr()
        return status, out, besides_progress(err)

    return run


def test_simulate_prints_one_json_object_and_saves_files_of_all_kinds(simulate):
    sets = ["--set", "mu=0.5", "--set", "duration=0.01", "--set", "start.height=12 cm"]
    for path in ("a.npz", "new/a", "a.csv", "a.nc"):
        status, out, err = simulate(*sets, "--save", path, "--json", "-")
        assert (status, err, out.count("\n")) == (0, "", 1), path
    names = "take_off_s apex_m com_rise_m recontact_s pitch_at_end_rad upright_end steps cpu_s"
    names += " peak_ground_force_s real_time_factor method"
    assert set(names.split()) <= set(json.loads(out))
    saved = st.Trajectory.load("a.npz")
    assert saved.info["parameters"]["mu"] == 0.5 and saved.q[0, 2] == 0.12
    times = [float(line.split(",")[0]) for line in Path("a.csv").read_text().splitlines()[1:]]
    assert times == list(saved.t) == list(st.Trajectory.load("new/a.npz").t)
    with netcdf_file("a.nc", mmap=False) as file:
        assert times == file.variables["time"][:].tolist() and len(times) == 201


def test_simulate_tells_units_and_warnings_and_draws(simulate):
    bent = ["--set", "start.bends=[[4.0, 0.0]]"]
    status, out, err = simulate(*bent, "--film", "new/a.svg")
    assert (status, err) == (0, "")
    for line in (r"upright_end +1\.0.*", r"apex_m +0\.10000 +m", "peak_ground.* +body weights"):
        assert re.search(rf"^{line}$", out, re.MULTILINE), line
    assert re.search(r"^warnings +tail: segment 1 is bent by 4 rad", out, re.MULTILINE)
    assert Path("new/a.svg").read_bytes().startswith(b"<?xml")
    assert [path.name for path in Path("new").iterdir()] == ["a.svg"]
    told = json.loads(simulate(*bent, "--json", "-")[1])
    assert any("segment 1 is bent by 4 rad" in each for each in told["warnings"])


def test_a_flight_is_generated_where_there_is_no_folder(tmp_path, monkeypatch, capsys):
    """The smallest model: one link and what a simulation needs."""
    monkeypatch.chdir(tmp_path)
    functions = '["energy", "momentum", "rollout", "tail_points"]'
    text = f"kind = 'articulated'\nsegments = 1\nlinks = 1\nfunctions = {functions}\n[simulate]\n"
    start = "start = { height = 1.0, velocity = [0, 0, 2], rate = [9, 0, 0] }\n"
    Path("tumble.toml").write_text(f"{text}duration = 0.1\n{start}")
    assert cli.main(["simulate", "tumble.toml", "--json", "-"]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert summary["model"] == "tumble" and not besides_progress(err)
    assert summary["method"] == "tsit5" and summary["take_off_s"] is summary["standing_end"] is None
    assert summary["com_rise_m"] == pytest.approx(2 * 0.1 - 4.9 * 0.01, abs=0.01)
    assert [path.name for path in Path().iterdir()] == ["tumble.toml"]


# Files to write.


def test_a_target_that_cannot_be_is_refused_before_the_run(simulate, monkeypatch):
    monkeypatch.setattr(st.Scenario, "simulate", None)
    rows = [
        ("--save", "simple.toml/a.npz", "simple.toml is not a folder"),
        ("--save", "motions/", "motions/ is a folder"),
        ("--save", "a.dat", r"\.dat, .*\.npz, \.csv, \.nc"),
        ("--film", "simple.toml/deep/a.png", "simple.toml is not a folder"),
        ("--film", "a.avi", r"'\.avi': .*\.gif, \.html, \.mp4, \.pdf, \.png, \.svg"),
    ]
    for option, path, words in rows:
        with row(option, path):
            status, out, err = simulate(option, path)
            assert (status, out, err.count("\n")) == (2, "", 1)
            assert err.startswith(f"{option} {path}: ") and re.search(words, err)
    monkeypatch.setitem(sys.modules, "xarray", None)
    assert "serpentail[xarray]" in simulate("--save", "a.nc")[2]
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert "serpentail[film]" in simulate("--film", "a.mp4")[2]


def test_a_failed_picture_loses_nothing(simulate, monkeypatch):
    def fails(*_, **__):
        raise RuntimeError("no fonts\non this machine")

    monkeypatch.setattr("serpentail.show.pictures.film.filmstrip", fails)
    status, out, err = simulate("--film", "a.png", "--save", "new/a.npz", "--json", "-")
    assert status == 1 and json.loads(out)["upright_end"]
    assert re.fullmatch("--film a.png: .*no fonts on this machine\n", err)
    assert st.Trajectory.load("new/a.npz").t[-1] == 0.02 and not Path("a.png").exists()


def test_a_plan_is_told_before_it_is_saved(scene, capsys, monkeypatch):
    class Found:
        report, success, view, warnings = {"converged": True}, True, None, []

        class trajectory:  # noqa: N801
            @staticmethod
            def save(_):
                raise OSError("no space left on device")

    monkeypatch.setattr("serpentail.scenes.plan.planned", lambda *_: Found)
    assert cli.main(["plan", scene(), "--save", "a.npz", "--json", "-"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out) == {"converged": True, "warnings": []}
    assert "no space left on device" in err
    assert cli.main(["plan", scene(), "--save", "simple.toml/a.npz"]) == 2


def test_a_reader_that_stops_is_no_error(scene, tmp_path):
    command = f"{sys.executable} -m serpentail simulate {scene()}"
    command += f" --folder {zoo.folder('feet_tail')} --save a.npz | true; echo end"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("end\n", "") and (tmp_path / "a.npz").is_file()
