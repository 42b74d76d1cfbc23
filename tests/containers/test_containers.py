"""Datasets with named dimensions and units, tables of a row a sample, and their files with every
digit, NetCDF and CSV: of a flight, drops on the ground, and runs that end early.
"""

import csv
import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
import xarray
from numpy.testing import assert_array_equal as equal
from scipy.io import netcdf_file

import serpentail as st
from tests.motion.conftest import motion
from tests.support import zoo

SETTINGS = {"legs": st.Legs.fixed(3.6, -0.3), "output_step": 0.002, "rtol": 1e-6}
FEET = [f"feet_{side}_{point}" for side in ("right", "left") for point in "AMT"]
START = [0, 0, 0.06, 1, 0, 0, 0, 0.1, 0]


def tired(t, q, v):
    """A controller that gives up at 0.01 s, above 1 m."""
    if t > 0.01 and q[2] > 1:
        raise st.SimulationError("it is tired")
    return np.zeros(2)


def dropped(q, span, **settings):
    return st.simulate(zoo.model("feet_tail"), q, np.zeros(8), t_span=span, **SETTINGS, **settings)


@pytest.fixture
def flight():
    """An analytic motion without a model."""
    return motion(np.linspace(0, 0.4, 41))


@pytest.fixture(scope="module")
def drop():
    """A rat that falls on its feet."""
    return dropped(START, 0.1)


@pytest.fixture(scope="module")
def runs():
    """Three runs with frictions of their own; run 1 fails at 0.01 s, run 2 never gets off."""
    q = np.tile(START, (3, 1))
    q[1, 2] = 2
    own = {"mu": [0.1, 0.2, 0.3], "tail_mount": np.tile([0, -0.04, 0.004], (3, 1))}
    return dropped(q, 0.04, parameters=own, controller=tired)


# Datasets.


def test_a_flight_has_named_coordinates(flight):
    data = flight.to_xarray()
    assert dict(data.sizes) == {"time": 41, "coordinate": 11, "rate": 10, "joint": 4, "axis": 3}
    names = ["x", "y", "z", "qw", "qx", "qy", "qz", "pitch_1", "yaw_1", "pitch_2", "yaw_2"]
    assert data.coordinate.values.tolist() == names
    equal(data.q.sel(coordinate=names), flight.q)
    equal(data.v.sel(rate="omega_x"), flight.v[:, 3])
    equal(data.v.sel(rate="pitch_2_dot"), flight.v[:, 8])
    equal(data.tau.sel(joint="yaw_1"), flight.tau[:, 1])
    equal(data.time, flight.t)
    for name in ("kinetic", "potential", "linear_momentum", "angular_momentum"):
        equal(data[name], getattr(flight, name))


def test_tail_coordinates_are_called_as_their_model_calls_them():
    for name, pair in (
        ("m1_n1", ["alpha_1", "beta_1"]),
        ("arcs1", ["a_1", "b_1"]),
        ("polar", ["phi_1", "theta_1"]),
    ):
        q = [0, 0, 0, 1, 0, 0, 0, 0.1, 0.1]
        data = st.simulate(zoo.model(name), q, np.zeros(8), t_span=0.01).to_xarray()
        assert data.joint.values.tolist() == data.coordinate.values.tolist()[7:] == pair
        assert data["rate"].values.tolist()[6:] == [f"{each}_dot" for each in pair]


def test_units_and_facts_are_attributes(drop):
    data = drop.to_xarray()
    assert {name: variable.attrs["units"] for name, variable in data.data_vars.items()} == {
        **{"q": "m, 1, rad", "v": "m/s, rad/s", "tau": "N m", "kinetic": "J", "potential": "J"},
        **{"linear_momentum": "kg m/s", "angular_momentum": "kg m^2/s"},
        **{"points": "m", "forces": "N", "bristles": "m", "legs": "rad"},
    }
    assert all(variable.attrs["long_name"] for variable in data.data_vars.values())
    assert data.time.attrs["units"] == "s"
    found = data.coordinate_units.sel(coordinate=["z", "qx", "alpha_1"])
    assert found.values.tolist() == ["m", "1", "rad"]
    assert data.rate_units.sel(rate=["vx", "omega_z"]).values.tolist() == ["m/s", "rad/s"]
    assert data.attrs["method"] == "ros34pw2" and data.attrs["steps"] == drop.info["steps"]
    assert json.loads(data.attrs["info"]) == drop.info and "events" not in data.attrs


def test_points_are_named_and_grouped(drop, flight):
    data, contact = drop.to_xarray(), drop.contact
    assert data.point.values.tolist()[:6] == FEET
    equal(data.forces.isel(point=data.group == "tail"), contact.of("tail").forces)
    equal(data.points.sel(point="feet_left_T", axis="z"), contact.points[:, 5, 2])
    equal(data.legs.sel(leg="delta_left"), contact.legs[:, 3])
    equal(data.bristles.sel(plane="y"), contact.bristles[..., 1])
    # only feet of six points have names for each
    none = np.zeros((41, 2, 3))
    contact = st.Contact(none, none, none[..., :2], {"feet": 2})
    data = dataclasses.replace(flight, contact=contact).to_xarray()
    assert data.point.values.tolist() == ["feet_1", "feet_2"] and "legs" not in data


def test_runs_have_nan_after_their_end_and_keep_errors_and_parameters(runs):
    data = runs.to_xarray()
    assert data.q.dims == ("run", "time", "coordinate")
    assert data.forces.dims == ("run", "time", "point", "axis")
    reached = np.isfinite(runs.q[..., 0])
    assert 0 < reached[1].sum() < reached[0].sum() == 21
    for name in ("q", "v", "tau", "kinetic", "forces", "points", "bristles", "legs"):
        array = data[name].values.reshape(3, 21, -1)
        assert np.array_equal(np.isfinite(array).all(axis=2), reached), name
    begun = runs.errors[1].trajectory.contact.points
    equal(data.forces.isel(run=2), runs[2].contact.forces)
    equal(data.points.isel(run=1)[: len(begun)], begun)
    equal(data.ends, runs.ends)
    assert data.ends.attrs["units"] == "s"
    assert data.errors.values.tolist() == ["", "it is tired", ""]
    assert data.mu.dims == ("run",) and data.mu.values.tolist() == [0.1, 0.2, 0.3]
    assert data.tail_mount.dims == ("run", "axis") and data.tail_mount.attrs["units"] == "m"


def test_a_run_that_stops_at_an_event_keeps_the_common_times():
    """The Trajectory of such a run has its stop as a last sample, between two common times."""
    q = np.tile(START, (2, 1))
    q[1, 2] = 0.5
    runs = dropped(q, 0.1, stop_at=[("touch_down", "feet")])
    data, stopped = runs.to_xarray(), runs[0]
    done = int(np.isfinite(runs.q[0, :, 0]).sum())
    assert stopped.t[-1] not in runs.t and len(stopped.t) == done + 1
    equal(data.points[0, :done], stopped.contact.points[:-1])
    assert np.isnan(data.points[0, done:]).all() and np.isfinite(data.points[1]).all()


def test_netcdf_gives_the_numbers_back_also_without_xarray(flight, drop, runs, tmp_path):
    path = tmp_path / "new" / "motion.nc"
    for each in (flight, motion(np.array([0.1]), 0), runs, drop):
        assert each.to_netcdf(str(path)) == path
        with xarray.open_dataset(path, decode_timedelta=True) as back:
            xarray.testing.assert_identical(back.load(), each.to_xarray())
    with netcdf_file(path, mmap=False) as file:
        assert file.variables["q"].dimensions == ("time", "coordinate")
        assert file.variables["forces"].units == b"N" and file.model == drop.info["model"].encode()
        q, t = file.variables["q"][:], file.variables["time"][:]
        names = [b"".join(row).decode() for row in file.variables["coordinate"][:]]
    equal(q, drop.q)
    equal(t, drop.t)
    assert [name.strip("\0") for name in names][:3] == ["x", "y", "z"]


def test_odd_facts_do_not_stop_a_file(flight, tmp_path):
    info = {"a/b c": 1, "big": 2**40, "yes": True, "none": None, "empty": "", "é": 1}
    info |= {"word": "ü", "info": 3}
    odd = dataclasses.replace(flight, info=info)
    with xarray.open_dataset(odd.to_netcdf(tmp_path / "odd.nc")) as back:
        facts = back.attrs
    assert facts["big"] == 2.0**40 and facts["yes"] == 1 and facts["word"] == "ü"
    assert not {"none", "a/b c", "é"} & set(facts)
    assert json.loads(facts["info"]) == info


# Tables.


def test_a_frame_has_a_row_a_sample(drop):
    table = drop.to_dataframe()
    assert table.index.name == "time"
    equal(table.index, drop.t)
    equal(table[["x", "y", "z"]], drop.q[:, :3])
    equal(table["alpha_1_dot"], drop.v[:, 6])
    equal(table["tau_beta_1"], drop.tau[:, 1])
    equal(table["linear_momentum_y"], drop.linear_momentum[:, 1])
    equal(table["forces_feet_left_A_z"], drop.contact.forces[:, 3, 2])
    equal(table["legs_gamma_right"], drop.contact.legs[:, 0])
    units = table.attrs["units"]
    assert set(units) == {"time", *table.columns}
    expected = {"z": "m", "qw": "1", "alpha_1": "rad", "tau_alpha_1": "N m"}
    assert expected.items() <= units.items()


def read(path):
    """Header and columns by their names of a CSV file, by the csv module."""
    with path.open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    assert len(header) == len(set(header)) and {len(row) for row in rows} == {len(header)}
    return header, dict(zip(header, np.array(rows, float).T, strict=True))


def test_csv_has_units_and_all_digits(drop, tmp_path):
    path = tmp_path / "new" / "drop.csv"
    assert drop.to_csv(str(path)) == path
    header, columns = read(path)
    assert header[:5] == ["time [s]", "x [m]", "y [m]", "z [m]", "qw [1]"]
    assert "forces_feet_right_A_x [N]" in header and "alpha_1_dot [rad/s]" in header
    equal(columns["time [s]"], drop.t)
    equal(np.stack([columns[name] for name in header[1:5]], axis=1), drop.q[:, :4])
    equal(columns["bristles_tail_1_y [m]"], drop.contact.of("tail").bristles[:, 0, 1])


def test_tables_of_runs_have_two_indices(runs, tmp_path):
    table = runs.to_dataframe()
    assert list(table.index.names) == ["run", "time"] and len(table) == 3 * 21
    equal(table["z"], runs.q[..., 2].ravel())
    assert table.loc[1, "z"].isna().any() and "mu" not in table.columns
    header, columns = read(runs.to_csv(tmp_path / "runs.csv"))
    assert header[:3] == ["run", "time [s]", "x [m]"]
    forces = columns["forces_feet_right_T_z [N]"].reshape(3, 21)[0]
    equal(columns["run"], np.repeat(range(3), 21))
    equal(columns["z [m]"], runs.q[..., 2].ravel())
    equal(forces, runs[0].contact.forces[:, 2, 2])


# Files, and libraries of extras: imported by those who ask for them, and missed by name.


def test_files_are_whole_or_not_there(flight, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(28, "no room")

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
