"""Runs an image and reads its outputs, instruction counts and stack by function."""

import subprocess
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from checks.embedded.image import Image, sizes

PATIENCE = 120  # s, longest run of an image


@dataclass(frozen=True)
class Result:
    """One function on all states: status, outputs as bits (states, length) and as numbers, and
    instructions and stack (bytes) of each call.
    """

    statuses: tuple[int, ...]
    bits: np.ndarray
    values: np.ndarray
    instructions: tuple[int, ...]
    depths: tuple[int, ...]


def run(image: Image) -> dict[str, Result]:
    """Run an image; raises RuntimeError if it ends with an error or takes too long."""
    words = [*image.board.emulator, str(image.path)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired as error:
        raise RuntimeError(f"{' '.join(words)} did not end within {PATIENCE} s") from error
    if done.returncode:
        raise RuntimeError(
            f"{' '.join(words)} ended with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}"
        )
    return parsed(done.stdout, image.manifest["real"])


def parsed(text: str, real: str) -> dict[str, Result]:
    """Return results by function.  Instructions of an empty call, and the stack of a call with a
    known frame, are subtracted.
    """
    rows: dict[str, list] = {}
    for line in text.splitlines():
        head, cost = line.split(" | ")
        name, _, status, *bits = head.split()
        rows.setdefault(name, []).append(
            (int(status), [int(word, 16) for word in bits], *map(int, cost.split()))
        )
    idle, room = rows.pop("nothing")[0][2], rows.pop("room")[0][3]
    return {name: _result(lines, real, idle, room) for name, lines in rows.items()}


def _result(lines: list, real: str, idle: int, room: int) -> Result:
    whole, kind = (np.uint32, np.float32) if real == "float" else (np.uint64, np.float64)
    statuses, bits, instructions, depths = zip(*lines, strict=True)
    bits = np.array(bits, whole)
    costs = tuple(n - idle for n in instructions)
    return Result(
        statuses, bits, bits.view(kind).astype(float), costs, tuple(n - room for n in depths)
    )


def blocks(image: Image, name: str) -> dict[str, slice]:
    """Return the slice of each output in a row of a function's values."""
    outputs = image.manifest["functions"][name]["outputs"]
    ends = np.cumsum([0, *sizes(outputs)])
    return {a["name"]: slice(*pair) for a, pair in zip(outputs, pairwise(ends), strict=True)}
