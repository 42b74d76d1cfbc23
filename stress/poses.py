"""Errors at extreme poses: bends from 1e-300 rad to the declared range, folds and coils."""

from dataclasses import dataclass

import numpy as np

from stress.figures import Figure
from stress.subjects import Errors, Subject, errors, judged, state, subject

SMALL = (
    0.0,
    5e-324,
    1e-300,
    1e-200,
    1e-154,
    1e-100,
    1e-30,
    1e-16,
    1e-12,
    1e-8,
    1e-6,
    1e-4,
    1e-3,
    1e-2,
    0.1,
)
LARGE = (0.3, 1.0, 2.0, np.pi, 4.0, 5.0, 6.0, 2 * np.pi * (1 - 1e-12))
FAST = (1e3, 1e3, 1e3)


@dataclass(frozen=True)
class Point:
    """One state of the sweep over bends: bend per segment (rad) and errors there."""

    tail: str
    bend: float
    errors: Errors


def direction(rng, segments: int) -> np.ndarray:
    """Return bend components of 1 rad a segment, each in a plane of its own."""
    angles = rng.uniform(-np.pi, np.pi, segments)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()


def swept() -> list[Point]:
    """Return the errors of continua along their bend, straight tails included."""
    rng, found = np.random.default_rng(1), []
    for segments in (1, 3):
        of = subject(segments, None)
        for bend in (*SMALL, *LARGE):
            q, v, tau = state(of, rng, bend * direction(rng, segments))
            found.append(Point(of.name, bend, errors(of, q, v, tau)))
    return found


def of_sweep(points: list[Point]) -> list[Figure]:
    """Return the largest errors along the bend."""
    found = []
    for segments in (1, 3):
        of = subject(segments, None)
        for what, bends in (("theta 0 to 0.1", SMALL), ("theta 0.3 to 2 pi", LARGE)):
            found += judged(
                of, what, [p.errors for p in points if p.tail == of.name and p.bend in bends]
            )
    return found


def folds(of: Subject) -> dict[str, np.ndarray]:
    """Return tail coordinates by name: joints folded back by pi, and segments coiled by 2 pi, all
    in one direction or in alternating directions.
    """
    size, links = of.model.nv - 6, of.model.links or 1
    turns = np.resize([1.0, -1.0], size)
    if of.model.links:
        half, whole = np.pi, 2 * np.pi / links
    else:
        half, whole = np.pi / np.sqrt(2), 2 * np.pi / np.sqrt(2) * (1 - 1e-12)
    alpha, beta = np.resize([1.0, 0.0], size), np.resize([0.0, 1.0], size)
    root = np.sqrt(2) if not of.model.links else 1
    return {
        "folded at pi": half * turns,
        "folded at pi in pitch": half * root * alpha,
        "folded at pi in yaw": half * root * beta,
        "coiled by 2 pi a segment": whole * np.ones(size),
        "coiled by 2 pi in turn": whole * turns,
    }


def folded() -> list[Figure]:
    """Return errors of folded and coiled tails."""
    rng, found = np.random.default_rng(2), []
    for size in ((1, 3), (3, 4), (1, None), (3, None)):
        of = subject(*size)
        for name, bends in folds(of).items():
            found += judged(of, name, [errors(of, *state(of, rng, bends)) for _ in range(2)])
    return found


def fast() -> list[Figure]:
    """Return errors at velocities of 1e3 m/s and 1e3 rad/s, and at 1e-150 of that."""
    rng, found = np.random.default_rng(3), []
    for size in ((1, 3), (3, 4), (1, None), (3, None)):
        of = subject(*size)
        for factor in (1.0, 1e-6, 1e-150):
            bends = rng.uniform(-1, 1, of.model.nv - 6)
            case = state(of, rng, bends, np.multiply(FAST, factor))
            found += judged(of, f"speeds {factor * 1e3:g}", [errors(of, *case)])
    return found


def attitudes() -> list[Figure]:
    """Return the errors of H, C and v_dot for quaternions of many norms: every norm is allowed
    whose square is a finite number above 0.
    """
    rng, found = np.random.default_rng(4), []
    for size in ((1, 3), (3, None)):
        of = subject(*size)
        q, v, tau = state(of, rng, rng.uniform(-1, 1, of.model.nv - 6))
        for norm in (1e-150, 1e-8, 0.5, 3.0, 1e8, 1e150):
            other = q.copy()
            other[3:7] *= norm
            found += judged(of, f"quaternion of norm {norm:g}", [errors(of, other, v, tau)])
    return found
