"""The benchmark: its peers' compilers, the processors that it stands for, its report of made-up
figures.
"""

import ctypes
import json
import platform
import subprocess
import sys

import pytest

from benchmarks import closing, processors, report
from benchmarks.comparison import faster
from benchmarks.first_table import block
from benchmarks.peak import best_chains
from benchmarks.peers import build, compilers
from benchmarks.targets import judged
from serpentail.model.compiler import compile_library
from tests.support import as_on
from tests.support.rows import row

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
WIDTH = """
int width(void);
int width(void) {
#if defined(__AVX512F__)
  return 512;
#elif defined(__AVX2__)
  return 256;
#else
  return 128;
#endif
}
"""


def test_the_faster_compiler_counts_and_is_named():
    times = [("casadi", "gcc", 150.0, 160.0), ("casadi", "clang", 100.0, 110.0)]
    assert faster((50.0, 55.0), times) == {
        **{"ns": 50.0, "median_ns": 55.0, "casadi_ns": 100.0},
        **{"casadi_ratio": "2.00x (2.00x)", "casadi_by": "clang, gcc 1.50x of it"},
    }
    assert best_chains({8: 50.0, 10: 60.0, 12: 60.0, 16: 48.0}) == (10, 60.0)


def test_the_report_compares_with_before_peers_limits_and_targets(monkeypatch, tmp_path):
    monkeypatch.setattr(closing, "BEFORE", tmp_path / "before.json")
    slower = json.loads(json.dumps(REPORT))
    slower["speed"][0]["ns"] = 150.0
    (tmp_path / "before.json").write_text(json.dumps(closing.figures(slower)))
    peak, eight, *_ = closing.closing(REPORT)
    assert (peak["what"], peak["value"], peak["times faster"]) == ("peak of a core", 80.0, "1.00x")
    assert (eight["before"], eight["value"], eight["times faster"]) == (150.0, 100.0, "1.50x")
    assert (eight["peer's best"], eight["peer / ours"]) == (80.0, "0.80x")
    assert (eight["limit"], eight["left"], eight["of the peak"]) == (50.0, "2.0x", "50%")
    other = closing.figures(REPORT) | {"machine": "another"}
    (tmp_path / "before.json").write_text(json.dumps(other))
    assert {line["before"] for line in closing.closing(REPORT)} == {""}
    assert block(REPORT)[2].endswith("us | 0.1 / 0.16 |  |  |  |")
    assert "This is the first run." in report.written(tmp_path, REPORT, {}, [])
    slower["speed"][0]["ns"] = 200.0
    again = report.written(tmp_path, slower, {}, [])
    assert "| speed | AVX-512, (1, 3) | serpentail, ns | 100 | 200 | 2 |" in again
    verdicts = [(line["model"], line["verdict"]) for line in judged(REPORT)]
    assert ("(1, 3)", "met") in verdicts and ("(1, 3)", "MISSED") in verdicts


def test_a_machine_stands_for_the_processors_that_it_has():
    for flags, names, lacks in [
        ("avx avx2 avx512f", ["AVX-512", "AVX2"], []),
        ("avx avx2", ["AVX2"], ["AVX-512: this processor has none"]),
        ("neon", [platform.machine()], list(processors.ABSENT.values())),
    ]:
        with row(flags):
            there = processors.processors(flags)
            assert [p.name for p in there] == names and processors.left_out(there) == lacks
            assert there[0].level is None


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="levels of x86-64")
def test_models_and_peers_keep_to_the_level_of_a_lesser_processor(monkeypatch, tmp_path):
    source = tmp_path / "width.c"
    source.write_text(WIDTH)
    asked = "import numpy as np; kinds = np.show_config(mode='dicts')['SIMD Extensions']"
    asked += "; print(*kinds.get('found', ()))"
    for level, width in [("x86-64-v3", 256), ("x86-64-v2", 128)]:
        with row(level):
            monkeypatch.setenv(processors.LEVEL, level)
            made = build.by_each(lambda compiler: build.build_library(source, tmp_path, compiler))
            monkeypatch.setenv("CC", as_on.surroundings(level)["CC"])
            paths = [*made.values(), compile_library([source], tmp_path, cache=tmp_path / level)]
            assert {ctypes.CDLL(str(path)).width() for path in paths} == {width}
    command = [sys.executable, as_on.__file__, level, sys.executable, "-c", asked]
    found = subprocess.check_output(command, text=True).split()
    assert not [name for name in found if name.startswith(as_on.LEVELS[level][1])]


def test_compilers_that_are_missing_or_too_slow_are_left_out_and_told(monkeypatch, capsys):
    clang = compilers.Compiler("clang", ("clang",), ("clang++",), "clang 22")
    gcc = compilers.Compiler("gcc", ("gcc",), ("g++",), "gcc 12")
    assert compilers.told((gcc, clang)).endswith("the faster of gcc: gcc 12; clang: clang 22")
    monkeypatch.setitem(sys.modules, "ziglang", None)
    assert [compiler.name for compiler in compilers.compilers.__wrapped__()] == ["gcc"]
    monkeypatch.setattr(compilers.shutil, "which", lambda name: None)
    with pytest.raises(compilers.PeerUnavailable, match=r"gcc .*\[peers\]"):
        compilers.compilers.__wrapped__()
    monkeypatch.setattr(build, "PATIENCE", 0.2)
    monkeypatch.setattr(build, "compilers", lambda: (gcc, clang))
    slow = ["sh", "-c", "sleep 600 & wait"]  # as a driver waits for its compiler
    assert build.by_each(lambda c: build.run(slow) if c is clang else "made") == {"gcc": "made"}
    assert capsys.readouterr().err.startswith("clang is left out: ")
