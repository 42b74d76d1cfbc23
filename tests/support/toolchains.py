"""Cross compilers, emulators and analysers for tests: without them a test is skipped, in CI it
fails.
"""

import os
import shutil
from collections.abc import Callable

import pytest

from embedded import misra
from embedded.boards import BOARDS, ToolchainMissing


def _required(need: Callable[[], None]) -> None:
    """Skip a test whose tools are missing, saying how to get them; in CI it fails."""
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
    _required(_need_valgrind)


def _need_valgrind() -> None:
    if shutil.which("valgrind") is None:
        remedy = "Debian, Ubuntu: apt-get install --no-install-recommends valgrind"
        raise ToolchainMissing(f"valgrind is not on PATH; {remedy}")


def clang() -> None:
    """Ask for clang, which brings its sanitizers."""
    _required(_need_clang)


def _need_clang() -> None:
    if shutil.which("clang") is None:
        remedy = "Debian, Ubuntu: apt-get install --no-install-recommends clang libclang-rt-14-dev"
        raise ToolchainMissing(f"clang is not on PATH; {remedy}")
