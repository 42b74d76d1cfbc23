"""Magnitudes that no animal or robot has: most of them are slips of units."""

import math
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from serpentail_scene.units import DEEPEST, plain

from .errors import UnusualSize

LARGEST = {  # unit -> most, in words, and the unit that may have been meant
    "kg": (1e4, "10 t", "g"),
    "m": (100.0, "100 m", "mm"),
    "s": (600.0, "10 minutes", "ms"),
    "rad": (2 * math.pi * (1 + 1e-12), "a whole turn, 2 pi rad", "deg"),
    "m/s": (100.0, "100 m/s", "mm/s"),
    "rad/s": (1000.0, "1000 rad/s", "deg/s"),
    "m/s2": (100.0, "100 m/s^2", "mm/s2"),
}


def warn_of_unusual(field: str, value: Any, unit: str | Sequence[str], calls: int = 1) -> None:
    """Warn of numbers larger than any animal or robot has; ``calls``: frames above the caller's."""
    for place, number, its_unit in _numbers(value, unit, DEEPEST):
        most, words, meant = LARGEST.get(plain(its_unit), (math.inf, "", ""))
        if most < abs(number) < 1e300:
            told = f"{field}{place}: value {number:.6g} {its_unit}: beyond {words}, "
            told += f'which no animal or robot has: did you mean "{number:.6g} {meant}"?'
            warnings.warn(told, UnusualSize, stacklevel=calls + 1)


def warn_of_degrees(field: str, angles: np.ndarray, first: int = 0, calls: int = 1) -> None:
    """Warn of the first angle (rad) beyond a whole turn that a caller outside the package gives.

    Within it, angles are those of a motion. first: index of the first angle; ``calls`` as above.
    """
    most, words, _ = LARGEST["rad"]
    if np.vdot(angles, angles) <= most**2:
        return
    caller = sys._getframe(calls).f_globals.get("__name__", "")
    for index in np.argwhere(np.abs(angles) > most)[:1].tolist():
        if caller.partition(".")[0] != __name__.partition(".")[0]:
            number = f"{angles[tuple(index)]:.6g}"
            place = "".join(f"[{k}]" for k in (*index[:-1], index[-1] + first))
            told = (
                f"{field}{place}: value {number} rad: beyond {words}, which no joint of an animal"
            )
            told += f" or robot turns: did you mean np.radians({number})?"
            warnings.warn(told, UnusualSize, stacklevel=calls + 1)


def _numbers(value: Any, unit: str | Sequence[str], depth: int) -> Iterator[tuple[str, float, str]]:
    """Yield the place of each number in nested arrays, the number and its unit."""
    if isinstance(value, list | tuple) and depth:
        units = [unit] if isinstance(unit, str) else unit
        for k, entry in enumerate(value):
            for place, number, of in _numbers(entry, units[min(k, len(units) - 1)], depth - 1):
                yield f"[{k}]{place}", number, of
    elif isinstance(value, int | float) and not isinstance(value, bool) and isinstance(unit, str):
        yield "", value, unit
