"""Tables: a row a sample, units in the header, and every digit in CSV."""

import csv
import subprocess
import sys

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
    expected = {"z": "m", "qw": "1", "alpha_1": "rad", "tau_alpha_1": "N m"}
    assert {name: units[name] for name in expected} == expected


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


def refuse(*_):
    raise OSError(28, "no room")


def test_files_are_whole_or_not_there(flight, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    for method in (flight.to_csv, flight.to_netcdf):
        with pytest.raises(st.NotWritten, match="not written"):
            method(tmp_path / "file" / "a")
        (tmp_path / "a").write_text("before")
        with monkeypatch.context() as change:
            change.setattr("pathlib.Path.replace", refuse)
            with pytest.raises(st.NotWritten, match="no room"):
                method(tmp_path / "a")
        assert (tmp_path / "a").read_text() == "before"
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "file"]


# Libraries of extras: imported by those who ask for them, and missed by name.


def test_an_extra_that_is_missing_is_named_and_csv_needs_none(flight, monkeypatch, tmp_path):
    for extra in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, extra, None)
    path = tmp_path / "a.nc"
    for call, extra in (
        (flight.to_xarray, "xarray"),
        (lambda: flight.to_netcdf(path), "xarray"),
        (flight.to_dataframe, "pandas"),
    ):
        with pytest.raises(st.ExtraMissing, match=rf"serpentail\[{extra}\]") as caught:
            call()
        assert isinstance(caught.value, ImportError) and list(tmp_path.iterdir()) == []
    assert flight.to_csv(tmp_path / "a.csv").stat().st_size > 1000


def test_who_does_not_ask_loads_nothing():
    program = (
        "import sys, serpentail as st; st.Trajectory, st.Rollouts, st.Plan\n"
        "print([n for n in sys.modules if n in ('pandas', 'xarray') or 'containers' in n])"
    )
    command = [sys.executable, "-W", "error", "-c", program]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout == "[]\n"
