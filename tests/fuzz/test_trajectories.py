"""Trajectories are made, sampled anew, kept and read, or refused by a ValueError."""

import numpy as np
import pytest
import xarray
from hypothesis import strategies as some

import serpentail as st
from tests.motion.conftest import fields, motion
from tests.support.rows import row

from .searching import answer
from .strange import FORMS, strange

REFUSED = (ValueError, st.SerpentailError)
SOME_TIMES = some.lists(some.floats(-9, 9), min_size=1, max_size=9, unique=True).map(sorted)
INSIDE = some.lists(some.floats(0, 0.4), min_size=1, max_size=5, unique=True).map(sorted)


@pytest.fixture(scope="module")
def flight():
    return motion(np.linspace(0, 0.4, 21), segments=1)


def test_fields_are_taken_or_refused(flight, search):
    def law(name, value):
        answer(st.Trajectory, refusals=REFUSED, **fields(flight) | {name: value})

    names = some.sampled_from([*fields(flight), "contact"])
    search(law, name=names, value=strange((21,)) | strange((21, 9)))


def test_the_same_numbers_make_the_same_motion(flight):
    for form, formed in FORMS.items():
        given = {name: x for name, x in fields(flight).items() if name != "info"}
        if form == "float32":
            given = {name: x.astype(np.float32).astype(float) for name, x in given.items()}
        expected = st.Trajectory(**given)
        found = st.Trajectory(**{name: formed(x) for name, x in given.items()})
        for name in given:
            with row(form, name):
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
                assert type(getattr(found, name)) is np.ndarray
                assert getattr(found, name).flags.c_contiguous


def test_new_samples_are_one_by_one_what_they_are_together(flight, search):
    def law(times, odd):
        answer(flight.resample, odd, refusals=REFUSED)
        together = answer(flight.resample, times)
        for k, t in enumerate(times):
            alone = answer(flight.resample, [t])
            for name in ("q", "v", "tau", "kinetic"):
                np.testing.assert_allclose(
                    getattr(alone, name)[0], getattr(together, name)[k], rtol=0, atol=1e-13
                )

    search(law, times=INSIDE, odd=strange((3,)) | some.lists(some.floats(-0.1, 0.5), max_size=5))


def test_what_is_kept_is_read_again(search, tmp_path):
    def law(times, segments):
        flight = motion(np.array(times), segments)
        again = st.Trajectory.load(flight.save(tmp_path / "run"))
        for name, value in fields(flight).items():
            np.testing.assert_array_equal(getattr(again, name), value)
        table = np.genfromtxt(flight.to_csv(tmp_path / "run.csv"), delimiter=",", names=True)
        table = np.atleast_1d(table)
        np.testing.assert_array_equal(table["time_s"], flight.t)
        np.testing.assert_array_equal(table["qw_1"], flight.q[:, 3])
        np.testing.assert_array_equal(flight.to_xarray().q, flight.q)
        with xarray.open_dataset(flight.to_netcdf(tmp_path / "run.nc")) as data:
            np.testing.assert_array_equal(data.v, flight.v)

    search(law, times=SOME_TIMES, segments=some.integers(0, 3))


def test_names_of_files_are_taken_or_refused(flight, search, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = some.text(some.characters(codec="utf-8", exclude_characters="/"), max_size=300)

    def law(method, name):
        found = answer(getattr(flight, method), name, refusals=(*REFUSED, TypeError))
        assert found is None or found.stat().st_size > 100
        if found is not None and method == "save":
            np.testing.assert_array_equal(st.Trajectory.load(found).q, flight.q)
        assert {p.resolve().parent for p in tmp_path.iterdir()} <= {tmp_path.resolve()}

    methods = some.sampled_from(["save", "to_csv", "to_netcdf"])
    search(law, method=methods, name=names | some.none() | some.integers())
