"""The motion of a solved program, at any time."""

from dataclasses import dataclass

import numpy as np

from ...basics.short_repr import brief
from ..nlp.program import NonlinearProgram
from ..nlp.rules import CollocationRule


@dataclass(frozen=True, eq=False)
class Curve:
    """Collocation polynomials of all intervals, by block, SI.

    ends (N + 1,): s. starts (N, size): states at the beginning of intervals; increments (N, K,
    size): their rates at the nodes times the interval's duration; nodes (N, K, size): torques and
    algebraic unknowns.
    """

    ends: np.ndarray
    rule: CollocationRule
    starts: dict[str, np.ndarray]
    increments: dict[str, np.ndarray]
    nodes: dict[str, np.ndarray]

    __repr__ = brief

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.ends[-1])

    def at(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Blocks (n, size) at times (n,) s from the start; at an interval's end the next one's."""
        return self.inside(*self._places(times))

    def slopes(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Rates (n, size) of the states' blocks, per s, at times (n,) s; as ``at``."""
        k, s = self._places(times)
        basis, width = self.rule.basis(s), np.diff(self.ends)[k, None]
        return {
            name: np.einsum("nj,njx->nx", basis, rates[k]) / width
            for name, rates in self.increments.items()
        }

    def _places(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Intervals (n,) and fractions (n,) of them at times (n,)."""
        k = np.clip(np.searchsorted(self.ends, times, side="right") - 1, 0, len(self.ends) - 2)
        return k, (times - self.ends[k]) / np.diff(self.ends)[k]

    def inside(self, k: np.ndarray, s: np.ndarray) -> dict[str, np.ndarray]:
        """Blocks (n, size) in the intervals k (n,) at the fractions s (n,) of them."""
        grown, basis = self.rule.integrals(s), self.rule.basis(s)
        states = {
            name: x[k] + np.einsum("nj,njx->nx", grown, self.increments[name][k])
            for name, x in self.starts.items()
        }
        return states | {
            name: np.einsum("nj,njx->nx", basis, values[k]) for name, values in self.nodes.items()
        }


def curve(nlp: NonlinearProgram, w: np.ndarray, p: np.ndarray) -> Curve:
    """Return the curve of the unknowns w; p: the program's parameters."""
    indices, rule, variables, mesh = nlp.indices, nlp.rule, nlp.variables, nlp.mesh
    scale = variables.scale(variables.states)
    at_nodes = np.arange(mesh.intervals)[:, None] * rule.steps + np.arange(len(rule.nodes))

    # states at the beginning of intervals, and the increments by their rates at the nodes
    states = w[indices.states[: -1 : rule.steps]] * scale
    rates = nlp.rates(w, p) * scale
    increments = rates[at_nodes] * mesh.widths[:, None, None]

    # torques and algebraic unknowns at the nodes
    blocks = (*variables.algebraic, ("torque", variables.units["torque"].size))
    others = (w[indices.others] * variables.scale(blocks))[at_nodes]
    return Curve(
        mesh.ends * w[0],
        rule,
        _split(states, variables.states),
        _split(increments, variables.states),
        _split(others, blocks),
    )


def _split(rows: np.ndarray, blocks: tuple[tuple[str, int], ...]) -> dict[str, np.ndarray]:
    """Columns of the last axis by block."""
    ends = np.cumsum([size for _, size in blocks])[:-1]
    return dict(zip((name for name, _ in blocks), np.split(rows, ends, axis=-1), strict=True))
