"""Curves: unknowns of a solved program go in; the motion that they mean, at any time, comes out."""

from dataclasses import dataclass

import numpy as np

from ..nlp.rules import CollocationRule
from ..nlp.transcription import Transcription


@dataclass(frozen=True, eq=False)
class Curve:
    """Collocation polynomials of all intervals, by block, SI.

    ends (N + 1,): s.  starts (N, size): states where intervals start; increments (N, K, size):
    their rates at the nodes times the interval's duration; nodes (N, K, size): torques and
    algebraic unknowns.
    """

    ends: np.ndarray
    rule: CollocationRule
    starts: dict[str, np.ndarray]
    increments: dict[str, np.ndarray]
    nodes: dict[str, np.ndarray]

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.ends[-1])

    def at(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Blocks (n, size) at times (n,) s from the start; between intervals those of the later
        one.
        """
        return self.inside(*self._places(times))

    def slopes(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Rates (n, size) of the states' blocks, per s, at times (n,) s; between intervals those of
        the later one.
        """
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


def curve(program: Transcription, w: np.ndarray, h: np.ndarray) -> Curve:
    """Return the curve of the unknowns w."""
    where, rule, form, mesh = program.places, program.rule, program.form, program.mesh
    count, S, K = mesh.intervals, rule.steps, len(rule.nodes)
    at_nodes = np.arange(count)[:, None] * S + np.arange(K)
    rates = np.array(program.program["values"](w, h)).T[:, : program.node.rates] * form.scale(
        form.states
    )
    increments = rates[at_nodes] * mesh.widths[:, None, None]
    states = w[where.states[:-1:S]] * form.scale(form.states)
    blocks = (*form.algebraic, ("torque", form.units["torque"].size))
    others = (w[where.others] * form.scale(blocks))[at_nodes]
    ends = mesh.ends * w[0]
    return Curve(
        ends,
        rule,
        _split(states, form.states),
        _split(increments, form.states),
        _split(others, blocks),
    )


def _split(rows: np.ndarray, blocks) -> dict[str, np.ndarray]:
    """Columns of the last axis by block."""
    ends = np.cumsum([size for _, size in blocks])[:-1]
    return dict(zip((name for name, _ in blocks), np.split(rows, ends, axis=-1), strict=True))
