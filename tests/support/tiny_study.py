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

PARTS, TAKES = 8, 0.15  # s a part


def square(number: int, folder: Path) -> dict:
    """Take a while, and tell of it."""
    time.sleep(TAKES)
    with open(folder / "ended", "a") as file:
        file.write(f"{number} {os.getpid()}\n")
    return {"number": number, "square": number**2, "third": number / 3}


def parts(folder: Path) -> dict[str, Part]:
    """Return the parts of the study."""
    return {f"part {k}": Part(partial(square, k, folder), {"number": k}) for k in range(PARTS)}


def main(folder: Path) -> None:
    """Make what is missing, and print the results."""
    print(sorted(made("tiny", folder / "parts", parts(folder)).items()))


if __name__ == "__main__":
    run(main, Path(sys.argv[1]), after=GOES_ON)
