"""The motion of a solved program, at any time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from serpentail_scene.layout import POSITION

from ...basics.short_repr import brief
from ...optimal.rules import CollocationRule
from ...optimal.samples import MeshSamples
from ..air import in_air, world_velocity
from ..program.build import PlanProgram
from ..tendons import of_coordinates


@dataclass(frozen=True, eq=False)
class Curve:
    """Collocation polynomials of all intervals, by block, SI.

    ends (N + 1,): s. starts (N, size): states at the beginning of intervals; increments (N, K,
    size): their rates at the nodes times the interval's duration; nodes (N, K, size): torques, or
    tensions.
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


def fitted(motion: Curve, sampled: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """Return polynomials (pieces, channels, powers) of the time since each interval's beginning.

    sampled: values (n, channels) in intervals k (n,) at fractions s (n,) of them.
    """
    pieces, powers = len(motion.ends) - 1, len(motion.rule.nodes) + 1
    s = (1 - np.cos(np.pi * np.arange(powers) / (powers - 1))) / 2
    k = np.repeat(np.arange(pieces), powers)
    values = sampled(k, np.tile(s, pieces)).reshape(pieces, powers, -1)
    found = np.linalg.solve(np.vander(s, increasing=True), values)
    widths = np.diff(motion.ends)[:, None, None]
    return np.swapaxes(found, 1, 2) / widths ** np.arange(powers)


def curve(program: PlanProgram, samples: MeshSamples) -> Curve:
    """Return the curve of a motion on a program's mesh: rates are those of its polynomials."""
    variables, rule, mesh = program.variables, program.rule, program.mesh
    K = len(rule.nodes)
    points = np.arange(mesh.intervals)[:, None] * K + np.arange(K + 1)
    states = samples.states[points]
    blocks = variables.split(variables.states, states)
    torque = blocks.pop("torque")[:, 1:] if variables.torque_is_state else None
    if torque is None:
        torque = samples.controls * variables.units[variables.input]
        if variables.input == "torque":
            torque = of_coordinates(program.model, torque)
    starts = {name: values[:, 0] for name, values in blocks.items()}
    increments = {name: np.einsum("ij,kjx->kix", rule.states, x) for name, x in blocks.items()}
    ends = mesh.ends * samples.duration
    if in_air(program.model):  # the position is a quadrature
        inside = {name: values[:, 1:] for name, values in blocks.items()}
        steps = world_velocity(program.model, inside) * np.diff(ends)[:, None, None]
        grown = np.cumsum(np.einsum("j,njx->nx", rule.weights, steps), axis=0)[:-1]
        starts["place"] = program.problem.q0[POSITION] + np.vstack([np.zeros(3), grown])
        increments["place"] = steps
    return Curve(ends, rule, starts, increments, {variables.input: torque})
