"""Where the unknowns of a nonlinear program are."""

from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from .mesh import Mesh
from .rules import CollocationRule

if TYPE_CHECKING:
    from .node import Variables


@dataclass(frozen=True, eq=False)
class Indices:
    """Positions of the unknowns in w: the duration first, then points and nodes along the motion.

    states (P, nx): of all points; others (N, na + nu): algebraic unknowns and torques of all nodes.
    """

    states: np.ndarray
    others: np.ndarray
    algebraic: int  # na
    first: int  # the point that is the first node: 0, or 1 if the start is not a node

    @property
    def controls(self) -> np.ndarray:
        """Indices (N, nu) of the torques."""
        return self.others[:, self.algebraic :]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 1 + self.states.size + self.others.size

    def nodes(self) -> np.ndarray:
        """Indices (1 + nx + na + nu, N) of the arguments of each node's function."""
        duration = np.zeros((len(self.others), 1), int)
        return np.column_stack([duration, self.states[self.first :], self.others]).T


def indices_of(variables: "Variables", mesh: Mesh, rule: CollocationRule) -> Indices:
    """Return the indices, unknowns that meet in an equation being neighbours."""
    nx, na, nu = variables.sizes()
    points = mesh.intervals * rule.steps + 1
    first = 0 if rule.nodes[0] == 0 else 1
    widths = np.full(points, nx + na + nu)
    widths[:first] = nx
    starts = 1 + np.concatenate([[0], np.cumsum(widths)[:-1]])
    states = starts[:, None] + np.arange(nx)
    others = (starts[first:] + nx)[:, None] + np.arange(na + nu)
    return Indices(states, others, na, first)


def columns_of(indices: np.ndarray, blocks: tuple[tuple[str, int], ...], name: str) -> np.ndarray:
    """Return indices (K, size) of one block from those (K, sizes) of all blocks (name, size)."""
    starts = accumulate((size for _, size in blocks), initial=0)
    start = dict(zip((block for block, _ in blocks), starts, strict=False))[name]
    return indices[:, start : start + dict(blocks)[name]]
