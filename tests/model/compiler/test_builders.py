"""One process builds while others wait; killed and failing ones leave nothing that stays."""

import errno
import itertools
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from serpentail.errors import CompileFailed, SerpentailError
from serpentail.model import compiler, locks
from serpentail.model.manifest import read_folder
from serpentail.model.snapshot import model_library
from tests.support.file_faults import age, at, before_calls, fault
from tests.support.models import model_folder

from .sources import call_twice, libraries

COMPILE = (
    "import pathlib, sys; from serpentail.model import compiler; path = pathlib.Path\n"
    "print(compiler.compile_library([path(sys.argv[1])], path(sys.argv[2])))"
)
LOAD = "import sys, serpentail as st; print(st.load(sys.argv[1]).library._name)"


def started(program, *arguments, **options):
    """A process of its own that runs a program."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


@pytest.mark.parametrize("count", [12, pytest.param(64, marks=pytest.mark.slow)])
def test_processes_with_a_cold_cache_compile_once(cache, script, count):
    folder = model_folder(1, 1, name="tail", functions=["mass_matrix"])
    calls = script()
    crowd = [started(LOAD, folder) for _ in range(count)]
    answers = [process.communicate() for process in crowd]
    (library,) = libraries(cache)
    assert answers == [(f"{library}\n", "")] * count
    lines = calls.read_text().splitlines()
    compiled = [line for line in lines if " -c " in line]
    sources = {line.split(" -c ")[1].split()[0] for line in compiled}
    assert len(compiled) == len(sources) and sum(" -shared " in line for line in lines) == 1
    assert sum("--version" in line for line in lines) == 1
    print(
        f"{count} processes: {len(compiled)} sources compiled, {len(lines)} calls of the compiler"
    )


def test_threads_compile_once(model, script):
    calls = script()
    threads = [threading.Thread(target=compiler.compile_library, args=model) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert calls.read_text().count(" -c ") == 1


def test_killed_holder_frees_the_lock(model, cache, script, monkeypatch):
    (source,), include = model
    script('case "$*" in *" -c "*) touch "$0.busy"; sleep 60;; esac')
    holder = started(COMPILE, source, include, start_new_session=True)
    busy, patience = Path(os.environ["CC"] + ".busy"), time.monotonic() + 60
    while not busy.exists() and time.monotonic() < patience:
        time.sleep(0.01)
    script()
    other = started(COMPILE, source, include)
    time.sleep(0.5)
    assert other.poll() is None  # it waits
    os.killpg(holder.pid, signal.SIGKILL)
    holder.communicate()
    out, err = other.communicate(timeout=60)
    assert (out, err) == (f"{compiler.compile_library(*model)}\n", "")


@pytest.mark.parametrize("code", [errno.ENOLCK, errno.ENOTSUP, errno.EIO], ids=errno.errorcode.get)
def test_file_systems_without_locks_compile_anyway(model, monkeypatch, code):
    import filelock

    monkeypatch.setattr(filelock.FileLock, "_acquire", lambda _: fault(code)())
    assert call_twice(compiler.compile_library(*model)) == 42.0


def test_patience_ends(model, monkeypatch):
    monkeypatch.setattr(locks, "PATIENCE_S", 0.1)
    (source,), include = model
    text = compiler._text_of([source], include)
    name = compiler.digest([text, "fast"])
    with locks.alone(compiler.cache_folder(None), name):
        assert call_twice(compiler.compile_library(*model)) == 42.0


def test_warm_cache_takes_no_lock(model):
    compiler.compile_library(*model)
    (source,), include = model
    program = f"{COMPILE}; assert 'filelock' not in sys.modules"
    out, err = started(program, source, include).communicate()
    assert err == "" and out


# Faults

FAKE = """#!/bin/sh
case "$*" in *--version*) echo fake 1;; esac
while [ $# -gt 0 ]; do [ "$1" = -o ] && echo made > "$2"; shift; done
"""


EVERY = [errno.ENOSPC, errno.EFBIG, errno.EIO]


@pytest.mark.parametrize(
    ("code", "apart"),
    [(errno.ENOSPC, 5), *(pytest.param(code, 1, marks=pytest.mark.slow) for code in EVERY)],
    ids=lambda value: errno.errorcode[value] if value > 5 else f"every {value}",
)
def test_fault_at_any_call_is_a_refusal_and_leaves_nothing(tmp_path, monkeypatch, code, apart):
    """With a compiler that takes no time."""
    path = tmp_path / "fake"
    path.write_text(FAKE)
    path.chmod(0o755)
    monkeypatch.setenv("CC", str(path))
    checked = read_folder(model_folder(1, 1, name="tail", functions=["mass_matrix"]))
    sources, refused = ["src/tail.c"], 0
    model_library(checked, sources, "fast")  # imports what it needs
    for moment in itertools.count(step=apart):
        cache = tmp_path / f"cache{moment}"
        monkeypatch.setenv("SERPENTAIL_CACHE", str(cache))
        came = []
        with before_calls(at(moment, lambda: came.append(1) or fault(code)())):  # noqa: B023
            try:
                model_library(checked, sources, "fast")
            except SerpentailError as error:
                refused += 1
                assert "\n" not in str(error) or isinstance(error, CompileFailed), moment
        assert model_library(checked, sources, "fast").read_text() == "made\n", moment
        age(cache / "parts")
        model_library(checked, sources, "reproducible")
        assert not list((cache / "parts").iterdir()), moment
        shutil.rmtree(cache)
        if not came:
            break
    print(f"{moment} calls, {refused} of them refused")
    assert moment > 100 and refused > 50 // apart
