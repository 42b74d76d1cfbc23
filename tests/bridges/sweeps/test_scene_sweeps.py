"""Sweeps of scenes, from Python and from the command line, and their files; and sweeps of
identifications: over recordings, over where the search begins, and of a scene.
"""

import csv
import json
import re
import shutil
import tomllib

import numpy as np
import pandas
import pytest
import xarray
from jsonschema import Draft7Validator

import serpentail as st
from serpentail.cli import cli
from tests.identification.flights import flown, placed, scene, seen, start
from tests.support import zoo
from tests.support.rows import row as named
from tests.support.told import besides_progress

SCENE = """
kind = "articulated"
segments = 1
links = 1
functions = ["forward_dynamics", "rollout", "energy", "momentum", "tail_points"]

[simulate]
duration = 0.1
start = { height = 0.34, velocity = [0, 0, 2], rate = [10, 0, 0] }
controller = { kind = "damping", damping = 1e-3 }

[sweep]
outputs = ["tilt_end_deg", "q_end"]
points = 4
seed = 2

[sweep.over]
"start.pitch" = { latin = ["-30 deg", "30 deg"] }
tail_mass = { grid = ["3 g", 0.005] }
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(SCENE)
    return path


def told(capsys, *arguments):
    status = cli.main(["sweep", *map(str, arguments), "--json", "-"])
    out, err = capsys.readouterr()
    return status, json.loads(out) if out else None, besides_progress(err)


def test_the_command_makes_the_rows_of_a_scene_and_goes_on(study, capsys):
    status, _, err = told(capsys, study, "--status")
    assert status == 2 and "is not there yet" in err
    wanted = {"points": 8, "done": 8, "failed": 0, "store": str(study.with_suffix(".rows"))}
    assert told(capsys, study) == (0, wanted, "")
    rows, page = study.with_name("rows.csv"), study.with_name("page.html")
    extra = ("--export", rows, "--row", 5, "--view", page)
    assert told(capsys, study, "--status", *extra)[:2] == (0, wanted)
    assert page.read_text(encoding="utf-8").startswith("<!")
    found = list(csv.DictReader(rows.read_text().splitlines()))
    assert [float(row["tail_mass"]) for row in found] == [0.003] * 4 + [0.005] * 4
    for row in found[::3]:
        changes = {"tail_mass": float(row["tail_mass"]), "start.pitch": float(row["start.pitch"])}
        scene = st.scenario(study, changes=changes)
        motion = scene.simulate()
        assert float(row["tilt_end_deg"]) == pytest.approx(scene.summary(motion)["tilt_end_deg"])
        assert float(row["q_end_2"]) == pytest.approx(motion.q[-1, 2], abs=1e-9)
    assert cli.main(["sweep", str(study), "--status"]) == 0
    assert capsys.readouterr().out.startswith("8 of 8 points done")


def test_rows_are_saved_for_other_tools(study):
    pytest.importorskip("pyarrow")
    axes = {"start.pitch": st.latin(-0.5, 0.5), "tail_mass": st.grid([0.003, -1])}
    found = st.sweep(study, axes, points=3, seed=1, outputs=["end_s", "q_end"])
    folder, rows = study.parent, found.rows()
    table = pandas.read_parquet(found.save(folder / "rows.parquet"))
    assert table["tail_mass"].tolist() == [row["tail_mass"] for row in rows]
    np.testing.assert_array_equal(table["q_end_2"][:3], [row["q_end"][2] for row in rows[:3]])
    assert table["error"].isna().tolist() == [True] * 3 + [False] * 3
    found.save(folder / "rows.nc")
    with xarray.open_dataset(folder / "rows.nc") as data:
        assert dict(data.sizes) == {"tail_mass": 2, "sample": 3}
        np.testing.assert_array_equal(data["start.pitch"], [row["start.pitch"] for row in rows[:3]])
        np.testing.assert_array_equal(data["end_s"].sel(tail_mass=0.003), [0.1] * 3)
        assert np.isnan(data["end_s"].sel(tail_mass=-1)).all()
    with pytest.raises(st.SweepError, match=r"ends in \.parquet"):
        found.save(folder / "rows.xlsx")


def test_shapes_and_parameters_of_links_make_models_of_their_own(study):
    axes = {("segments", "links"): st.grid([(1, 1), (2, 1)]), "start.height": st.grid([0.1, 0.2])}
    store = study.with_suffix(".rows")
    found = st.sweep(study, axes, outputs=["q_end"], store=store)
    assert [len(row["q_end"]) for row in found] == [9, 9, 11, 11]
    again = dict(reversed(axes.items())) | {("segments", "links"): st.grid([(2, 1), (1, 1)])}
    again = st.sweep(study, again, outputs=["q_end"], store=store)  # another order, the same rows
    assert again.spent.points == 0
    assert [row["q_end"] for row in again] == [found[k]["q_end"] for k in (2, 0, 3, 1)]
    first = found[0]["q_end"][2]
    assert found[1]["q_end"][2] == pytest.approx(first + 0.1, abs=1e-6)
    axes = {"tail_damping": st.grid([1e-5, 1e-3])}  # there is other code for these
    rows = st.sweep(study, axes).rows()
    assert [row["error"] for row in rows] == [None, None]
    assert rows[0]["q_end"] != rows[1]["q_end"]


def test_slips_in_a_scene_are_told(study, capsys):
    """Some by the schema, too."""
    outputs = 'outputs = ["tilt_end_deg", "q_end"]'
    assert cli.main(["schema"]) == 0
    valid = Draft7Validator(json.loads(capsys.readouterr().out)).is_valid
    assert valid(tomllib.loads(SCENE))
    for slip in ("points = 0", "pionts = 4"):
        assert not valid(tomllib.loads(SCENE.replace("points = 4", slip)))
    for words, old, new in (
        ("'points'", "points = 4", "pionts = 4"),
        ("sweep.run: value 'fly'", "seed = 2", 'run = "fly"'),
        ("needs two bounds", "latin = [", "latin = [1, "),
        ("needs one of grid, random", "latin", "normal"),
        ("'pitch'", '"start.pitch"', '"start.pich"'),
        ("'tail_mass'", "tail_mass", "tail_mas"),
        ("over: tail_mass: value '3 s'", '"3 g", 0.005', '"3 s", 0.005'),
        (r"no table \[identify\]", outputs, 'run = "identify"'),
        ("needs a list of values", '{ grid = ["3 g", 0.005] }', "3"),
        (r"no table \[sweep\]", SCENE[SCENE.index("[sweep]") :], ""),
    ):
        assert old in SCENE
        study.write_text(SCENE.replace(old, new))
        status, out, err = told(capsys, study)
        with named(words):
            assert status == 2 and out is None
            assert re.search(words, err), err


def test_what_cannot_be_is_told_before_anything_runs(study, capsys, monkeypatch):
    page = study.with_name("page.html")
    for row in ("8", "-1"):
        status, out, err = told(capsys, study, "--row", row, "--view", page)
        assert status == 2 and out is None and f"row: value {row}: needs" in err
    assert not study.with_suffix(".rows").exists()
    found = st.sweep(study, {"tail_mass": st.grid([0.003])})
    for row in (1, -1, True, 0.0):
        with pytest.raises(st.SweepError, match=f"row: value {row}: needs.* to 0"):
            found.motion(row)
    monkeypatch.setattr("serpentail.bridges.sweeps.pose.built", lambda *_: pytest.fail("a model"))
    with pytest.raises(st.SweepError, match="did you mean 'tail_length'"):
        st.sweep(study, {"tail_lenght": st.grid([0.1])})


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Two flights of two animals, without noise, as files; their tails' masses, kg."""
    folder, masses, times = tmp_path_factory.mktemp("recordings"), {}, np.linspace(0, 0.1, 11)
    for k, mass in enumerate((0.003, 0.006)):
        model = zoo.model("m1_n1").with_parameters(tail_mass=mass)
        x = flown(model, times, start(model, k))
        path = folder / f"{k + 2}nd flight.csv"  # a word that begins as a number does
        tracks = st.marker_tracks(times, seen(model, x), list(placed(model)), unit="m")
        st.write_markers(tracks, path)
        masses[str(path)] = mass
    return masses


def swept(recordings, masses=("4 g",), **more):
    model = zoo.model("m1_n1")
    settings = {"markers": placed(model), "estimate": ["tail_mass"], "unit": "m"}
    over = {"data": st.grid(list(recordings)), "tail_mass": st.grid(list(masses))}
    return st.sweep(model, over, "identify", settings=settings, **more)


def test_each_row_is_an_identification(recordings, worker, tmp_path):
    found = swept(recordings, ("4 g", "4.5 g"), executor=worker)
    assert [row["tail_mass"] for row in found.rows()] == [0.004, 0.0045] * 2
    for row in found.rows():
        assert row["error"] is None and row["success"] and row["seconds"] > 0
        estimate = row["parameters"]["tail_mass"]
        assert estimate["value"] == pytest.approx(recordings[row["data"]], rel=1e-4)
        assert estimate["begin"] == row["tail_mass"]
    assert '"markers"' in found.view(1, tmp_path / "page.html").read_text(encoding="utf-8")
    columns = found.to_pandas().columns
    assert {"parameters.tail_mass.value", "parameters.tail_mass.std"} < set(columns)


def test_rows_depend_on_what_is_in_the_files(recordings, worker, tmp_path):
    copies, gone = [shutil.copy(path, tmp_path) for path in recordings], tmp_path / "gone.csv"
    given = {"store": tmp_path / "rows", "executor": worker}
    assert [swept(copies, **given).spent.points for _ in range(2)] == [2, 0]
    shutil.copy(copies[0], copies[1])
    assert swept(copies, **given).spent.points == 1
    with pytest.raises(st.SweepError, match=r"data: '.*gone.csv': it cannot be read .No such"):
        swept([*copies, str(gone)], **given)
    gone.write_text("nothing")
    found = swept([str(gone)], **given)
    assert found.status().failed == 1 and "IdentificationError" in found[0]["error"]


def test_a_scene_asks_for_them(recordings, tmp_path, capsys):
    for path in recordings:
        shutil.copy(path, tmp_path)
    first, second = (path.rsplit("/", 1)[1] for path in recordings)  # beside the scene
    over = f'data = ["{first}", ["{second}"]]\nnoise = ["1 mm", "0.1 mm"]'
    table = ["[identify]", 'estimate = ["tail_mass"]', 'unit = "m"']
    text = scene(placed(zoo.model("m1_n1")), *table)
    study = tmp_path / "study.toml"
    study.write_text(f'{text}[sweep]\nrun = "identify"\n[sweep.over]\n{over}\n')
    assert cli.main(["sweep", str(study), "--executor", "processes:1"]) == 0
    assert capsys.readouterr().out.startswith("4 of 4 points done, 0 of them failed")
    axes = {"data": st.grid([first, [second]]), "noise": st.grid([1e-3, 1e-4])}
    rows = st.sweep(study, axes, "identify", store=study.with_suffix(".rows"))
    assert rows.spent.points == 0
    for k, mass in enumerate(recordings.values()):
        wide, narrow = (rows[2 * k + i]["parameters"]["tail_mass"] for i in (0, 1))
        assert wide["value"] == pytest.approx(mass, rel=1e-3)
        assert wide["std"] == pytest.approx(10 * narrow["std"], rel=1e-2)
    with pytest.raises(st.SweepError, match="over: no data: needs files of marker tracks"):
        st.sweep(study, {"noise": st.grid([1e-3])}, "identify")
