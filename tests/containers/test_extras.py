"""Libraries of extras: imported by those who ask for them, and missed by name."""

import subprocess
import sys

import pytest

import serpentail as st

CALLS = {"to_xarray": "xarray", "to_netcdf": "xarray", "to_dataframe": "pandas"}


@pytest.mark.parametrize("method, extra", CALLS.items())
def test_an_extra_that_is_missing_is_named(method, extra, flight, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, extra, None)
    arguments = [tmp_path / "a.nc"] if method == "to_netcdf" else []
    with pytest.raises(st.ExtraMissing, match=rf'pip install "serpentail\[{extra}\]"') as caught:
        getattr(flight, method)(*arguments)
    assert isinstance(caught.value, ImportError) and list(tmp_path.iterdir()) == []


def test_csv_needs_none(flight, monkeypatch, tmp_path):
    for name in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
    assert flight.to_csv(tmp_path / "a.csv").stat().st_size > 1000


def test_who_does_not_ask_loads_nothing():
    program = (
        "import sys, serpentail as st; st.Trajectory, st.Rollouts, st.Plan\n"
        "print([n for n in sys.modules if n in ('pandas', 'xarray') or 'containers' in n])"
    )
    command = [sys.executable, "-W", "error", "-c", program]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout == "[]\n"
