"""Whatever goes wrong with a compiler or its sources is named, and leaves no library."""

import os
import pickle
import shutil
import sys
from pathlib import Path

import pytest

from serpentail.errors import (
    CompileFailed,
    CompilerNotFound,
    ModelError,
    SerpentailError,
    StateError,
)
from serpentail.model import compiler, toolchain
from serpentail.model.cache import cache_folder

from ...support.rows import row
from .conftest import call_twice, forbid_processes, libraries

# Compilers


def test_broken_cc_is_named_and_not_replaced(model, monkeypatch, cache):
    for chosen in ("no-such-cc -O3", "false", 'unbalanced "quote', "env no-such-cc"):
        monkeypatch.setenv("CC", chosen)
        with row(chosen), pytest.raises(CompilerNotFound) as caught:
            compiler.compile_library(*model)
        assert f"CC={chosen!r}" in str(caught.value)
    for chosen in ("echo", "true"):
        monkeypatch.setenv("CC", chosen)
        with row(chosen), pytest.raises(CompileFailed, match="wrote no library"):
            compiler.compile_library(*model)
    assert not libraries(cache)


def test_no_compiler_names_what_was_tried(model, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(CompilerNotFound) as caught:
        compiler.compile_library(*model)
    for words in ("cc (not on PATH)", "gcc", "clang", "ziglang wheel", "apt install", "xcode"):
        assert words in str(caught.value)


def test_broken_compiler_on_path_gives_way_to_the_next(model, monkeypatch, tmp_path):
    programs = tmp_path / "bin"
    programs.mkdir()
    real = f'PATH={os.environ["PATH"]} exec {shutil.which("cc")} "$@"'
    for name, body in (("cc", "exit 1"), ("gcc", real)):
        (programs / name).write_text(f"#!/bin/sh\n{body}\n")
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(programs))
    library = compiler.compile_library(*model)
    assert call_twice(library) == 42.0
    forbid_processes(monkeypatch)
    assert compiler.compile_library(*model) == library


def test_ziglang_wheel_comes_last(monkeypatch, tmp_path):
    package = tmp_path / "ziglang"
    package.mkdir()
    (package / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PATH", str(package))
    assert list(toolchain.candidates()) == [(sys.executable, "-m", "ziglang", "cc")]


# Sources


def test_failing_source_shows_the_compilers_words(model, cache):
    (source,), include = model
    wrong = source.with_name("wrong.c")
    wrong.write_text("double thrice(double x) { return undeclared_name; }\n")
    with pytest.raises(CompileFailed, match="undeclared_name") as caught:
        compiler.compile_library([source, wrong], include)
    failure = caught.value
    assert "exit code 1" in str(failure) and str(wrong) in str(failure)
    assert failure.returncode == 1 and "undeclared_name" in failure.stderr
    assert str(wrong) in failure.command and str(source) not in failure.command
    assert pickle.loads(pickle.dumps(failure)).stderr == failure.stderr
    assert not libraries(cache) and not list(cache.rglob("*.o"))


def test_failing_link_shows_the_compilers_words(model, cache, script):
    script('case "$*" in *-shared*) echo "tail.c:7: out of patience" >&2; exit 3;; esac')
    with pytest.raises(CompileFailed, match=r"exit code 3\ntail\.c:7: out of patience\nCommand: "):
        compiler.compile_library(*model)
    assert not libraries(cache)


def test_long_report_loses_its_middle(model):
    (source,), include = model
    source.write_text("".join(f"#error mistake_{n}_ {'x' * 2000}\n" for n in range(10)))
    with pytest.raises(CompileFailed, match="mistake_0_") as caught:
        compiler.compile_library([source], include)
    assert "mistake_9_" in str(caught.value) and "characters left out" in str(caught.value)
    assert len(str(caught.value)) < 2 * compiler.LONGEST_REPORT < len(caught.value.stderr)


def test_sources_that_change_meanwhile_are_not_kept(model, script, cache):
    (source,), _ = model
    script(f'case "$*" in *-shared*) echo "/* edited */" >> {source};; esac')
    with pytest.raises(ModelError, match="changed while"):
        compiler.compile_library(*model)
    assert not libraries(cache)


def test_missing_files_are_a_model_error(model, tmp_path):
    sources, include = model
    nowhere = tmp_path / "nowhere.c"
    for given in (([nowhere], include), (sources, nowhere), ([], include)):
        with row(given), pytest.raises(ModelError, match=r"nowhere\.c|no sources"):
            compiler.compile_library(*given)


def test_profile_names_are_checked(model):
    for call in (lambda p: compiler.compile_library(*model, profile=p), compiler.describe_compiler):
        with pytest.raises(SerpentailError, match="profile: value 'quick'"):
            call("quick")
    assert issubclass(StateError, SerpentailError) and issubclass(StateError, ValueError)


# The folder of the cache


def test_unwritable_cache_names_the_variable(model, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(SerpentailError, match=rf"{tmp_path}/file.*SERPENTAIL_CACHE"):
        compiler.compile_library(*model)


def test_cache_folder_by_precedence(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "/xdg")
    assert cache_folder(tmp_path / "argument") == tmp_path / "argument"
    assert cache_folder(None) == tmp_path / "cache"
    monkeypatch.delenv("SERPENTAIL_CACHE")
    assert cache_folder(None) == Path("/xdg/serpentail")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder(None) == tmp_path / ".cache" / "serpentail"
