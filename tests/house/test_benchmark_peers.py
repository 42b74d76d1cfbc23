"""The benchmark's peers are made by every compiler that is here, for the processor asked for."""

import ctypes
import platform
import sys
import time
from pathlib import Path

import pytest

from benchmarks import processors
from benchmarks.peers import build, compilers
from benchmarks.peers.compilers import Compiler

WIDTH = """
int width(void);
int width(void)
{
#if defined(__AVX512F__)
  return 512;
#elif defined(__AVX2__)
  return 256;
#else
  return 128;
#endif
}
"""
GCC = Compiler("gcc", ("gcc",), ("g++",), "gcc 12")
CLANG = Compiler("clang", ("clang",), ("clang++",), "clang 22")


def test_mujocos_chain_is_made_by_each_compiler(monkeypatch, tmp_path):
    from benchmarks.peers.mujoco_casadi import mujoco_library

    monkeypatch.setattr(build, "CACHE", tmp_path)
    found = build.by_each(mujoco_library)
    assert list(found) == [compiler.name for compiler in compilers.compilers()]
    assert all(library.mujoco_forward_dynamics for library in found.values())
    assert sorted(path.name.split("-")[1] for path in tmp_path.iterdir()) == sorted(found)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="levels of x86-64")
@pytest.mark.parametrize(("level", "width"), [("x86-64-v3", 256), ("x86-64-v2", 128)])
def test_each_compiler_keeps_to_the_level(level, width, monkeypatch, tmp_path):
    monkeypatch.setenv(processors.LEVEL, level)
    (tmp_path / "width.c").write_text(WIDTH)
    found = build.by_each(
        lambda compiler: build.build_library(tmp_path / "width.c", tmp_path, compiler)
    )
    assert [ctypes.CDLL(str(path)).width() for path in found.values()] == [width] * len(found)


def test_another_level_or_flag_is_another_library(monkeypatch, tmp_path):
    (tmp_path / "width.c").write_text(WIDTH)
    monkeypatch.setenv(processors.LEVEL, "x86-64-v2")
    made = [build.build_library(tmp_path / "width.c", tmp_path, flags=f) for f in ((), ("-lm",))]
    assert build.build_library(tmp_path / "width.c", tmp_path) == made[0] != made[1]


def test_without_clang_the_report_says_gcc_only(monkeypatch):
    monkeypatch.setitem(sys.modules, "ziglang", None)
    found = compilers.compilers.__wrapped__()
    assert [compiler.name for compiler in found] == ["gcc"]
    assert "peers by gcc only: " in compilers.told(found) and "'.[peers]'" in compilers.told(found)


def test_the_report_names_both_compilers():
    words = compilers.told((GCC, CLANG))
    assert words == "peers by the faster of gcc: gcc 12; clang: clang 22"


def test_without_any_compiler_the_remedy_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "ziglang", None)
    monkeypatch.setattr(compilers.shutil, "which", lambda name: None)
    with pytest.raises(compilers.PeerUnavailable, match=r"neither gcc .*\[peers\]"):
        compilers.compilers.__wrapped__()


def test_a_compiler_that_takes_too_long_is_left_out_and_told(monkeypatch, capsys):
    monkeypatch.setattr(build, "compilers", lambda: (GCC, CLANG))

    def made(compiler):
        if compiler is CLANG:
            raise build.TookTooLong("clang took over 1 s")
        return "made"

    assert build.by_each(made) == {"gcc": "made"}
    assert capsys.readouterr().err == "clang is left out: clang took over 1 s\n"


def test_what_does_not_end_is_cut(monkeypatch):
    monkeypatch.setattr(build, "PATIENCE", 0.2)
    begun = time.monotonic()
    with pytest.raises(build.TookTooLong, match=r"took over 0.2 s"):
        build.run(["sh", "-c", "sleep 600 & wait"])  # as a driver waits for its compiler
    assert time.monotonic() - begun < 60


@pytest.mark.parametrize(
    ("flags", "names", "lacks"),
    [
        ("avx avx2 avx512f", ["AVX-512", "AVX2"], []),
        ("avx avx2", ["AVX2"], ["AVX-512: this processor has none"]),
        ("neon", [platform.machine()], list(processors.ABSENT.values())),
    ],
)
def test_a_machine_stands_for_the_processors_that_it_has(flags, names, lacks):
    there = processors.processors(flags)
    assert [p.name for p in there] == names and processors.left_out(there) == lacks
    assert there[0].level is None


def test_every_measure_lies_in_a_file_that_runs_alone():
    from benchmarks import measures  # with every peer: seconds for each worker, were it above

    for measure in measures.MEASURES.values():
        name = measure.rows.__module__.removeprefix("benchmarks.")
        source = Path(sys.modules[measure.rows.__module__].__file__)
        assert f'alone.main("{name}", __doc__)' in source.read_text(), source
