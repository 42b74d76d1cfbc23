"""Sweeps of identifications: over recordings, over where the search begins, and of a scene."""

import shutil

import numpy as np
import pytest

import serpentail as st
from serpentail import cli
from tests.identification.flights import flown, placed, scene, seen, start
from tests.support import zoo

TIMES = np.linspace(0, 0.1, 11)
ESTIMATE = ["tail_mass"]


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Two flights of two animals, without noise, as files; their tails' masses, kg."""
    folder, masses = tmp_path_factory.mktemp("recordings"), {}
    for k, mass in enumerate((0.003, 0.006)):
        model = zoo.model("m1_n1").with_parameters(tail_mass=mass)
        x = flown(model, TIMES, start(model, k))
        path = folder / f"{k + 2}nd flight.csv"  # a word that begins as a number does
        tracks = st.marker_tracks(TIMES, seen(model, x), list(placed(model)), unit="m")
        st.write_markers(tracks, path)
        masses[str(path)] = mass
    return masses


def swept(recordings, masses=("4 g",), **more):
    model = zoo.model("m1_n1")
    settings = {"markers": placed(model), "estimate": ESTIMATE, "unit": "m"}
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
    given = {"store": tmp_path / "rows.db", "executor": worker}
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
    rows = st.sweep(study, axes, "identify", store=study.with_suffix(".db"))
    assert rows.spent.points == 0
    for k, mass in enumerate(recordings.values()):
        wide, narrow = (rows[2 * k + i]["parameters"]["tail_mass"] for i in (0, 1))
        assert wide["value"] == pytest.approx(mass, rel=1e-3)
        assert wide["std"] == pytest.approx(10 * narrow["std"], rel=1e-2)
    with pytest.raises(st.SweepError, match="over: no data: needs files of marker tracks"):
        st.sweep(study, {"noise": st.grid([1e-3])}, "identify")
