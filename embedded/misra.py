"""Runs cppcheck on a model: its faults, and how often it breaks each MISRA C:2012 rule."""

import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

from embedded.boards import ToolchainMissing

CPPCHECK = ("cppcheck", "--std=c99", "--quiet")


def need() -> None:
    """Raise ToolchainMissing unless cppcheck is installed."""
    if shutil.which("cppcheck") is None:
        raise ToolchainMissing(
            "cppcheck is not on PATH; Debian, Ubuntu: apt-get install --no-install-recommends "
            "cppcheck"
        )


def summary(folder: Path) -> list[tuple[str, int]]:
    """Return (rule, hits) of a model's source, the most frequent first; hits are no faults."""
    need()
    source = folder / "src" / f"{folder.name}.c"
    words = [*CPPCHECK, "--addon=misra", "-I", str(folder / "include"), str(source)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    hits = Counter(re.findall(r"\[misra-c2012-([\d.]+)\]", done.stderr))
    return sorted(hits.items(), key=lambda item: (-item[1], item[0]))


def faults(folder: Path) -> str:
    """Return what cppcheck's own checks find in a model's source; an empty result is a pass."""
    need()
    source = folder / "src" / f"{folder.name}.c"
    words = [
        *CPPCHECK,
        "--enable=warning,performance,portability",
        "-I",
        str(folder / "include"),
        str(source),
    ]
    return subprocess.run(words, capture_output=True, text=True, check=True).stderr
