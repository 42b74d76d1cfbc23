"""Intervals of the duration, and how they are split if a solution is wrong."""

from dataclasses import dataclass

import numpy as np

from ..basics.short_repr import brief
from .rules import CollocationRule

MOST_PIECES = 4  # an interval is split into at a time


@dataclass(frozen=True, eq=False)
class TimeMesh:
    """Ends of the intervals (N + 1,) as fractions of the duration, from 0 to 1.

    controls (N,): number of the control interval of each; torques are one polynomial in it, however
    many intervals it has.  None: one in each interval.
    """

    ends: np.ndarray
    controls: np.ndarray | None
    __repr__ = brief

    @property
    def intervals(self) -> int:
        """Number of intervals N."""
        return len(self.ends) - 1

    @property
    def widths(self) -> np.ndarray:
        """Widths (N,) of the intervals."""
        return np.diff(self.ends)

    def same(self, other: "TimeMesh") -> bool:
        """Tell if two meshes are the same."""
        return self.key == other.key

    @property
    def key(self) -> tuple:
        """All that it consists of."""
        controls = () if self.controls is None else tuple(self.controls)
        return (*self.ends, *controls)

    def halved(self, chosen: np.ndarray, most: int) -> "TimeMesh":
        """Return the mesh with chosen intervals (N,) halved, as many of them as ``most`` allows."""
        room = most - self.intervals
        return self.split(1 + (chosen & (np.cumsum(chosen) <= room)))

    def points(self, rule: CollocationRule) -> np.ndarray:
        """Times (N K + 1,) of the start and all nodes, as fractions of the duration."""
        nodes = self.ends[:-1, None] + self.widths[:, None] * rule.nodes
        nodes[:, -1] = self.ends[1:]
        return np.append(0.0, nodes.ravel())

    def split(self, pieces: np.ndarray) -> "TimeMesh":
        """Return the mesh whose interval k is split into pieces[k] equal ones."""
        rows = [
            np.linspace(a, b, count, endpoint=False)
            for a, b, count in zip(self.ends[:-1], self.ends[1:], pieces, strict=True)
        ]
        controls = None if self.controls is None else np.repeat(self.controls, pieces)
        return TimeMesh(np.append(np.concatenate(rows), 1.0), controls)


def uniform(intervals: int, controls: int | None = None) -> TimeMesh:
    """Return a mesh of equal intervals, or of at least as many in equal control intervals."""
    if controls is None:
        return TimeMesh(np.linspace(0.0, 1.0, intervals + 1), None)
    coarse = TimeMesh(np.linspace(0.0, 1.0, controls + 1), np.arange(controls))
    return coarse.split(np.full(controls, -(-intervals // controls)))


def refined(mesh: TimeMesh, errors: np.ndarray, factor: float, order: int, most: int) -> TimeMesh:
    """Return a mesh of at most `most` intervals whose errors sum to `factor` of these (N,).

    Errors are spread evenly; the error of an interval of width h falls as h^(order + 1).
    """
    # how many pieces each interval needs for its part of the error
    order = min(order, 4)  # the order that is left with an optimiser's controls
    target = max(factor * errors.sum(), 1e-300) / mesh.intervals
    wanted = np.ceil((errors / target) ** (1 / (order + 1)))
    pieces = np.clip(np.nan_to_num(wanted, nan=2, posinf=MOST_PIECES), 1, MOST_PIECES).astype(int)

    # a mesh that would stay as it is gets finer where it is worst
    if pieces.sum() == mesh.intervals:
        pieces[np.argsort(errors)[-max(1, mesh.intervals // 4) :]] = 2

    # if these are too many, the least important ones wait
    for k in np.argsort(errors):
        if pieces.sum() <= most:
            break
        pieces[k] = 1
    return mesh.split(pieces)
