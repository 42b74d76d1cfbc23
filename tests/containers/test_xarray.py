"""Datasets: named dimensions, units, NaN after a run's end, and NetCDF files with the same bits."""

import dataclasses
import json

import numpy as np
import xarray
from scipy.io import netcdf_file

import serpentail as st
from tests.support import zoo

from .conftest import SETTINGS

FEET = [f"feet_{side}_{point}" for side in ("right", "left") for point in "AMT"]


def test_a_flight_has_named_coordinates(flight):
    data = flight.to_xarray()
    assert dict(data.sizes) == {"time": 41, "coordinate": 11, "rate": 10, "joint": 4, "axis": 3}
    names = ["x", "y", "z", "qw", "qx", "qy", "qz", "pitch_1", "yaw_1", "pitch_2", "yaw_2"]
    assert data.coordinate.values.tolist() == names
    assert np.array_equal(data.q.sel(coordinate="z"), flight.q[:, 2])
    assert np.array_equal(data.q.sel(coordinate="qw"), flight.q[:, 3])
    assert np.array_equal(data.q.sel(coordinate="yaw_2"), flight.q[:, 10])
    assert np.array_equal(data.v.sel(rate="omega_x"), flight.v[:, 3])
    assert np.array_equal(data.v.sel(rate="pitch_2_dot"), flight.v[:, 8])
    assert np.array_equal(data.tau.sel(joint="yaw_1"), flight.tau[:, 1])
    for name in ("kinetic", "potential", "linear_momentum", "angular_momentum"):
        assert np.array_equal(data[name], getattr(flight, name))
    assert np.array_equal(data.time, flight.t)


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


def test_units_are_attributes(drop):
    data = drop.to_xarray()
    units = {name: variable.attrs["units"] for name, variable in data.data_vars.items()}
    assert units == {
        **{"q": "m, 1, rad", "v": "m/s, rad/s", "tau": "N m", "kinetic": "J", "potential": "J"},
        **{"linear_momentum": "kg m/s", "angular_momentum": "kg m^2/s"},
        **{"points": "m", "forces": "N", "bristles": "m", "legs": "rad"},
    }
    assert all(variable.attrs["long_name"] for variable in data.data_vars.values())
    assert data.time.attrs["units"] == "s"
    found = data.coordinate_units.sel(coordinate=["z", "qx", "alpha_1"])
    assert found.values.tolist() == ["m", "1", "rad"]
    assert data.rate_units.sel(rate=["vx", "omega_z"]).values.tolist() == ["m/s", "rad/s"]


def test_points_are_named_and_grouped(drop):
    data = drop.to_xarray()
    assert data.point.values.tolist()[:6] == FEET
    tail = data.forces.isel(point=data.group == "tail")
    assert np.array_equal(tail, drop.contact.of("tail").forces)
    toe = data.points.sel(point="feet_left_T", axis="z")
    assert np.array_equal(toe, drop.contact.points[:, 5, 2])
    assert np.array_equal(data.legs.sel(leg="delta_left"), drop.contact.legs[:, 3])
    assert np.array_equal(data.bristles.sel(plane="y"), drop.contact.bristles[..., 1])


def test_points_of_other_feet_are_counted(flight):
    """Only feet of six points have names for each."""
    none = np.zeros((41, 2, 3))
    contact = st.Contact(none, none, none[..., :2], {"feet": 2})
    data = dataclasses.replace(flight, contact=contact).to_xarray()
    assert data.point.values.tolist() == ["feet_1", "feet_2"] and "legs" not in data


def test_facts_are_attributes(drop):
    facts = drop.to_xarray().attrs
    assert facts["method"] == "ros34pw2" and facts["steps"] == drop.info["steps"]
    assert json.loads(facts["info"]) == drop.info
    assert "events" not in facts


def test_runs_have_nan_after_their_end(runs):
    data = runs.to_xarray()
    assert data.q.dims == ("run", "time", "coordinate")
    assert data.forces.dims == ("run", "time", "point", "axis")
    reached = np.isfinite(runs.q[..., 0])
    assert 0 < reached[1].sum() < reached[0].sum() == 21
    for name in ("q", "v", "tau", "kinetic", "forces", "points", "bristles", "legs"):
        array = data[name].values.reshape(3, 21, -1)
        assert np.array_equal(np.isfinite(array).all(axis=2), reached), name
    assert np.array_equal(data.forces.isel(run=2), runs[2].contact.forces)
    begun = runs.errors[1].trajectory.contact
    assert np.array_equal(data.points.isel(run=1)[: len(begun.points)], begun.points)


def test_runs_keep_ends_errors_and_parameters(runs):
    data = runs.to_xarray()
    assert np.array_equal(data.ends, runs.ends) and data.ends.attrs["units"] == "s"
    assert data.errors.values.tolist() == ["", "it is tired", ""]
    assert data.mu.dims == ("run",) and data.mu.values.tolist() == [0.1, 0.2, 0.3]
    assert data.tail_mount.dims == ("run", "axis") and data.tail_mount.attrs["units"] == "m"


def test_a_run_that_stops_at_an_event_keeps_the_common_times(drop):
    """The Trajectory of such a run has its stop as a last sample, between two common times."""
    model = drop.model
    q = np.tile(drop.q[0], (2, 1))
    q[1, 2] = 0.5
    settings = {"t_span": 0.1, "stop_at": [("touch_down", "feet")], **SETTINGS}
    runs = st.simulate(model, q, np.zeros(8), **settings)
    data = runs.to_xarray()
    stopped = runs[0]
    done = int(np.isfinite(runs.q[0, :, 0]).sum())
    assert stopped.t[-1] not in runs.t and len(stopped.t) == done + 1
    assert np.array_equal(data.points[0, :done], stopped.contact.points[:-1])
    assert np.isnan(data.points[0, done:]).all() and np.isfinite(data.points[1]).all()


def test_netcdf_gives_the_numbers_back(flight, drop, runs, tmp_path):
    for motion in (flight, drop, runs):
        path = tmp_path / "new" / "motion.nc"
        assert motion.to_netcdf(str(path)) == path
        with xarray.open_dataset(path, decode_timedelta=True) as back:
            xarray.testing.assert_identical(back.load(), motion.to_xarray())


def test_a_program_without_xarray_reads_it(drop, tmp_path):
    path = drop.to_netcdf(tmp_path / "drop.nc")
    with netcdf_file(path, mmap=False) as file:
        assert file.variables["q"].dimensions == ("time", "coordinate")
        assert file.variables["forces"].units == b"N" and file.model == drop.info["model"].encode()
        q, t = file.variables["q"][:], file.variables["time"][:]
        names = [b"".join(row).decode() for row in file.variables["coordinate"][:]]
    assert np.array_equal(q, drop.q) and np.array_equal(t, drop.t)
    assert [name.strip("\0") for name in names][:3] == ["x", "y", "z"]


def test_odd_facts_do_not_stop_a_file(flight, tmp_path):
    info = {"a/b c": 1, "big": 2**40, "yes": True, "none": None, "empty": "", "é": 1}
    info |= {"word": "ü", "info": 3}
    odd = dataclasses.replace(flight, info=info)
    with xarray.open_dataset(odd.to_netcdf(tmp_path / "odd.nc")) as back:
        facts = back.attrs
    assert facts["big"] == 2.0**40 and facts["yes"] == 1 and "none" not in facts
    assert "a/b c" not in facts and "é" not in facts and facts["word"] == "ü"
    assert json.loads(facts["info"]) == info
