"""The compiler cache: one text gives one working library, and whatever goes wrong is named."""

from __future__ import annotations

import ctypes
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
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

from .sources import call_twice, forbid_processes, libraries


@pytest.mark.parametrize(
    "chosen", ["no-such-cc -O3", "false", 'unbalanced "quote', "env no-such-cc"]
)
def test_broken_cc_is_named_and_not_replaced(model, monkeypatch, cache, chosen):
    monkeypatch.setenv("CC", chosen)
    with pytest.raises(CompilerNotFound) as caught:
        compiler.compile_library(*model)
    assert f"CC={chosen!r}" in str(caught.value)
    assert not libraries(cache)


@pytest.mark.parametrize("chosen", ["echo", "true"])
def test_compiler_that_writes_nothing(model, monkeypatch, cache, chosen):
    monkeypatch.setenv("CC", chosen)
    with pytest.raises(CompileFailed, match="wrote no library"):
        compiler.compile_library(*model)
    assert not libraries(cache)


def test_no_compiler_names_what_was_tried(model, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(CompilerNotFound) as caught:
        compiler.compile_library(*model)
    for words in (
        "cc (not on PATH)",
        "gcc",
        "clang",
        "ziglang wheel",
        "apt install gcc",
        "xcode-select",
        "CasADi",
    ):
        assert words in str(caught.value)


def test_broken_compiler_on_path_gives_way_to_the_next(model, monkeypatch, tmp_path):
    programs = tmp_path / "bin"
    programs.mkdir()
    broken, working = programs / "cc", programs / "gcc"
    broken.write_text("#!/bin/sh\nexit 1\n")
    working.write_text(f'#!/bin/sh\nPATH={os.environ["PATH"]} exec {shutil.which("cc")} "$@"\n')
    broken.chmod(0o755)
    working.chmod(0o755)
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


def test_failing_source_shows_the_compilers_words(model, cache):
    (source,), include = model
    source.write_text("double twice(double x) { return undeclared_name; }\n")
    with pytest.raises(CompileFailed, match="undeclared_name") as caught:
        compiler.compile_library([source], include)
    failure = caught.value
    assert "exit code 1" in str(failure) and str(source) in str(failure)
    assert (
        failure.returncode == 1
        and str(source) in failure.command
        and "undeclared_name" in failure.stderr
    )
    assert pickle.loads(pickle.dumps(failure)).stderr == failure.stderr
    assert not libraries(cache)


def test_sources_are_compiled_at_the_same_time(model, script, tmp_path):
    """Each compiler waits until the other one has begun, and the library has what both made."""
    (source,), include = model
    other = source.with_name("thrice.c")
    other.write_text("double twice(double);\ndouble thrice(double x) { return twice(x) + x; }\n")
    begun = tmp_path / "begun"
    begun.mkdir()
    both = f'[ "$(ls {begun} | wc -l)" = 2 ]'
    wait = f"for i in $(seq 600); do {both} && break; sleep 0.1; done; {both} || exit 9"
    script(f'case "$*" in *" -c "*) touch {begun}/$$; {wait};; esac')
    library = compiler.compile_library([source, other], include)
    assert call_twice(library) == 42.0
    assert ctypes.CDLL(str(library)).thrice is not None
    assert len(list(begun.iterdir())) == 2


def test_failure_of_one_source_names_it(model, cache):
    (source,), include = model
    wrong = source.with_name("wrong.c")
    wrong.write_text("#error mistake\n")
    with pytest.raises(CompileFailed, match="mistake") as caught:
        compiler.compile_library([source, wrong], include)
    assert str(wrong) in caught.value.command and str(source) not in caught.value.command
    assert not libraries(cache) and not list(cache.glob(".*.o"))


def test_long_report_loses_its_middle(model):
    (source,), include = model
    source.write_text("".join(f"#error mistake_{n}_ {'x' * 2000}\n" for n in range(10)))
    with pytest.raises(CompileFailed, match="mistake_0_") as caught:
        compiler.compile_library([source], include)
    assert "mistake_9_" in str(caught.value) and "characters left out" in str(caught.value)
    assert len(str(caught.value)) < 2 * compiler.LONGEST_REPORT < len(caught.value.stderr)


@pytest.mark.parametrize("kept", [0, 1000])
def test_truncated_library_is_rebuilt(model, kept):
    library = compiler.compile_library(*model)
    whole = library.read_bytes()
    library.write_bytes(whole[:kept])
    rebuilt = compiler.compile_library(*model)
    assert rebuilt.read_bytes() == whole
    assert call_twice(rebuilt) == 42.0


@pytest.mark.parametrize("text", ["", "{", "[]", "{}"])
def test_damaged_note_is_ignored(model, cache, text):
    library = compiler.compile_library(*model)
    (note,) = (cache / "compilers").iterdir()
    note.write_text(text)
    assert compiler.compile_library(*model) == library
    assert len(note.read_text()) > 2


def test_eight_processes_at_once(model, cache):
    (source,), include = model
    program = (
        "import ctypes, pathlib, sys; from serpentail.model import compiler; path = pathlib.Path\n"
        "library = ctypes.CDLL(str(compiler.compile_library([path(sys.argv[1])], "
        "path(sys.argv[2]))))\n"
        "library.twice.restype = ctypes.c_double; print(library.twice(ctypes.c_double(21.0)))"
    )
    command = [sys.executable, "-c", program, str(source), str(include)]
    surroundings = {**os.environ, "PYTHONPATH": str(Path(compiler.__file__).parents[2])}
    crowd = [
        subprocess.Popen(
            command, env=surroundings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(8)
    ]
    assert [process.communicate() for process in crowd] == [("42.0\n", "")] * 8
    assert len({path.parent for path in libraries(cache)}) == 1


def test_killed_compile_leaves_no_library(model, script, cache, monkeypatch):
    (source,), include = model
    script(
        'for word; do case $word in *.part) echo half > $word; touch "$0.busy"; sleep 60;; esac; '
        "done"
    )
    program = (
        "import pathlib, sys; from serpentail.model import compiler; path = pathlib.Path\n"
        "compiler.compile_library([path(sys.argv[1])], path(sys.argv[2]))"
    )
    surroundings = {**os.environ, "PYTHONPATH": str(Path(compiler.__file__).parents[2])}
    command = [sys.executable, "-c", program, str(source), str(include)]
    with subprocess.Popen(command, env=surroundings, start_new_session=True) as process:
        busy = Path(os.environ["CC"] + ".busy")
        patience = time.monotonic() + 60.0
        while not busy.exists() and time.monotonic() < patience:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
    assert [path.read_text() for path in libraries(cache)] == ["half\n"]
    assert not list(cache.rglob("*.so"))
    monkeypatch.delenv("CC")
    assert call_twice(compiler.compile_library(*model)) == 42.0


def test_sources_that_change_meanwhile_are_not_kept(model, script, cache):
    (source,), _ = model
    script(f'case "$*" in *-shared*) echo "/* edited */" >> {source};; esac')
    with pytest.raises(ModelError, match="changed while"):
        compiler.compile_library(*model)
    assert not libraries(cache)


def test_unwritable_cache_names_the_variable(model, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("SERPENTAIL_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(SerpentailError, match="SERPENTAIL_CACHE") as caught:
        compiler.compile_library(*model)
    assert str(tmp_path / "file") in str(caught.value)


def test_cache_folder_by_precedence(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "/xdg")
    assert cache_folder(tmp_path / "argument") == tmp_path / "argument"
    assert cache_folder(None) == tmp_path / "cache"
    monkeypatch.delenv("SERPENTAIL_CACHE")
    assert cache_folder(None) == Path("/xdg/serpentail")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder(None) == tmp_path / ".cache" / "serpentail"


def test_missing_files_are_a_model_error(model, tmp_path):
    sources, include = model
    with pytest.raises(ModelError, match=r"nowhere\.c"):
        compiler.compile_library([tmp_path / "nowhere.c"], include)
    with pytest.raises(ModelError, match="nowhere"):
        compiler.compile_library(sources, tmp_path / "nowhere")
    with pytest.raises(ModelError):
        compiler.compile_library([], include)


def test_profile_names_are_checked(model):
    with pytest.raises(
        SerpentailError, match="profile: value 'quick': needs 'fast' or 'reproducible'"
    ):
        compiler.compile_library(*model, profile="quick")
    with pytest.raises(SerpentailError, match="'quick'"):
        compiler.describe_compiler("quick")


def test_state_errors_are_value_errors():
    assert issubclass(StateError, SerpentailError) and issubclass(StateError, ValueError)
