"""The benchmark's tables: what a report of made-up figures says."""

import json

import pytest

from benchmarks import closing, report
from benchmarks.comparison import faster
from benchmarks.first_table import block
from benchmarks.peak import best_chains
from benchmarks.processors import Processor

FD = {"function": "forward_dynamics", "model": "(1, 3)"}
REPORT = {
    "machine": {"processor": "made up", "peers": "gcc only"},
    "peak": [{"processor": "AVX-512", "scalar_gf": 10.0, "vector_gf": 80.0}],
    "speed": [
        {"processor": name, "model": "(1, 3)", "ns": ns, "plain_ns": 2000.0, "own_ns": 500.0}
        for name, ns in (("AVX-512", 100.0), ("AVX2", 160.0))
    ],
    "other_peers": [{"processor": "AVX-512", "model": "(1, 3)", "ns": 100.0, "casadi_ns": 80.0}],
    "operation_counts": [FD | {"executed": 1000.0, "needed": 500.0}],
    "rollout_rates": [{"processor": "AVX2", "model": "(3, 4)", "6000 in a call, 1/s": 14321.0}],
    "seconds": [{"measure": "speed", "processor": "AVX2", "took_s": 7.0}],
}


def test_the_faster_compiler_counts_and_is_named():
    times = [("casadi", "gcc", 150.0, 160.0), ("casadi", "clang", 100.0, 110.0)]
    row = faster((50.0, 55.0), [*times, ("mujoco", "gcc", 500.0, 550.0)])
    assert row == {
        **{"ns": 50.0, "median_ns": 55.0},
        **{"casadi_ns": 100.0, "casadi_ratio": "2.00x (2.00x)"},
        **{"casadi_by": "clang, gcc 1.50x of it"},
        **{"mujoco_ns": 500.0, "mujoco_ratio": "10.00x (10.00x)", "mujoco_by": "gcc"},
    }


def test_the_number_of_chains_that_does_most_is_the_peak():
    assert best_chains({8: 50.0, 10: 60.0, 12: 60.0, 16: 48.0}) == (10, 60.0)


def test_the_closing_table_has_before_peer_and_limit(monkeypatch, tmp_path):
    monkeypatch.setattr(closing, "BEFORE", tmp_path / "before.json")
    slower = json.loads(json.dumps(REPORT))
    slower["speed"][0]["ns"], slower["rollout_rates"][0]["6000 in a call, 1/s"] = 150.0, 7160.5
    (tmp_path / "before.json").write_text(json.dumps(closing.figures(slower)))
    assert "so not shown" not in closing.about(REPORT)
    peak, eight, four, flights = closing.closing(REPORT)
    assert (peak["what"], peak["value"], peak["times faster"]) == ("peak of a core", 80.0, "1.00x")
    assert (eight["before"], eight["value"], eight["times faster"]) == (150.0, 100.0, "1.50x")
    assert (eight["peer's best"], eight["peer / ours"]) == (80.0, "0.80x")
    assert (eight["limit"], eight["left"], eight["of the peak"]) == (50.0, "2.0x", "50%")
    # no peak and no CasADi were measured there
    assert (four["times faster"], four["peer's best"], four["limit"]) == ("1.00x", 500.0, "")
    assert (flights["times faster"], flights["peer / ours"]) == ("2.00x", "")


def test_figures_of_another_machine_are_not_compared(monkeypatch, tmp_path):
    monkeypatch.setattr(closing, "BEFORE", tmp_path / "before.json")
    other = closing.figures(REPORT) | {"machine": "another"}
    (tmp_path / "before.json").write_text(json.dumps(other))
    assert "of another processor (another), so not shown" in closing.about(REPORT)
    assert {row["before"] for row in closing.closing(REPORT)} == {""}


def test_the_table_of_the_benchmarks_page_has_both_processors_in_a_cell():
    head, _, *rows = block(REPORT)
    assert (
        head == "| articulated tail (m, n): AVX-512 / AVX2 | (1, 3) | (3, 4) | (6, 6) | (8, 16) |"
    )
    assert rows == [
        "| **forward dynamics, one call from C**, us | 0.1 / 0.16 |  |  |  |",
        "| Pinocchio, as its documentation shows it | 20x / 12x |  |  |  |",
        "| Pinocchio's data types, coupled joints summed by hand | 5x / 3.1x |  |  |  |",
    ]


def test_a_report_has_its_tables_and_what_changed(tmp_path):
    words = {"speed": "Nanoseconds.", "other_peers": "Others."}
    first = report.written(tmp_path, REPORT, words, [])
    assert "made up; gcc only" in first and "This is the first run." in first
    assert "| AVX2 | (1, 3) | 160 | 2e+03 | 500 |" in first
    slower = json.loads(json.dumps(REPORT))
    slower["speed"][1]["ns"] = 320.0
    again = report.written(tmp_path, slower, words, [])
    assert "| speed | AVX2, (1, 3) | serpentail, ns | 160 | 320 | 2 |" in again
    assert (tmp_path / "report.html").read_text().count("<table>") == 6
    assert json.loads((tmp_path / "figures.json").read_text())["machine"] == "made up"


def test_rows_that_lack_a_column_leave_its_cell_empty():
    rows = [{"model": "(1, 3)", "ns": 1.0}, {"model": "(6, 6)", "other": 2.0}]
    assert report.table(rows)[2:] == ["| (1, 3) | 1 |  |", "| (6, 6) |  | 2 |"]


def test_an_interrupted_run_resumes_with_what_is_missing(tmp_path, monkeypatch, capsys):
    from benchmarks import measures  # with every peer: seconds for each worker, were it above

    ran, broken = [], [True]

    def speed(_scratch):
        """Nanoseconds."""
        ran.append("speed")
        return [{"model": "(1, 3)", "ns": 1.5}]

    def drift(_scratch):
        """Change."""
        ran.append("drift")
        if broken.pop():
            raise KeyboardInterrupt
        return [{"model": "(1, 3)", "change": 1e-10}]

    found = {"speed": measures.Measure(speed, True), "drift": measures.Measure(drift)}
    monkeypatch.setattr(measures, "MEASURES", found)
    monkeypatch.setattr(measures.processors, "processors", lambda: [Processor("AVX2")])
    with pytest.raises(KeyboardInterrupt):
        measures.bench(tmp_path, tuple(found))
    broken.append(False)
    measures.bench(tmp_path, tuple(found))
    assert ran == ["speed", "drift", "drift"]
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["speed"] == [{"processor": "AVX2", "model": "(1, 3)", "ns": 1.5}]
    assert report["drift"] == [{"model": "(1, 3)", "change": 1e-10}]
    broken.append(False)
    measures.bench(tmp_path, tuple(found))  # what a whole run found is measured again
    assert ran[3:] == ["speed", "drift"] and "1e-10" in capsys.readouterr().out
