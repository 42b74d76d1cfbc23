"""Cross compilers, emulators and analysers for tests: a test without its tool is skipped, and fails
in CI.
"""

import shutil
from functools import partial

from checks.embedded.boards import BOARDS, ToolchainMissing
from tests.support.page import need


def board(name: str):
    """Return a board whose tools are there."""
    need(BOARDS[name].need)
    return BOARDS[name]


def cppcheck() -> None:
    """Ask for cppcheck."""
    need(partial(_need, "cppcheck", "cppcheck"))


def valgrind() -> None:
    """Ask for valgrind."""
    need(partial(_need, "valgrind", "valgrind"))


def clang() -> None:
    """Ask for clang, which brings its sanitizers."""
    need(partial(_need, "clang", "clang libclang-rt-14-dev"))


def _need(program: str, packages: str) -> None:
    if shutil.which(program) is None:
        remedy = f"Debian, Ubuntu: apt-get install --no-install-recommends {packages}"
        raise ToolchainMissing(f"{program} is not on PATH; {remedy}")
