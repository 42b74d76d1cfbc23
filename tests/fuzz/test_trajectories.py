"""Trajectories are made, sampled anew, kept and read, or refused by a ValueError."""

import numpy as np
import pytest
import xarray
from hypothesis import assume
from hypothesis import strategies as some

import serpentail as st
from tests.motion.analytic import fields, motion

from .searching import answer
from .strange import FORMS, strange

REFUSED = (ValueError, st.SerpentailError)


@pytest.fixture(scope="module")
def flight():
    return motion(np.linspace(0, 0.4, 21), segments=1)


def test_fields_are_taken_or_refused(flight, search):
    def law(name, value):
        answer(st.Trajectory, refusals=REFUSED, **fields(flight) | {name: value})

    names = some.sampled_from([*fields(flight), "contact"])
    search(law, name=names, value=strange((21,)) | strange((21, 9)))


@pytest.mark.parametrize("form", FORMS)
def test_the_same_numbers_make_the_same_motion(flight, form):
    given = {name: x for name, x in fields(flight).items() if name != "info"}
    if form == "float32":
        given = {name: x.astype(np.float32).astype(float) for name, x in given.items()}
    expected = st.Trajectory(**given)
    found = st.Trajectory(**{name: FORMS[form](x) for name, x in given.items()})
    for name in given:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
        assert type(getattr(found, name)) is np.ndarray
        assert getattr(found, name).flags.c_contiguous


def test_times_of_new_samples_are_taken_or_refused(flight, search):
    def law(times):
        answer(flight.resample, times, refusals=REFUSED)

    near = some.lists(some.floats(-0.1, 0.5), max_size=5)
    inside = some.lists(some.floats(0, 0.4), min_size=1, max_size=5, unique=True).map(sorted)
    search(law, times=strange((3,)) | near | inside)


def test_new_samples_are_one_by_one_what_they_are_together(flight, search):
    def law(times):
        together = answer(flight.resample, times)
        for k, t in enumerate(times):
            alone = answer(flight.resample, [t])
            for name in ("q", "v", "tau", "kinetic"):
                np.testing.assert_allclose(
                    getattr(alone, name)[0], getattr(together, name)[k], rtol=0, atol=1e-13
                )

    times = some.lists(some.floats(0, 0.4), min_size=1, max_size=5, unique=True)
    search(law, times=times.map(sorted))


def test_what_is_kept_is_read_again(search, tmp_path):
    def law(times, segments):
        assume(len(times) == 1 or min(np.diff(times)) > 0)
        flight = motion(np.array(times), segments)
        again = st.Trajectory.load(flight.save(tmp_path / "run"))
        for name, value in fields(flight).items():
            np.testing.assert_array_equal(getattr(again, name), value)

    times = some.lists(some.floats(-9, 9), min_size=1, max_size=9, unique=True)
    search(law, times=times.map(sorted), segments=some.integers(0, 3))


def test_tables_have_what_was_kept(search, tmp_path):
    def law(times, segments):
        assume(len(times) == 1 or min(np.diff(times)) > 0)
        flight = motion(np.array(times), segments)
        again = np.genfromtxt(flight.to_csv(tmp_path / "run.csv"), delimiter=",", names=True)
        again = np.atleast_1d(again)
        np.testing.assert_array_equal(again["time_s"], flight.t)
        np.testing.assert_array_equal(again["qw_1"], flight.q[:, 3])
        np.testing.assert_array_equal(flight.to_xarray().q, flight.q)
        with xarray.open_dataset(flight.to_netcdf(tmp_path / "run.nc")) as data:
            np.testing.assert_array_equal(data.v, flight.v)

    times = some.lists(some.floats(-9, 9), min_size=1, max_size=9, unique=True)
    search(law, times=times.map(sorted), segments=some.integers(0, 3))


@pytest.mark.parametrize("method", ["to_csv", "to_netcdf"])
def test_names_of_tables_are_taken_or_refused(method, flight, search, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = some.text(some.characters(codec="utf-8", exclude_characters="/"), max_size=300)

    def law(name):
        found = answer(getattr(flight, method), name, refusals=(*REFUSED, TypeError))
        assert found is None or found.stat().st_size > 100
        assert {p.resolve().parent for p in tmp_path.iterdir()} <= {tmp_path.resolve()}

    search(law, name=names | some.none() | some.integers())


def test_names_of_files_are_taken_or_refused(flight, search, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = some.text(some.characters(codec="utf-8", exclude_characters="/"), max_size=300)

    def law(name):
        found = answer(flight.save, name, refusals=(*REFUSED, TypeError))
        if found is not None:
            np.testing.assert_array_equal(st.Trajectory.load(found).q, flight.q)
        assert {p.resolve().parent for p in tmp_path.iterdir()} <= {tmp_path.resolve()}

    search(law, name=names | some.none() | some.integers())
