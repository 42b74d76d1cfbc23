"""Warns of values that no animal or robot has, or that cost digits: most often a unit is wrong."""

import math
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from serpentail_scene.parameters import OUT_OF_REACH
from serpentail_scene.units import DEEPEST, plain

from .errors import UnlikeBodies, UnusualSize

LARGEST = {  # unit -> most, in words, and the unit that may have been meant
    "kg": (1e4, "10 t", "g"),
    "m": (100.0, "100 m", "mm"),
    "s": (600.0, "10 minutes", "ms"),
    "rad": (2 * math.pi * (1 + 1e-12), "a whole turn, 2 pi rad", "deg"),
    "m/s": (100.0, "100 m/s", "mm/s"),
    "rad/s": (1000.0, "1000 rad/s", "deg/s"),
    "m/s2": (100.0, "100 m/s^2", "mm/s2"),
}
SMALLEST = {"torso_mass": (1e-4, "0.1 g", "kg"), "tail_length": (1e-3, "1 mm", "m")}
HEAVIEST = 10.0  # times the torso: a tail; those of animals weigh less than half of it
DENSEST = 1e6  # kg/m^3: 44 times osmium, because studies may change a mass but not its inertia
UNLIKE = 1e4  # from here on H may be off by 1e-12 of its diagonal: docs/stability.md
NOBODY = "which no animal or robot has"
Values = Mapping[str, Any]  # parameters by name, SI; of many runs (k,) or (k, size)


def warn_of_unusual(field: str, value: Any, unit: str | Sequence[str], calls: int = 1) -> None:
    """Warn of numbers larger than any animal or robot has; ``calls``: frames above the caller's."""
    for place, number, its_unit in _numbers(value, unit, DEEPEST):
        most, words, meant = LARGEST.get(plain(its_unit), (math.inf, "", ""))
        if most < abs(number) < 1e300:
            line = (
                f"{field}{place}: value {number:.6g} {its_unit}: beyond {words}, {NOBODY}: did you "
                f'mean "{number:.6g} {meant}"?'
            )
            warnings.warn(line, UnusualSize, stacklevel=calls + 1)


def _numbers(value: Any, unit: str | Sequence[str], depth: int) -> Iterator[tuple[str, float, str]]:
    """Yield the place of each number in nested arrays, the number and its unit."""
    if isinstance(value, list | tuple) and depth:
        units = [unit] if isinstance(unit, str) else unit
        for k, entry in enumerate(value):
            for place, number, of in _numbers(entry, units[min(k, len(units) - 1)], depth - 1):
                yield f"[{k}]{place}", number, of
    elif isinstance(value, int | float) and not isinstance(value, bool) and isinstance(unit, str):
        yield "", value, unit


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
            line = (
                f"{field}{place}: value {number} rad: beyond {words}, which no joint of an animal "
                f"or robot turns: did you mean np.radians({number})?"
            )
            warnings.warn(line, UnusualSize, stacklevel=calls + 1)


def warn_of_sizes(units: Mapping[str, str], values: Values, calls: int = 2) -> None:
    """Warn of the parameters of a model, or of many runs; ``calls``: frames above this function.

    UnusualSize: no animal or robot has them. UnlikeBodies: H loses digits.
    """
    for name, value in values.items():
        sizes = np.abs(value)
        largest = float(np.max(sizes, initial=0.0, where=sizes != OUT_OF_REACH))
        warn_of_unusual(name, largest, units[name], calls + 1)
    free = "torso_inertia" in values
    for line in (*_too_small(values), *(_unlike_torsos(values) if free else ())):
        warnings.warn(line, UnusualSize, stacklevel=calls + 1)
    ratio = disparity(values) if free else 0.0
    if ratio > UNLIKE:
        line = (
            f"torso and tail differ by a factor of {ratio:.1e} (tail_mass, tail_length, "
            "tail_mount, torso_inertia): H may be off by as many roundings; are the units kg and m?"
        )
        warnings.warn(line, UnlikeBodies, stacklevel=calls + 1)


def _too_small(values: Values) -> Iterator[str]:
    """Yield a line about each parameter that is too small."""
    for name, (least, words, unit) in SMALLEST.items():
        smallest = np.min(values.get(name, math.inf))
        if smallest < least:
            yield (
                f"{name}: value {smallest:.6g} {unit}: below {words}, {NOBODY}: are the units kg "
                "and m?"
            )


def _unlike_torsos(values: Values) -> Iterator[str]:
    """Yield lines about a torso's mass besides its inertia and its tail; of the first such run."""
    masses, tails, moments = np.broadcast_arrays(
        *(np.atleast_1d(values["torso_mass"]), values["tail_mass"]),
        np.max(values["torso_inertia"], axis=-1),
    )
    # of all bodies of this moment of inertia the ball, I = 2/5 m r^2, is the least dense
    with np.errstate(all="ignore"):
        radii = np.sqrt(2.5 * moments / masses)
        densities = masses / (4 / 3 * math.pi * radii**3)
    for k in np.flatnonzero(densities > DENSEST)[:1]:
        yield (
            f"torso_mass: value {masses[k]:.6g} kg: with a torso_inertia of {moments[k]:.3g} "
            f'kg m^2 it is denser than any metal: did you mean "{masses[k]:.6g} g"?'
        )
    for k in np.flatnonzero(tails > HEAVIEST * masses)[:1]:
        mass, tail = masses[k], tails[k]
        if mass >= SMALLEST["torso_mass"][0]:  # else there is a line about it
            yield (
                f"tail_mass: value {tail:.6g} kg: {tail / mass:.3g} times the torso_mass of "
                f"{mass:.6g} kg, more than {HEAVIEST:g} times, {NOBODY}: did you mean "
                f'"{tail:.6g} g"?'
            )


def disparity(values: Values) -> float:
    """Return by what factor torso and tail differ; of many runs, the largest.

    It is the larger of m (b + L)^2 / min I_b and b / L: m and L are the tail's mass and length, b
    is the distance of its mount from B, I_b the torso's moments of inertia. The first compares
    moments that cancel in H with what is left.
    """
    mass, length = np.asarray(values["tail_mass"]), np.asarray(values["tail_length"])
    with np.errstate(all="ignore"):
        mount = np.linalg.norm(values["tail_mount"], axis=-1)
        torso = np.min(values["torso_inertia"], axis=-1)
        moments = mass * (mount + length) ** 2 / torso
        return float(np.max(np.maximum(moments, mount / length)))
