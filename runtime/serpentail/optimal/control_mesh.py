"""How a mesh is cut into stages, and the polynomials that controls are in them."""

from dataclasses import dataclass
from math import comb

import numpy as np

from .mesh import TimeMesh
from .rules import CollocationRule


@dataclass(frozen=True, eq=False)
class Cut:
    """How a mesh is divided into stages, one for each control interval.

    ends (N + 1,) of the stages, fractions of the duration; first (N + 1,): their first intervals;
    basis (I, K, C): controls at the nodes of each interval for each Bernstein coefficient.
    """

    ends: np.ndarray
    first: np.ndarray
    basis: np.ndarray

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.ends) - 1


def cut(mesh: TimeMesh, rule: CollocationRule, coefficients: int) -> Cut:
    """Return the stages of a mesh; controls have the same number of coefficients in each stage."""
    controls = np.arange(mesh.intervals) if mesh.controls is None else mesh.controls
    first = np.append(np.flatnonzero(np.diff(controls, prepend=-1)), mesh.intervals)
    ends = mesh.ends[first]
    stage = np.repeat(np.arange(len(first) - 1), np.diff(first))
    nodes = mesh.ends[:-1, None] + mesh.widths[:, None] * rule.nodes
    s = (nodes - ends[stage, None]) / np.diff(ends)[stage, None]
    return Cut(ends, first, bernstein(s, coefficients))


def bernstein(s: np.ndarray, coefficients: int) -> np.ndarray:
    """Return the Bernstein polynomials (..., C) at s (...) in [0, 1]."""
    degree, s = coefficients - 1, s[..., None]
    j = np.arange(coefficients)
    return np.array([comb(degree, k) for k in j]) * s**j * (1 - s) ** (degree - j)
