"""Figures of studies show every kind of start, however few have a plan."""

import numpy as np

from examples.studies.righting_figures import draw_figure_11, draw_rates
from examples.studies.righting_kinds import KINDS, WAYS, is_true, rows_of, table, titles


def start(cpu_s, converged=True, error=1e-3):
    return {"cpu_s": cpu_s, "converged": converged, "open_loop_attitude_error_deg": error}


FAILED = start(5.0, converged=False, error=np.nan)
RATES = {
    "several": {
        "IPOPT": [start(0.2), start(0.1), start(0.4, error=3.0), start(0.3)],
        "FATROP": [start(0.1), start(0.1), start(0.1, error=np.nan), start(0.1)],
        "paper": [start(1.0, error=2.0)] * 4,
    },
    "none": {way: [FAILED] for way in WAYS},
}


def test_a_plan_is_true_if_it_converged_and_ends_where_it_should():
    assert is_true(start(1.0)) and not is_true(start(1.0, error=0.011))
    assert not is_true(start(1.0, converged=False)) and not is_true(FAILED)


def test_rates_are_drawn_for_each_kind_and_way(tmp_path):
    _, (shares, times, errors) = draw_rates(RATES, tmp_path / "rates.png")
    ipopts, fatrops, papers = shares.get_lines()
    np.testing.assert_array_equal(ipopts.get_xdata(), [75, 0])
    np.testing.assert_array_equal(fatrops.get_xdata(), [75, 0])
    np.testing.assert_array_equal(papers.get_xdata(), [0, 0])
    assert [label.get_text() for label in shares.get_yticklabels()] == ["several: 4", "none: 1"]
    np.testing.assert_allclose(times.get_lines()[0].get_xdata(), [0.25, 5.0])
    np.testing.assert_allclose(errors.get_lines()[2].get_xdata(), [2.0, np.nan])
    assert (tmp_path / "rates.png").read_bytes()[:4] == b"\x89PNG"


def test_a_table_has_a_line_for_each_kind():
    several, none = table(RATES)[2:]
    assert several.startswith("| several | 4 | 3 | 0.25, 0.39 | 0.001 | 3 | 0.1, 0.1 | 0.001 | ")
    assert several.endswith("| 0 | 1, 1 | 2 |") and none.startswith("| none | 1 | 0 | 5, 5 | nan |")
    assert {line.count("|") for line in table(RATES)} == {12}


def test_each_kind_has_its_starts_in_every_way():
    found = titles(200)
    assert set(found) == {(name, way) for name in KINDS for way in WAYS}
    rows = {
        title: [{"start": k} for k in make.args[2]]
        for makes in found.values()
        for title, make in makes.items()
    }
    for name, ways in rows_of(200, rows).items():
        for way in ways.values():
            assert [row["start"] for row in way] == list(range(1, 200 // KINDS[name].fewer + 1))


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
