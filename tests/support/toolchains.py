"""Cross compilers, emulators and analysers for tests: a test without its tool is skipped, and fails
in CI.
"""

import os
import shutil
from collections.abc import Callable
from functools import partial

import pytest

from embedded import misra
from embedded.boards import BOARDS, ToolchainMissing


def _required(need: Callable[[], None]) -> None:
    """Skip a test if its tools are missing, with the way to get them; in CI it fails."""
    try:
        need()
    except ToolchainMissing as error:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(str(error))


def board(name: str):
    """Return a board whose tools are there."""
    _required(BOARDS[name].need)
    return BOARDS[name]


def cppcheck() -> None:
    """Ask for cppcheck."""
    _required(misra.need)


def valgrind() -> None:
    """Ask for valgrind."""
    _required(partial(_need, "valgrind", "valgrind"))


def clang() -> None:
    """Ask for clang, which brings its sanitizers."""
    _required(partial(_need, "clang", "clang libclang-rt-14-dev"))


def _need(program: str, packages: str) -> None:
    if shutil.which(program) is None:
        remedy = f"Debian, Ubuntu: apt-get install --no-install-recommends {packages}"
        raise ToolchainMissing(f"{program} is not on PATH; {remedy}")
