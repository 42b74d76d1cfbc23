"""Datasets with named dimensions and units, tables of a row a sample, and their files."""

import csv
import dataclasses
import json
import sys

import numpy as np
import pytest
import xarray
from numpy.testing import assert_array_equal as equal
from scipy.io import netcdf_file

import serpentail as st
from serpentail.basics.files import without_quote, write_csv
from tests.motion.conftest import motion
from tests.support import zoo

FLIGHT = motion(np.linspace(0, 0.4, 41))  # without a model
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


def test_coordinates_are_named_those_of_the_tail_as_their_model_calls_them():
    data = FLIGHT.to_xarray()
    assert dict(data.sizes) == {"time": 41, "coordinate": 11, "rate": 10, "joint": 4, "axis": 3}
    names = ["x", "y", "z", "qw", "qx", "qy", "qz", "pitch_1", "yaw_1", "pitch_2", "yaw_2"]
    assert data.coordinate.values.tolist() == names
    equal(data.v.sel(rate="omega_x"), FLIGHT.v[:, 3])
    equal(data.v.sel(rate="pitch_2_dot"), FLIGHT.v[:, 8])
    equal(data.tau.sel(joint="yaw_1"), FLIGHT.tau[:, 1])
    equal(data.time, FLIGHT.t)
    for name in ("q", "kinetic", "potential", "linear_momentum", "angular_momentum"):
        equal(data[name], getattr(FLIGHT, name))
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
    assert data.attrs["method"] == "switching" and data.attrs["steps"] == drop.info["steps"]
    assert json.loads(data.attrs["info"]) == drop.info and "events" not in data.attrs


def test_points_are_named_and_grouped(drop):
    data, contact = drop.to_xarray(), drop.contact
    assert data.point.values.tolist()[:6] == FEET
    equal(data.forces.isel(point=data.group == "tail"), contact.of("tail").forces)
    equal(data.points.sel(point="feet_left_T", axis="z"), contact.points[:, 5, 2])
    equal(data.legs.sel(leg="delta_left"), contact.legs[:, 3])
    equal(data.bristles.sel(plane="y"), contact.bristles[..., 1])
    # only feet of six points have names for each
    none = np.zeros((41, 2, 3))
    contact = st.Contact(none, none, none[..., :2], {"feet": 2})
    data = dataclasses.replace(FLIGHT, contact=contact).to_xarray()
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


def test_netcdf_gives_the_numbers_back_also_without_xarray(drop, runs, tmp_path):
    path = tmp_path / "new" / "motion.nc"
    for each in (FLIGHT, motion(np.array([0.1]), 0), runs, drop):
        assert each.to_netcdf(str(path)) == path
        with xarray.open_dataset(path, decode_timedelta=True) as back:
            xarray.testing.assert_identical(back.load(), each.to_xarray())
    with netcdf_file(path, mmap=False) as file:
        assert file.variables["q"].dimensions == ("time", "coordinate")
        assert file.variables["forces"].units == b"N" and file.model == drop.info["model"].encode()
        equal(file.variables["q"][:], drop.q)
        equal(file.variables["time"][:], drop.t)
        names = [b"".join(row).decode() for row in file.variables["coordinate"][:]]
    assert [name.strip("\0") for name in names][:3] == ["x", "y", "z"]


def test_odd_facts_do_not_stop_a_file(tmp_path):
    info = {"a/b c": 1, "big": 2**40, "yes": True, "none": None, "empty": "", "é": 1}
    info |= {"word": "ü", "info": 3}
    odd = dataclasses.replace(FLIGHT, info=info)
    with xarray.open_dataset(odd.to_netcdf(tmp_path / "odd.nc")) as back:
        facts = back.attrs
    assert facts["big"] == 2.0**40 and facts["yes"] == 1 and facts["word"] == "ü"
    assert not {"none", "a/b c", "é"} & set(facts)
    assert json.loads(facts["info"]) == info


def read(path):
    """Columns by their names of a CSV file, by the csv module."""
    with path.open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    assert len(header) == len(set(header)) and {len(row) for row in rows} == {len(header)}
    return dict(zip(header, np.array(rows, float).T, strict=True))


def test_a_frame_and_a_csv_file_have_a_row_a_sample_units_and_all_digits(drop, tmp_path):
    table, path = drop.to_dataframe(), tmp_path / "new" / "drop.csv"
    assert table.index.name == "time" and drop.to_csv(str(path)) == path
    units, columns = table.attrs["units"], read(path)
    assert [*columns] == [f"{name} [{units[name]}]" for name in ("time", *table.columns)]
    equal(table.index, drop.t)
    equal(columns["time [s]"], drop.t)
    for name, unit, expected in (
        *(("z", "m", drop.q[:, 2]), ("qw", "1", drop.q[:, 3]), ("alpha_1", "rad", drop.q[:, 7])),
        *(("alpha_1_dot", "rad/s", drop.v[:, 6]), ("tau_beta_1", "N m", drop.tau[:, 1])),
        ("linear_momentum_y", "kg m/s", drop.linear_momentum[:, 1]),
        ("forces_feet_left_A_z", "N", drop.contact.forces[:, 3, 2]),
        ("bristles_tail_1_y", "m", drop.contact.of("tail").bristles[:, 0, 1]),
        ("legs_gamma_right", "rad", drop.contact.legs[:, 0]),
    ):
        equal(table[name], expected)
        equal(columns[f"{name} [{unit}]"], expected)


def test_tables_of_runs_have_two_indices(runs, tmp_path):
    table, columns = runs.to_dataframe(), read(runs.to_csv(tmp_path / "runs.csv"))
    assert list(table.index.names) == ["run", "time"] and "mu" not in table.columns
    assert [*columns][:3] == ["run", "time [s]", "x [m]"]
    equal(columns["run"], np.repeat(range(3), 21))
    for heights in (table["z"], columns["z [m]"]):
        equal(heights, runs.q[..., 2].ravel())
    equal(columns["forces_feet_right_T_z [N]"][:21], runs[0].contact.forces[:, 2, 2])


def test_an_extra_that_is_missing_is_named_and_csv_needs_none(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "xarray", None)
    monkeypatch.setitem(sys.modules, "pandas", None)
    for method, extra in (("to_xarray", "xarray"), ("to_dataframe", "pandas")):
        with pytest.raises(st.ExtraMissing, match=rf"serpentail\[{extra}\]"):
            getattr(FLIGHT, method)()
    with pytest.raises(st.ExtraMissing, match=r"serpentail\[xarray\]"):
        FLIGHT.to_netcdf(tmp_path / "a.nc")
    assert not list(tmp_path.iterdir())
    assert FLIGHT.to_csv(tmp_path / "a.csv").stat().st_size > 1000


def test_no_cell_of_a_csv_file_is_run_by_a_spreadsheet(tmp_path):
    """Numbers stay as they are, and what is read is what was written."""
    texts = ["=cmd|' /C calc'!A0", "+1+1", "-x", "@sum(1)", "\t=1", "\n=1", "'=1", "''@", "-5 deg"]
    plain = ["", "word", "'", "'x", "a=1", "-3", "+2.5e-3", "a,b", 'say "x"', "two\nlines"]
    path = write_csv(tmp_path / "cells.csv", [texts, plain, [-1.5, 3, True, None, "\r\n\r"]])
    with path.open(newline="") as stream:
        quoted, *rest = csv.reader(stream)
    assert all(cell.startswith("'") for cell in quoted)
    assert rest == [plain, ["-1.5", "3", "True", "", "'\n\n"]]
    assert [*map(without_quote, quoted)] == texts and [*map(without_quote, plain)] == plain
