"""The compiler cache: one text gives one working library, and whatever goes wrong is named."""

from __future__ import annotations

import ctypes
import subprocess

TWICE = '#include "scale.h"\ndouble twice(double x) { return SCALE * x; }\n'


def call_twice(library):
    """What the library's function gives for 21."""
    function = ctypes.CDLL(str(library)).twice
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
    return function(21.0)


def libraries(cache):
    """Every library in the cache, and every part of one."""
    return [path for path in cache.rglob("*") if path.suffix in {".so", ".part"}]


def forbid_processes(monkeypatch):
    """Make every attempt to start a process fail the test."""

    def refuse(*_args, **_options):
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
