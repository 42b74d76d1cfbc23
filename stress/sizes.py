"""Errors of long tails, up to (20, 4) and (1, 512), against 40 digits."""

import numpy as np

from stress.figures import Figure
from stress.subjects import errors, judged, state, subject

SIZES = ((1, 1), (8, 4), (20, 1), (20, 4), (1, 512), (6, None))


def measured() -> list[Figure]:
    """Return errors by size: bends of up to 1 rad a segment, and folds of up to 3 rad."""
    rng, found = np.random.default_rng(5), []
    for size in SIZES:
        of = subject(*size)
        per_joint = 1 / (of.model.links or 1)
        for reach in (1.0, 3.0):
            bend = rng.uniform(-reach, reach, of.model.nv - 6) * per_joint
            found += judged(of, f"bends up to {reach:g} rad", [errors(of, *state(of, rng, bend))])
    return found
