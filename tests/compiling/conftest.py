"""A small library to compile, into an empty cache, with compilers that are scripts."""

import ctypes
import shutil
import subprocess

import pytest

TWICE = '#include "scale.h"\ndouble twice(double x) { return SCALE * x; }\n'


def call_twice(library):
    function = ctypes.CDLL(str(library)).twice
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
    return function(21.0)


def program(path, body):
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)
    return str(path)


def libraries(cache):
    """Every library in the cache, and every part of one."""
    return [path for path in cache.rglob("*") if path.suffix in {".so", ".part"}]


def forbid_processes(monkeypatch):
    def refuse(*_args, **_options):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)


@pytest.fixture(autouse=True)
def usual_compiler(cache, monkeypatch):
    monkeypatch.delenv("CC", raising=False)


@pytest.fixture
def model(tmp_path):
    include = tmp_path / "model" / "include"
    source = tmp_path / "model" / "src" / "twice.c"
    include.mkdir(parents=True)
    source.parent.mkdir()
    (include / "scale.h").write_text("#define SCALE 2.0\n")
    source.write_text(TWICE)
    return [source], include


@pytest.fixture
def script(tmp_path, monkeypatch):
    """Make $CC a shell script that logs its arguments, does `body` and then what cc does."""
    real = shutil.which("cc") or shutil.which("gcc")
    log = tmp_path / "calls"

    def install(body=""):
        text = f'echo "$@" >> {log}\n{body}\nexec {real} "$@"'
        monkeypatch.setenv("CC", program(tmp_path / "mycc", text))
        return log

    return install
