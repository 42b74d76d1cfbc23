"""How deep a tail goes into the torso, which it begins in or on."""

import numpy as np

from ..basics.attitude import Array


def sunk(points: Array) -> Array:
    """Return how far tails (K, P, 3) go into the torso, (K,): 0 not at all, 1 to its centre.

    points: from the mount to the tip, joined by straight lines, from the torso's centre in its axes
    and divided by its semi-axes, so that the torso is the unit ball. Until the tail has left the
    ball once, it may be as near to the centre as its mount; from then on it must stay outside.
    """
    distance = np.linalg.norm(points, axis=2)
    outside = np.maximum.accumulate(distance, axis=1)[:, :-1] > 1
    allowed = np.where(outside, 1, distance[:, :1])
    return np.asarray(np.max(allowed - _nearest(points), axis=1, initial=0))


def _nearest(points: Array) -> Array:
    """Least distances (K, P - 1) from the centre of the lines between neighbours."""
    starts, ways = points[:, :-1], np.diff(points, axis=1)
    lengths = np.maximum((ways**2).sum(axis=2), np.finfo(float).tiny)
    parts = np.clip(-(starts * ways).sum(axis=2) / lengths, 0, 1)
    return np.asarray(np.linalg.norm(starts + parts[..., None] * ways, axis=2))
