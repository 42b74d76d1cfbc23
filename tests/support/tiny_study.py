"""A study of small parts: `python -m tests.support.tiny_study FOLDER`.

Each part that ends writes a line into FOLDER/ended, so that a test counts them.
"""

import os
import sys
import time
from functools import partial
from pathlib import Path

from examples.front import GOES_ON, run
from examples.studies.parts import Part, made

PARTS, TAKES = 8, 0.6  # s a part


def square(number: int, folder: Path) -> dict:
    """Take some time, and report it."""
    time.sleep(TAKES)
    with open(folder / "ended", "a") as file:
        file.write(f"{number} {os.getpid()}\n")
    return {"number": number, "square": number**2, "third": number / 3}


def parts(folder: Path) -> dict[str, Part]:
    """Return the parts of the study."""
    return {f"part {k}": Part(partial(square, k, folder), {"number": k}) for k in range(PARTS)}


def ones() -> list:
    """Return at once."""
    return [1]


def lost() -> dict:
    """Return NaN."""
    return {"lost": float("nan")}


def wrong() -> list:
    """Fail."""
    raise ZeroDivisionError("no such part")


def titles(store: Path) -> list[str]:
    """Return the titles of the parts that a store has."""
    from pyarrow import parquet

    told = []
    for path in store.glob("*/*/[0-9]*.parquet"):
        columns = parquet.read_table(path).to_pydict()
        told += [
            x for x, error in zip(columns["number"], columns["error"], strict=True) if not error
        ]
    return sorted(f"part {number}" for number in told)


def main(folder: Path) -> None:
    """Make the missing parts, and print the results."""
    print(sorted(made("tiny", folder / "parts", parts(folder)).items()))


if __name__ == "__main__":
    run(main, Path(sys.argv[1]), after=GOES_ON)
