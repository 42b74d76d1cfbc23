"""Random numbers of the points of a sweep, each computed from the seed and its place alone."""

from functools import lru_cache

import numpy as np

PART = 1024  # places that are drawn together
ROUNDS = 6  # of the permutation of a Latin hypercube


def drawn(kind: str, places: np.ndarray, size: int, seed: int, points: int) -> np.ndarray:
    """Return numbers (k, size) from 0 to 1 at places (k,) from 0 to points - 1."""
    parts, inside = np.divmod(places, PART)
    numbers = np.empty((len(places), size))
    for part in np.unique(parts):
        here = parts == part
        numbers[here] = _part(kind, int(part), size, seed, points)[inside[here]]
    return numbers


@lru_cache(maxsize=16)
def _part(kind: str, part: int, size: int, seed: int, points: int) -> np.ndarray:
    """Return the numbers (PART, size) of one part of the places."""
    if kind == "sobol":
        from scipy.stats import qmc

        engine = qmc.Sobol(size, seed=np.random.default_rng(seed))
        if part:
            engine.fast_forward(part * PART)
        return engine.random(PART)
    bits = np.random.PCG64(seed)
    bits.advance(part * PART * size)
    numbers = np.random.Generator(bits).random((PART, size))
    if kind == "latin":
        places = np.arange(part * PART, min((part + 1) * PART, points))
        for k in range(size):
            numbers[: len(places), k] += permuted(places, points, [seed, k])
        numbers /= points
    return numbers


def permuted(places: np.ndarray, points: int, seed: list[int]) -> np.ndarray:
    """Return where places go in a permutation of 0 to points - 1 that depends on a seed.

    A Feistel network permutes the numbers below a power of 4; what falls outside goes through it
    again until it is inside.
    """
    half = np.uint64(max(1, (max(points - 1, 1).bit_length() + 1) // 2))
    mask = (np.uint64(1) << half) - np.uint64(1)
    keys = np.random.default_rng(seed).integers(0, 2**64, ROUNDS, np.uint64)
    numbers = places.astype(np.uint64)
    outside = np.ones(len(numbers), bool)
    while outside.any():
        left, right = numbers[outside] >> half, numbers[outside] & mask
        for key in keys:
            left, right = right, left ^ (_mixed(right ^ key) & mask)
        numbers[outside] = (left << half) | right
        outside = numbers >= points
    return numbers.astype(np.int64)


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """Return numbers of 64 bits of which each bit depends on all bits of the given ones."""
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        numbers = (numbers ^ (numbers >> np.uint64(shift))) * np.uint64(factor)
    return numbers ^ (numbers >> np.uint64(31))
