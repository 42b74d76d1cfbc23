"""One process builds while others wait; killed and failing ones leave nothing that stays."""

import errno
import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from serpentail.errors import CompileFailed, SerpentailError
from serpentail.model import compiler, locks
from serpentail.model.manifest import read_folder
from serpentail.model.snapshot import model_library
from tests.support import zoo
from tests.support.file_faults import age, at, before_calls, fault

from .conftest import call_twice, libraries

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


def until(path):
    """Wait until a file is there."""
    patience = time.monotonic() + 60
    while not path.exists() and time.monotonic() < patience:
        time.sleep(0.01)


def test_processes_with_a_cold_cache_compile_once(cache, script):
    calls, count = script(), 6
    crowd = [started(LOAD, zoo.folder("bare")) for _ in range(count)]
    answers = [process.communicate() for process in crowd]
    (library,) = libraries(cache)
    assert answers == [(f"{library}\n", "")] * count
    lines = calls.read_text().splitlines()
    compiled = [line for line in lines if " -c " in line]
    sources = {line.split(" -c ")[1].split()[0] for line in compiled}
    assert len(compiled) == len(sources) and sum(" -shared " in line for line in lines) == 1
    assert sum("--version" in line for line in lines) == 1


def test_killed_holder_frees_the_lock_and_leaves_no_library(model, cache, script):
    (source,), include = model
    made = 'for word; do case $word in *.part) echo half > $word; touch "$0.busy"; sleep 60;; esac;'
    script(f"{made} done")
    holder = started(COMPILE, source, include, start_new_session=True)
    until(Path(os.environ["CC"] + ".busy"))
    script()
    other = started(COMPILE, source, include)
    time.sleep(0.5)
    assert other.poll() is None  # it waits
    assert [path.read_text() for path in libraries(cache)] == ["half\n"]
    os.killpg(holder.pid, signal.SIGKILL)
    holder.communicate()
    out, err = other.communicate(timeout=60)
    library = compiler.compile_library(*model)
    assert (out, err) == (f"{library}\n", "") and call_twice(library) == 42.0


def test_without_locks_or_patience_it_compiles_anyway(model, cache, monkeypatch):
    import filelock

    (source,), include = model
    with monkeypatch.context() as changed:
        for code in (errno.ENOLCK, errno.ENOTSUP, errno.EIO):
            changed.setattr(filelock.FileLock, "_acquire", lambda _, code=code: fault(code)())
            assert call_twice(compiler.compile_library(*model)) == 42.0
            shutil.rmtree(cache)
    monkeypatch.setattr(locks, "PATIENCE_S", 0.1)
    name = compiler.digest([compiler._text_of([source], include), "fast"])
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


@pytest.mark.parametrize(
    ("code", "apart"), [(errno.EIO, 9), pytest.param(errno.ENOSPC, 1, marks=pytest.mark.slow)]
)
def test_fault_at_any_call_is_a_refusal_and_leaves_nothing(tmp_path, monkeypatch, code, apart):
    """With a compiler that takes no time."""
    path = tmp_path / "fake"
    path.write_text(FAKE)
    path.chmod(0o755)
    monkeypatch.setenv("CC", str(path))
    checked, sources, refused = read_folder(zoo.folder("bare")), ["src/bare.c"], 0
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
    assert moment > 100 and refused > 50 // apart
