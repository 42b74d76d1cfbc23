"""`serpentail simulate`: what it prints, draws and refuses."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from scipy.io import netcdf_file

import serpentail as st
from serpentail import cli
from tests.scenes.conftest import SIMPLE
from tests.support.told import besides_progress

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
    assert out.count("\n") == 1 and not besides_progress(err)
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


def test_simulate_tells_units_and_warnings(scene, capsys):
    bent = ["simulate", scene(), "--set", "start.bends=[[4.0, 0.0]]"]
    assert cli.main(bent) == 0
    out, err = capsys.readouterr()
    assert re.search(r"^apex_m +0\.10000 +m$", out, re.MULTILINE)
    assert re.search(r"^peak_ground_force_weights +\S+ +body weights$", out, re.MULTILINE)
    assert re.search(
        r"^warnings +tail: segment 1 is bent by 4 rad", out, re.MULTILINE
    ) and not besides_progress(err)
    assert cli.main([*bent, "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert any("segment 1 is bent by 4 rad" in each for each in told["warnings"])


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
    assert json.loads(out)["model"] == "simple" and not besides_progress(err)
    assert [path.name for path in Path().iterdir()] == ["simple.toml"]


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


# Files to write.


@pytest.mark.parametrize(
    ("option", "path", "words"),
    [
        ("--save", "simple.toml/a.npz", "simple.toml is not a folder"),
        ("--save", ".", ". is a folder"),
        ("--save", "motions/", "motions/ is a folder"),
        ("--save", "a.dat", "its name ends in .dat, which is none of .npz, .csv, .nc"),
        ("--save", "a.csv/a.v2", "its name ends in .v2"),
        ("--film", "simple.toml/deep/a.png", "simple.toml is not a folder"),
        ("--film", "a.avi", "has suffix '.avi': use one of .gif, .html, .mp4, .pdf, .png, .svg"),
        ("--film", "a", "has suffix '': use one of"),
        ("--save", "/proc/a.npz", "could not be written|cannot be written to|not a folder"),
    ],
)
def test_a_target_that_cannot_be_is_refused_before_the_run(
    scene, capsys, monkeypatch, option, path, words
):
    ran = []
    monkeypatch.setattr(st.Scenario, "simulate", lambda *_: ran.append(1))
    if path.startswith("/proc"):  # whatever the user may do, there no folder can be written
        monkeypatch.setattr("os.access", lambda folder, _: str(folder) != "/proc")
    assert cli.main(["simulate", scene(), option, path]) == 2
    out, err = capsys.readouterr()
    assert not out and not ran and re.search(words, err)
    assert err.startswith(f"{option} {path}: ") and err.count("\n") == 1


def test_a_film_without_an_encoder_is_refused_before_the_run(scene, capsys, monkeypatch):
    ran = []
    monkeypatch.setattr(st.Scenario, "simulate", lambda *_: ran.append(1))
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert cli.main(["simulate", scene(), "--film", "a.mp4"]) == 2
    assert not ran and 'pip install "serpentail[film]"' in capsys.readouterr().err


@pytest.mark.parametrize("suffix", [".gif", ".mp4", ".svg"])
def test_a_film_is_what_its_suffix_says(scene, capsys, suffix):
    assert cli.main(["simulate", scene(), "--film", f"new/a{suffix}"]) == 0
    begins = {".gif": b"GIF89a", ".mp4": b"\0\0\0", ".svg": b"<?xml"}
    assert Path(f"new/a{suffix}").read_bytes().startswith(begins[suffix])
    assert not capsys.readouterr().err and len(list(Path("new").iterdir())) == 1


def test_a_failed_picture_loses_nothing(scene, capsys, monkeypatch):
    def fails(*_, **__):
        raise RuntimeError("no fonts\non this machine")

    monkeypatch.setattr("serpentail.pictures.film.filmstrip", fails)
    given = ["--film", "a.png", "--save", "new/a.npz", "--json", "-"]
    assert cli.main(["simulate", scene(), *given]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["model"] == "simple"
    assert err == "--film a.png: could not be written: no fonts on this machine\n"
    assert st.Trajectory.load("new/a.npz").t[-1] == 0.02 and not Path("a.png").exists()


@pytest.mark.parametrize(
    ("path", "written"),
    [("a.npz", "a.npz"), ("new/a", "new/a.npz"), ("a.csv", "a.csv"), ("a.nc", "a.nc")],
)
def test_the_name_tells_the_kind_of_file(scene, capsys, path, written):
    assert cli.main(["simulate", scene(), "--save", path]) == 0
    assert besides_progress(capsys.readouterr().err) == ""
    readers = {".npz": npz_times, ".csv": csv_times, ".nc": netcdf_times}
    times = readers[Path(written).suffix](written)
    assert times[-1] == 0.02 and len(times) == 201


def npz_times(path):
    return st.Trajectory.load(path).t


def csv_times(path):
    return [float(line.partition(",")[0]) for line in Path(path).read_text().splitlines()[1:]]


def netcdf_times(path):
    with netcdf_file(path, mmap=False) as file:
        return file.variables["time"][:]


def test_a_file_that_nothing_can_write_is_refused_before_the_run(scene, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    monkeypatch.setattr(st.Scenario, "simulate", None)
    assert cli.main(["simulate", scene(), "--save", "a.nc"]) == 2
    assert 'pip install "serpentail[xarray]"' in capsys.readouterr().err


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
    assert (
        json.loads(out) == {"converged": True, "warnings": []} and "no space left on device" in err
    )
    assert cli.main(["plan", scene(), "--save", "simple.toml/a.npz"]) == 2


def test_a_reader_that_stops_is_no_error(scene, tmp_path):
    done = subprocess.run(
        f"{sys.executable} -m serpentail.cli simulate {scene()} --save a.npz | true; echo end",
        shell=True,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("end\n", "") and (tmp_path / "a.npz").is_file()
