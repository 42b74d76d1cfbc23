"""Refuses Python files that are too long to read; `make lint` runs it."""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("codegen", "runtime", "tests", "benchmarks", "embedded", "examples", "mutants", "stress")
MOST_LINES = 300
WRITTEN = {ROOT / "runtime" / "serpentail" / "model" / "functions.py"}  # by `make golden`


def main() -> int:
    """Print a complaint for each file that is too long; return the exit status."""
    complaints = []
    for path in sorted(path for name in FOLDERS for path in (ROOT / name).rglob("*.py")):
        lines = len(path.read_text(encoding="utf-8").splitlines())
        if lines > MOST_LINES and path not in WRITTEN:
            complaints.append(f"{path}: {lines} lines, more than {MOST_LINES}: split it by concept")
    print("\n".join(complaints) or f"all files have {MOST_LINES} lines or less")
    return 1 if complaints else 0


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    sys.exit(main())
