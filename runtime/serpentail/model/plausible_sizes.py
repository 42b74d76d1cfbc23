"""Warns of parameters that no animal has, or that cost digits; most often a unit is wrong."""

import math
import warnings
from collections.abc import Iterator

import numpy as np

from ..basics.errors import UnlikeBodies, UnusualSize
from ..basics.plausible_values import warn_of_unusual
from .parameters import UNITS, Values

UNLIKE = 1e4  # from here on H may be off by 1e-12 of its diagonal: docs/stability.md
SMALLEST = {"torso_mass": (1e-4, "0.1 g"), "tail_length": (1e-3, "1 mm")}
HEAVIEST = 10.0  # times the torso: a tail; those of animals weigh less than half of it
DENSEST = 1e6  # kg/m^3: 44 times osmium, because studies may change a mass but not its inertia


def warn_of_sizes(manifest: dict, values: Values, calls: int = 2) -> None:
    """Warn of the sizes of a model, or of many runs; ``calls``: frames above this function.

    UnusualSize: no animal or robot has them. UnlikeBodies: H loses digits.
    """
    units = UNITS | {p["name"]: p["unit"] for p in manifest["parameters"]}
    for name, value in values.items():
        largest = float(np.max(np.abs(value), initial=0.0))
        warn_of_unusual(name, largest, units[name], calls + 1)
    free = "torso_inertia" in values
    for told in (*_too_small(values, units), *(_unlike_torsos(values) if free else ())):
        warnings.warn(told, UnusualSize, stacklevel=calls + 1)
    if free:
        warn_of_unlike(values, calls + 1)


def _too_small(values: Values, units: dict[str, str]) -> Iterator[str]:
    """Yield a line about each parameter that is too small."""
    for name, (least, words) in [each for each in SMALLEST.items() if each[0] in values]:
        smallest = np.min(values[name])
        if smallest < least:
            told = f"{name}: value {smallest:.6g} {units[name]}: below {words}, which no animal or"
            yield f"{told} robot has: are the units kg and m?"


def _unlike_torsos(values: Values) -> Iterator[str]:
    """Yield lines about a torso's mass besides its inertia and its tail."""
    yield from _too_dense(values)
    masses, tails = np.broadcast_arrays(values["torso_mass"], values["tail_mass"])
    for k in np.flatnonzero(tails > HEAVIEST * masses)[:1]:
        mass, tail = masses.flat[k], tails.flat[k]
        if mass >= SMALLEST["torso_mass"][0]:  # else this is told
            told = f"tail_mass: value {tail:.6g} kg: {tail / mass:.3g} times the torso_mass of"
            told += f" {mass:.6g} kg, more than {HEAVIEST:g} times, which no animal or robot has:"
            yield f'{told} did you mean "{tail:.6g} g"?'


def _too_dense(values: Values) -> Iterator[str]:
    """Yield a line about a torso that is denser than any metal; of many runs, about the first."""
    masses = np.atleast_1d(values["torso_mass"])
    moments = np.atleast_1d(np.max(values["torso_inertia"], axis=-1))
    # of all bodies of this moment of inertia the ball, I = 2/5 m r^2, is the least dense
    with np.errstate(all="ignore"):
        radii = np.sqrt(2.5 * moments / masses)
        densities = masses / (4 / 3 * math.pi * radii**3)
    masses, moments = np.broadcast_arrays(masses, moments)
    for k in np.flatnonzero(densities > DENSEST)[:1]:
        mass, moment = masses[k], moments[k]
        told = f"torso_mass: value {mass:.6g} kg: with a torso_inertia of {moment:.3g} kg m^2 it is"
        yield f'{told} denser than any metal: did you mean "{mass:.6g} g"?'


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


def warn_of_unlike(values: Values, calls: int = 2) -> None:
    """Warn if H loses digits because torso and tail differ in size; ``calls`` as above."""
    ratio = disparity(values)
    if ratio > UNLIKE:
        sizes = "tail_mass, tail_length, tail_mount, torso_inertia"
        words = (
            f"torso and tail differ by a factor of {ratio:.1e} ({sizes}): H may be off by as many "
            "roundings"
        )
        warnings.warn(f"{words}; are the units kg and m?", UnlikeBodies, stacklevel=calls + 1)
