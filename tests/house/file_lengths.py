"""Refuses Python files that are too long to read, and classes of one name; `make lint` runs it."""

import argparse
import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("codegen", "runtime", "tests", "benchmarks", "checks", "examples")
MOST_LINES = 300
CLASS = re.compile(r"^class (\w+)", re.MULTILINE)
WRITTEN = {ROOT / "runtime" / "serpentail" / "model" / "functions.py"}  # by `make golden`


def main() -> int:
    """Print a complaint for each file that is too long and each name of two classes of a
    package; return the exit status.
    """
    complaints, homes = [], defaultdict(list)
    for path in sorted(path for name in FOLDERS for path in (ROOT / name).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if (lines := text.count("\n")) > MOST_LINES and path not in WRITTEN:
            complaints.append(f"{path}: {lines} lines, more than {MOST_LINES}: split it by concept")
        package = path.relative_to(ROOT).parts[0]
        if package in FOLDERS[:2]:
            for name in CLASS.findall(text):
                homes[package, name].append(str(path.relative_to(ROOT)))
    for (_, name), paths in homes.items():
        if len(paths) > 1:
            complaints.append(f"class {name} stands in {' and in '.join(paths)}: rename one")
    print("\n".join(complaints) or f"all files have {MOST_LINES} lines or less, all classes a name")
    return 1 if complaints else 0


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    sys.exit(main())
