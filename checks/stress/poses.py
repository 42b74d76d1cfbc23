"""Errors at extreme poses: bends from 5e-324 rad to the declared range, folds, coils and speeds."""

import numpy as np

from checks.stress.figure import Figure
from checks.stress.subjects import Subject, compared, errors, state, subject

SIZES = ((1, 3), (3, 4), (1, None), (3, None))
TINY = (0.0, 5e-324, 1e-300, 1e-200, 1e-154, 1e-100, 1e-30, 1e-16, 1e-12, 1e-8, 1e-6)
SMALL = (*TINY, 1e-4, 1e-3, 1e-2, 0.1)
LARGE = (0.3, 1.0, 2.0, np.pi, 4.0, 5.0, 6.0, 2 * np.pi * (1 - 1e-12))
FAST = (1e3, 1e3, 1e3)


def bent() -> list[Figure]:
    """Return the largest errors of continua by their bend, each segment in a plane of its own."""
    rng, found = np.random.default_rng(1), []
    for segments in (1, 3):
        of = subject(segments, None)
        for what, bends in (("theta 0 to 0.1", SMALL), ("theta 0.3 to 2 pi", LARGE)):
            cases = []
            for bend in bends:
                phi = rng.uniform(-np.pi, np.pi, segments)
                direction = np.stack([np.cos(phi), np.sin(phi)], axis=1).ravel()
                cases.append(errors(of, *state(of, rng, bend * direction)))
            found += compared(of, what, cases)
    return found


def folds(of: Subject) -> dict[str, np.ndarray]:
    """Return tail coordinates by name: joints folded back by pi, and segments coiled by 2 pi, all
    in one direction or in alternating directions.
    """
    size, links = of.model.nv - 6, of.model.links or 1
    turns = np.resize([1.0, -1.0], size)
    if of.model.links:
        half, whole, root = np.pi, 2 * np.pi / links, 1.0
    else:  # both components of a bend together
        root = np.sqrt(2)
        half, whole = np.pi / root, 2 * np.pi / root * (1 - 1e-12)
    return {
        "folded at pi": half * turns,
        "folded at pi in pitch": half * root * np.resize([1.0, 0.0], size),
        "folded at pi in yaw": half * root * np.resize([0.0, 1.0], size),
        "coiled by 2 pi a segment": whole * np.ones(size),
        "coiled by 2 pi in turn": whole * turns,
    }


def folded() -> list[Figure]:
    """Return errors of folded and coiled tails."""
    rng, found = np.random.default_rng(2), []
    for size in SIZES:
        of = subject(*size)
        for name, bends in folds(of).items():
            found += compared(of, name, [errors(of, *state(of, rng, bends)) for _ in range(2)])
    return found


def fast() -> list[Figure]:
    """Return errors at velocities of 1e3 m/s and 1e3 rad/s, and at 1e-150 of that."""
    rng, found = np.random.default_rng(3), []
    for size in SIZES:
        of = subject(*size)
        for factor in (1.0, 1e-6, 1e-150):
            bends = rng.uniform(-1, 1, of.model.nv - 6)
            case = errors(of, *state(of, rng, bends, np.multiply(FAST, factor)))
            found += compared(of, f"speeds {factor * 1e3:g}", [case])
    return found


def attitudes() -> list[Figure]:
    """Return the errors for quaternions of many norms: every norm is allowed whose square is a
    finite number above 0.
    """
    rng, found = np.random.default_rng(4), []
    for size in ((1, 3), (3, None)):
        of = subject(*size)
        q, v, tau = state(of, rng, rng.uniform(-1, 1, of.model.nv - 6))
        for norm in (1e-150, 1e-8, 0.5, 3.0, 1e8, 1e150):
            other = np.concatenate([q[:3], norm * q[3:7], q[7:]])
            found += compared(of, f"quaternion of norm {norm:g}", [errors(of, other, v, tau)])
    return found
