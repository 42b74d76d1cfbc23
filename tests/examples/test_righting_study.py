"""The righting study: which task each way of planning gets, and the table of what came out."""

import numpy as np
import pytest

from examples import righting
from examples.studies import righting_kinds as kinds
from examples.studies.righting_figures import draw_rates
from tests.support.rows import row
from tests.support.tumbling import rat


def plans(count, cpu, error):
    numbers = {"converged": True, "cpu_s": cpu, "open_loop_attitude_error_deg": error}
    return [numbers] * count


def test_the_paper_has_no_cells_where_the_objective_is_not_its_own(tmp_path):
    wanted = kinds.titles(20)
    ways = {name: [way for other, way in wanted if other == name] for name in kinds.KINDS}
    assert {name for name, found in ways.items() if "paper" not in found} == {
        "least energy",
        "least time",
    }
    errors = {"auto": 0.001, "IPOPT": 0.02, "paper": np.nan}
    found = {title: plans(2, 1.0, errors[way]) for (_, way), of in wanted.items() for title in of}
    rates = kinds.rows_of(20, found)
    lines = {line.split(" | ")[0][2:]: line.split("|")[2:-1] for line in kinds.table(rates)[2:]}
    both = [[" 0 ", " 1, 1 ", " nan "], ["  ", "  ", "  "]]
    for name, cells in lines.items():
        count = str(len(rates[name]["IPOPT"]))
        with row(name):
            assert cells[:4] == [f" {count} ", f" {count} ", " 1, 1 ", " 0.001 "]
            assert cells[4:7] == [" 0 ", " 1, 1 ", " 0.02 "]
            assert cells[7:] == both["paper" not in rates[name]]
    _, axes = draw_rates(rates, tmp_path / "rates.png")
    points = [len(line.get_xdata()) for line in axes[0].get_lines()]
    assert points == [len(kinds.KINDS)] * 2 + [len(kinds.KINDS) - 2]


def test_both_ways_get_one_task(monkeypatch):
    """The same start, duration, bounds and goal; the paper's time is limited, too."""
    asked = {}

    def ask(_, *task, **given):
        asked.update(given, task=task)

    monkeypatch.setattr(kinds.righting, "model", lambda *_: rat())
    monkeypatch.setattr(kinds.st, "plan", lambda model, **given: asked.update(given))
    monkeypatch.setattr(kinds.righting, "row", lambda _: {})
    monkeypatch.setattr(kinds.truth, "planned", ask)
    monkeypatch.setattr(kinds.truth, "row", lambda *_: {})
    for name, least, most in (("(1, 3), any rate", 0.3, 0.58), ("falling cat, 1 s", 0.3, 1.0)):
        kind = kinds.KINDS[name]
        asked.clear()
        with row(name):
            assert [found["start"] for found in kinds.block(kind, "paper", [3, 4])] == [3, 4]
            kinds.block(kind, "IPOPT", [4])
            q, v = righting.tumbling(rat(), 4)
            for (q0, v0), duration, bounds in (
                asked["task"],
                (asked["start"], asked["duration"], asked["bounds"]),
            ):
                np.testing.assert_array_equal(q0, q)
                np.testing.assert_array_equal(v0, v * (name != "falling cat, 1 s"))
                assert duration == (least, most) and bounds.torque == righting.TORQUE
                assert bounds.angle == pytest.approx(np.pi / 3)
            assert asked["time_limit"] == asked["solver"].time_limit == kinds.LIMIT
            assert asked["solver"].name == "ipopt"
            free = name == "(1, 3), any rate"
            assert asked["at_rest"] is not free and ("goal" in asked) is free
