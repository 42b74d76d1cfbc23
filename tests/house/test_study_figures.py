"""Figures of studies show every kind of start, however few have a plan."""

import numpy as np
import pytest

from examples.studies.righting_figures import draw_figure_11, draw_rates


def start(cpu_s, success=True, error=1e-3):
    return {"cpu_s": cpu_s, "success": success, "open_loop_attitude_error_deg": error}


KINDS = {
    "several": [start(0.2), start(0.1), start(0.4, success=False, error=3.0), start(0.3)],
    "one": [start(2.0)],
    "none": [start(5.0, success=False, error=np.nan)],
}


def test_shares_rise_from_nothing_and_end_at_the_edge(tmp_path):
    _, (times, errors) = draw_rates(KINDS, tmp_path / "rates.png")
    several, one, none = times.get_lines()
    np.testing.assert_array_equal(several.get_ydata(), [0, 25, 50, 75, 75])
    np.testing.assert_array_equal(several.get_xdata()[:4], [0.1, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(one.get_ydata(), [0, 100, 100])
    assert max(none.get_ydata()) == 0
    edge = times.get_xlim()[1]
    assert edge > 2.0 and several.get_xdata()[-1] == one.get_xdata()[-1] == pytest.approx(edge)
    assert errors.get_lines()[0].get_ydata()[-1] == 100
    assert (tmp_path / "rates.png").read_bytes()[:4] == b"\x89PNG"


def test_efforts_are_told_in_their_unit_and_times_without_powers_of_ten(tmp_path):
    row = {"frequency": 20, "converged": True, "iterations": 9, "effort": 2e-5, "dyn_err": 0.1}
    row |= {"solve_cpu_s": 0.02, "open_loop_attitude_error_deg": 1.0}
    rows = [row, row | {"frequency": 40, "solve_cpu_s": 0.4}, row | {"converged": False}]
    _, axes = draw_figure_11({"paper": rows, "ours": rows}, tmp_path / "fig11.png")
    np.testing.assert_allclose(axes.flat[1].get_lines()[0].get_ydata(), [20, 20])
    assert "mN m" in axes.flat[1].get_ylabel()
    figure = axes.flat[2].figure
    figure.draw_without_rendering()
    written = [label.get_text() for label in axes.flat[2].get_yticklabels()]
    assert {"0.05", "0.1", "0.2"} <= set(written)
