"""Where the unknowns of a nonlinear program are."""

from dataclasses import dataclass, field
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

    After the duration are common (c,), unknowns of all nodes, and at_start, of the start alone.
    states (P, nx): of all points; others (N, na + nu): algebraic unknowns and torques of all nodes.
    """

    states: np.ndarray
    others: np.ndarray
    algebraic: int  # na
    first: int  # the point that is the first node: 0, or 1 if the start is not a node
    common: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    at_start: np.ndarray = field(default_factory=lambda: np.zeros(0, int))

    @property
    def controls(self) -> np.ndarray:
        """Indices (N, nu) of the torques."""
        return self.others[:, self.algebraic :]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        own = self.common.size + self.at_start.size
        return 1 + own + self.states.size + self.others.size

    def nodes(self) -> np.ndarray:
        """Indices (1 + c + nx + na + nu, N) of the arguments of each node's function."""
        shared = np.tile(np.append(0, self.common), (len(self.others), 1))
        return np.column_stack([shared, self.states[self.first :], self.others]).T


def indices_of(variables: "Variables", mesh: Mesh, rule: CollocationRule) -> Indices:
    """Return the indices, unknowns that meet in an equation being neighbours."""
    nx, na, nu = variables.sizes()
    ends = np.cumsum([1, *(sum(size for _, size in blocks) for blocks in variables.shared)])
    common, at_start = np.arange(*ends[:2]), np.arange(*ends[1:])
    points = mesh.intervals * rule.steps + 1
    first = 0 if rule.nodes[0] == 0 else 1
    widths = np.full(points, nx + na + nu)
    widths[:first] = nx
    starts = ends[-1] + np.concatenate([[0], np.cumsum(widths)[:-1]])
    states = starts[:, None] + np.arange(nx)
    others = (starts[first:] + nx)[:, None] + np.arange(na + nu)
    return Indices(states, others, na, first, common, at_start)


def columns_of(indices: np.ndarray, blocks: tuple[tuple[str, int], ...], name: str) -> np.ndarray:
    """Return indices (K, size) of one block from those (K, sizes) of all blocks (name, size)."""
    starts = accumulate((size for _, size in blocks), initial=0)
    start = dict(zip((block for block, _ in blocks), starts, strict=False))[name]
    return indices[:, start : start + dict(blocks)[name]]
