"""Compilers that would take numbers for granted are refused, for they would delete the checks."""

import subprocess

import pytest

from ...support.models import model_folder
from ...support.toolchains import clang

FLAGS = ("-ffast-math", "-Ofast", "-ffinite-math-only")
PROFILES = ("fast", "reproducible")


def emitted(profile):
    """Return the folder of a model with every file of C that computes."""
    return model_folder(1, 1, name=f"{profile}_math", functions="all", profile=profile)


def told(compiler, folder, source, *flags):
    """Return a compiler's exit status and words."""
    command = (compiler, "-std=c99", *flags, "-fsyntax-only", "-I", folder / "include", source)
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    return done.returncode, done.stderr


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_every_file_that_computes_refuses_them(compiler, profile):
    if compiler == "clang":
        clang()
    folder = emitted(profile)
    sources = sorted((folder / "src").glob("*.c"))
    assert len(sources) == 7
    for source in sources:
        assert told(compiler, folder, source, "-O2") == (0, "")
        for flag in FLAGS:
            status, words = told(compiler, folder, source, flag)
            assert status != 0 and f"{folder.name} checks for NaN and infinity" in words, source
            assert "compile it without -ffast-math, -Ofast and -ffinite-math-only" in words
