"""Runs cppcheck on a model: its faults, and how often it breaks each MISRA C:2012 rule."""

import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

from checks.embedded.boards import ToolchainMissing

ASKS = {  # in our own words
    "2.2": "no operation without effect",
    "2.4": "no tag that is not used",
    "2.5": "no macro that is not used",
    "8.7": "no external name for what one file uses",
    "10.3": "no assignment to a narrower type, or to one of another kind",
    "10.4": "operands of one kind of type",
    "12.1": "parentheses that show the precedence of operators",
    "12.3": "no comma operator",
    "15.5": "one return, at the end of a function",
    "18.4": "no +, -, += or -= of pointers",
    "20.5": "no #undef",
}
CPPCHECK = ("cppcheck", "--std=c99", "--quiet")


def need() -> None:
    """Raise ToolchainMissing unless cppcheck is installed."""
    if shutil.which("cppcheck") is None:
        raise ToolchainMissing(
            "cppcheck is not on PATH; Debian, Ubuntu: apt-get install --no-install-recommends "
            "cppcheck"
        )


def summary(folder: Path) -> list[tuple[str, str, int]]:
    """Return (rule, what it asks for, hits) of a model's source, the most frequent first; hits are
    no faults.
    """
    need()
    source = folder / "src" / f"{folder.name}.c"
    words = [*CPPCHECK, "--addon=misra", "-I", str(folder / "include"), str(source)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    hits = Counter(re.findall(r"\[misra-c2012-([\d.]+)\]", done.stderr))
    return [(rule, ASKS.get(rule, ""), count) for rule, count in hits.most_common()]


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
