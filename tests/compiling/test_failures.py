"""Broken compilers, sources, caches and builds are named, and leave no library."""

import errno
import itertools
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import filelock
import pytest

import serpentail as st
from serpentail.compiling import cache as caches
from serpentail.compiling import compiler, toolchain
from serpentail.compiling.cache import cache_folder
from serpentail.model.library import model_library
from serpentail.model.manifest import read_folder
from tests.support import zoo
from tests.support.file_faults import age, at, before_calls, fault

from ..support.rows import row
from .conftest import call_twice, forbid_processes, libraries, program


def refusal(model, error=st.SerpentailError):
    with pytest.raises(error) as caught:
        compiler.compile_library(*model)
    return str(caught.value)


def test_what_is_no_compiler_or_no_source_is_named_and_not_replaced(
    model, monkeypatch, cache, tmp_path
):
    (sources, include), nowhere = model, tmp_path / "nowhere.c"
    for given in (([nowhere], include), (sources, nowhere), ([], include)):
        with row(given), pytest.raises(st.ModelError, match=r"nowhere\.c|no sources"):
            compiler.compile_library(*given)
    with pytest.raises(st.SerpentailError, match="profile: value 'quick'"):
        compiler.describe_compiler("quick")
    for chosen in ("no-such-cc -O3", "false", 'unbalanced "quote', "env no-such-cc"):
        monkeypatch.setenv("CC", chosen)
        with row(chosen):
            assert f"CC={chosen!r}" in refusal(model, st.CompilerNotFound)
    for chosen in ("echo", "true"):
        monkeypatch.setenv("CC", chosen)
        with row(chosen):
            assert "wrote no library" in refusal(model, st.CompileFailed)
    assert not libraries(cache)
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    message = refusal(model, st.CompilerNotFound)
    for words in ("cc (not on PATH)", "gcc", "clang", "ziglang wheel", "apt install", "xcode"):
        assert words in message


def test_broken_compiler_on_path_gives_way_to_the_next_and_ziglang_comes_last(
    model, monkeypatch, tmp_path
):
    real = f'PATH={os.environ["PATH"]} exec {shutil.which("cc")} "$@"'
    for name, body in (("cc", "exit 1"), ("gcc", real)):
        program(tmp_path / name, body)
    monkeypatch.setenv("PATH", str(tmp_path))
    library = compiler.compile_library(*model)
    assert call_twice(library) == 42.0
    forbid_processes(monkeypatch)
    assert compiler.compile_library(*model) == library
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name == "ziglang")
    monkeypatch.setenv("PATH", "")
    assert list(toolchain.candidates()) == [(sys.executable, "-m", "ziglang", "cc")]


@pytest.mark.slow  # half a minute where zig has not compiled its C library yet
def test_without_a_compiler_on_path_ziglang_compiles_and_says_so(model, monkeypatch, tmp_path):
    pytest.importorskip("ziglang")
    monkeypatch.setenv("PATH", str(tmp_path))
    told = []
    with st.progress(lambda now: told.append(str(now))):
        assert call_twice(compiler.compile_library(*model)) == 42.0
    assert "compile by ziglang, half a minute" in told[0] and "twice.c" in told[0]


def test_failures_show_the_compilers_words_without_the_middle_of_long_ones(model, cache, script):
    (source,), include = model
    wrong = source.with_name("wrong.c")
    wrong.write_text("".join(f"#error mistake_{n}_ {'x' * 2000}\n" for n in range(10)))
    with pytest.raises(st.CompileFailed, match="mistake_0_") as caught:
        compiler.compile_library([source, wrong], include)
    failure = caught.value
    assert "exit code 1" in str(failure) and "src0/wrong.c:" in str(failure)
    assert failure.returncode == 1 and "mistake_5_" in failure.stderr
    assert "src0/wrong.c" in failure.command and "src0/twice.c" not in failure.command
    assert pickle.loads(pickle.dumps(failure)).stderr == failure.stderr
    assert "mistake_9_" in str(failure) and "characters left out" in str(failure)
    assert len(str(failure)) < 2 * compiler.LONGEST_REPORT < len(failure.stderr)
    script('case "$*" in *-shared*) echo "tail.c:7: patience" >&2; exit 3;; esac')
    assert "code 3\ntail.c:7: patience\n" in refusal(model, st.CompileFailed)
    assert not libraries(cache) and not list(cache.rglob("*.o"))
    # sources that change while they are compiled: what was read is compiled
    script(f"echo '#error edited' >> {source}")
    assert call_twice(compiler.compile_library(*model)) == 42.0


def test_place_of_the_cache_and_what_cannot_be_one(model, monkeypatch, tmp_path):
    """One below /tmp serves; /tmp itself does not, and nobody is told to close it."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "/xdg")
    assert cache_folder() == tmp_path / "cache"
    monkeypatch.delenv("SERPENTAIL_CACHE")
    assert cache_folder() == Path("/xdg/serpentail")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder() == tmp_path / ".cache" / "serpentail"
    monkeypatch.setenv("SERPENTAIL_CACHE", "/dev/null/cache")
    assert re.search("/dev/null.*SERPENTAIL_CACHE", refusal(model))
    cache = tmp_path / "all" / "mine"
    cache.parent.mkdir()
    cache.parent.chmod(0o1777)
    monkeypatch.setenv("SERPENTAIL_CACHE", str(cache.parent))
    message = refusal(model)
    assert "is writable by others" in message and "chmod" not in message
    monkeypatch.setenv("SERPENTAIL_CACHE", str(cache))
    library = compiler.compile_library(*model)
    (note,) = (cache / "compilers").glob("*/*")
    places = (cache, library.parents[1], library.parent, library)
    for path in places:
        for mode in (0o777, 0o775, 0o770, 0o757):
            with row(path, oct(mode)):
                path.chmod(mode)
                message = refusal(model)
                assert str(path) in message and "is writable by others" in message
                assert f"`chmod -R go-w {path}`" in message and "SERPENTAIL_CACHE" in message
                path.chmod(0o700)
    # root alone may give files to others
    for path in (*places, note.parent, note) if os.geteuid() == 0 else ():
        with row(path):
            os.chown(path, 12345, 12345)
            message = refusal(model)
            assert f"{path} belongs to user 12345" in message and "SERPENTAIL_CACHE" in message
            os.chown(path, 0, 0)
    # nor may everybody exchange a folder above it
    cache.parent.chmod(0o777)
    message = refusal(model)
    assert f"{cache.parent} is writable by others" in message
    assert f"`chmod o-w {cache.parent}`" in message and "SERPENTAIL_CACHE" in message
    cache.parent.chmod(0o770)
    assert compiler.compile_library(*model) == library


COMPILE = (
    "import pathlib, sys; from serpentail.compiling import compiler; path = pathlib.Path\n"
    "print(compiler.compile_library([path(sys.argv[1])], path(sys.argv[2])))"
)
LOAD = "import sys, serpentail as st; print(st.load(sys.argv[1]).library._name)"


def started(text, *arguments, **options):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", text, *map(str, arguments)], **pipes, **options)


def test_of_processes_one_compiles_and_a_killed_one_frees_the_lock(model, cache, script):
    calls, count = script(), 6
    crowd = [started(LOAD, zoo.folder("bare")) for _ in range(count)]
    answers = [process.communicate() for process in crowd]
    (library,) = libraries(cache)
    assert answers == [(f"{library}\n", "")] * count
    lines = calls.read_text().splitlines()
    sources = [line.split(" -c ")[1].split()[0] for line in lines if " -c " in line]
    assert len(sources) == len({*sources}) and sum(" -shared " in line for line in lines) == 1
    assert sum("--version" in line for line in lines) == 1
    shutil.rmtree(cache)
    (source,), include = model
    made = 'for word; do case $word in *.so) echo half > $word; touch "$0.busy"; sleep 60;; esac;'
    script(f"{made} done")
    holder = started(COMPILE, source, include, start_new_session=True)
    patience = time.monotonic() + 60
    while not Path(os.environ["CC"] + ".busy").exists() and time.monotonic() < patience:
        time.sleep(0.01)
    script()
    other = started(COMPILE, source, include)
    time.sleep(0.5)
    assert other.poll() is None  # it waits
    assert [path.read_text() for path in libraries(cache)] == ["half\n"]
    os.killpg(holder.pid, signal.SIGKILL)
    holder.communicate()
    library = Path(other.communicate(timeout=60)[0].strip())
    assert call_twice(library) == 42.0 and compiler.compile_library(*model) == library


def test_without_locks_or_patience_it_compiles_anyway(model, cache, monkeypatch):
    (source,), include = model
    with monkeypatch.context() as changed:
        for code in (errno.ENOLCK, errno.ENOTSUP, errno.EIO):
            changed.setattr(filelock.FileLock, "_acquire", lambda _, code=code: fault(code)())
            assert call_twice(compiler.compile_library(*model)) == 42.0
            shutil.rmtree(cache)
    monkeypatch.setattr(caches, "PATIENCE_S", 0.1)
    names, alone = [], caches.alone
    with monkeypatch.context() as changed:
        changed.setattr(
            compiler, "alone", lambda cache, name: names.append(name) or alone(cache, name)
        )
        compiler.compile_library(*model)
    shutil.rmtree(cache)
    with alone(cache, *names):
        assert call_twice(compiler.compile_library(*model)) == 42.0
    # a warm cache takes no lock
    text = f"{COMPILE}; assert 'filelock' not in sys.modules"
    assert started(text, source, include).communicate()[1] == ""


FAKE = """
case "$*" in *--version*) echo fake 1;; esac
while [ $# -gt 0 ]; do [ "$1" = -o ] && echo made > "$2"; shift; done
"""


@pytest.mark.parametrize("apart", [9, pytest.param(1, marks=pytest.mark.slow)])
def test_fault_at_any_call_is_a_refusal_and_leaves_nothing(tmp_path, monkeypatch, apart):
    monkeypatch.setenv("CC", program(tmp_path / "fake", FAKE))
    checked, sources, refused = read_folder(zoo.folder("bare")), ["src/bare.c"], 0
    model_library(checked, sources, "fast")  # imports what it needs
    for moment in itertools.count(step=apart):
        cache = tmp_path / f"cache{moment}"
        monkeypatch.setenv("SERPENTAIL_CACHE", str(cache))
        came = []
        with before_calls(at(moment, lambda: came.append(1) or fault(errno.EIO)())):  # noqa: B023
            try:
                model_library(checked, sources, "fast")
            except st.SerpentailError as error:
                refused += 1
                assert "\n" not in str(error) or isinstance(error, st.CompileFailed), moment
        assert model_library(checked, sources, "fast").read_text() == "made\n", moment
        age(cache / "parts")
        model_library(checked, sources, "reproducible")
        assert not list((cache / "parts").iterdir()), moment
        shutil.rmtree(cache)
        if not came:
            break
    assert moment > 100 and refused > 50 // apart
