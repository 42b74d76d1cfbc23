"""What tests that run make share: an environment of their own, and a stand-in for .venv."""

import os
import re
import sys
from pathlib import Path

# what a make that runs these tests says to every make below it, EXTRAS of CI's command among it
OF_MAKE = re.compile(r"MAKE|MFLAGS|(EXTRAS|UV|TAIL|M|N|SCENE|REAL|EMISSION|BAKED|FUNCTIONS)$")
STAMPS = (".draws", ".paged", ".ready")  # of what is installed, each after those before it
# Programs of .venv: this interpreter, and no installation, which would reach the real environment.
PROGRAM = """#!/bin/sh
case "$*" in *"pip install"*) echo "no pip in here" >&2; exit 9;; esac
exec {} "$@"
"""


def away_from_make() -> dict[str, str]:
    """Return the environment without what a make that runs these tests put into it."""
    return {name: value for name, value in os.environ.items() if not OF_MAKE.match(name)}


def stand_in(tree: Path) -> None:
    """Give a folder a .venv that is ready, whose programs are those of this interpreter."""
    programs = tree / ".venv" / "bin"
    programs.mkdir(parents=True)
    for name, command in (
        ("python", sys.executable),
        ("serpentail", f"{sys.executable} -m serpentail.cli.cli"),
    ):
        (programs / name).write_text(PROGRAM.format(command))
        (programs / name).chmod(0o755)
    for stamp in STAMPS:
        (tree / ".venv" / stamp).touch()
