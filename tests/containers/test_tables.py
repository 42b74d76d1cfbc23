"""Tables: a row a sample, units in the header, and every digit in CSV."""

import csv

import numpy as np
import pytest

import serpentail as st


def read(path):
    """Header and rows of a CSV file, by the csv module."""
    with path.open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    return header, [list(map(float, row)) for row in rows]


def column(path, name):
    header, rows = read(path)
    return np.array([row[header.index(name)] for row in rows])


def test_a_frame_has_a_row_a_sample(drop):
    table = drop.to_dataframe()
    assert table.index.name == "time" and np.array_equal(table.index, drop.t)
    assert np.array_equal(table[["x", "y", "z"]], drop.q[:, :3])
    assert np.array_equal(table["alpha_1_dot"], drop.v[:, 6])
    assert np.array_equal(table["tau_beta_1"], drop.tau[:, 1])
    assert np.array_equal(table["linear_momentum_y"], drop.linear_momentum[:, 1])
    assert np.array_equal(table["forces_feet_left_A_z"], drop.contact.forces[:, 3, 2])
    assert np.array_equal(table["legs_gamma_right"], drop.contact.legs[:, 0])
    units = table.attrs["units"]
    assert set(units) == {"time", *table.columns}
    assert (units["z"], units["qw"], units["alpha_1"], units["tau_alpha_1"]) == (
        "m",
        "1",
        "rad",
        "N m",
    )


def test_a_frame_of_runs_has_two_indices(runs):
    table = runs.to_dataframe()
    assert list(table.index.names) == ["run", "time"] and len(table) == 3 * 21
    assert np.array_equal(table.loc[2, "z"], runs.q[2, :, 2])
    assert np.array_equal(table.loc[1, "z"], runs.q[1, :, 2], equal_nan=True)
    assert table.loc[1, "z"].isna().any() and "mu" not in table.columns


def test_csv_has_units_and_all_digits(drop, tmp_path):
    path = tmp_path / "new" / "drop.csv"
    assert drop.to_csv(str(path)) == path
    header, rows = read(path)
    assert header[:5] == ["time [s]", "x [m]", "y [m]", "z [m]", "qw [1]"]
    assert "forces_feet_right_A_x [N]" in header and "alpha_1_dot [rad/s]" in header
    assert len(header) == len(set(header)) and {len(row) for row in rows} == {len(header)}
    assert column(path, "time [s]").tolist() == drop.t.tolist()
    for k, name in enumerate(["x [m]", "y [m]", "z [m]", "qw [1]"]):
        assert column(path, name).tolist() == drop.q[:, k].tolist()
    last = column(path, "bristles_tail_1_y [m]")
    assert last.tolist() == drop.contact.of("tail").bristles[:, 0, 1].tolist()


def test_csv_of_runs(runs, tmp_path):
    path = runs.to_csv(tmp_path / "runs.csv")
    header, _ = read(path)
    assert header[:3] == ["run", "time [s]", "x [m]"]
    assert column(path, "run").tolist() == [k for k in range(3) for _ in range(21)]
    assert np.array_equal(column(path, "z [m]"), runs.q[..., 2].ravel(), equal_nan=True)
    forces = column(path, "forces_feet_right_T_z [N]").reshape(3, 21)
    assert np.array_equal(forces[0], runs[0].contact.forces[:, 2, 2])


@pytest.mark.parametrize("method", ["to_csv", "to_netcdf"])
def test_files_are_whole_or_not_there(method, flight, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(st.NotWritten, match="is not written"):
        getattr(flight, method)(tmp_path / "file" / "a")
    (tmp_path / "a").write_text("before")
    monkeypatch.setattr("pathlib.Path.replace", refuse)
    with pytest.raises(st.NotWritten, match="no room"):
        getattr(flight, method)(tmp_path / "a")
    assert (tmp_path / "a").read_text() == "before"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "file"]


def refuse(*_):
    raise OSError(28, "no room")
