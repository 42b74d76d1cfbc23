"""How far a plan goes beyond its bounds, which the program knows at nodes alone, between them."""

import numpy as np

from serpentail_scene.layout import OMEGA

from ...optimal.samples import MeshSamples
from ..flight import State
from ..program.build import PlanProgram
from .curve import Curve
from .full_state import full_state
from .truth import planned_torques

SAMPLES = 33  # of an interval, its ends among them
SLACK = 1e-3  # of a bound: a successful plan may exceed it by this part

Excess = dict[str, np.ndarray]


def excess(program: PlanProgram, curve: Curve, samples: MeshSamples, start: State) -> Excess:
    """Return by what part (N,) of a bound each interval exceeds it, by name; 0 or less inside it.

    Names: "torque", "torque_rate", "tension", "angle", "rate", "path", if they are bounded. For a
    path constraint, or one of the motors' speed and power, it is a part of the larger limit. start:
    of the motion.
    """
    bounds, N = program.problem.bounds, program.mesh.intervals
    k, s = np.repeat(np.arange(N), SAMPLES), np.tile(np.linspace(0, 1, SAMPLES), N)
    blocks = curve.inside(k, s)
    found = {
        name: _beyond(blocks[block] / bound, N)
        for name, block, bound in (
            ("torque", "torque", bounds.torque),
            ("tension", "tension", bounds.tension),
            ("angle", "tail", bounds.angle),
            ("rate", "tail_rate", bounds.rate),
        )
        if bound is not None
    }
    if bounds.torque_rate is not None:
        found["torque_rate"] = _beyond(_slopes(curve, k, s) / bounds.torque_rate, N)
    if program.problem.rows:
        times = curve.ends[k] + s * np.diff(curve.ends)[k]
        found["path"] = _path(program, samples, times, blocks, start)
    return found


def largest(found: Excess) -> tuple[float, str | None]:
    """Return the largest excess, 0 if no bound is exceeded, and the name of its bound."""
    of = {name: float(np.nan_to_num(part, nan=np.inf).max()) for name, part in found.items()}
    worst = max(of, key=lambda name: of[name], default=None)
    return (0.0, None) if worst is None or of[worst] <= 0 else (of[worst], worst)


def exceeded(part: np.ndarray) -> np.ndarray:
    """Tell for each interval if it exceeds a bound too far."""
    return ~(part <= SLACK)


def _beyond(ratios: np.ndarray, intervals: int) -> np.ndarray:
    """Largest magnitude (N,) of ratios (N SAMPLES, c), less 1."""
    return np.abs(ratios).reshape(intervals, -1).max(axis=1) - 1


def _slopes(curve: Curve, k: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Slopes of torques (N SAMPLES, 2m), N m/s; of torques that are constant in intervals, their
    steps over the distance of nodes.
    """
    torques, width = planned_torques(curve), np.diff(curve.ends)
    if len(curve.rule.nodes) == 1:
        steps = np.diff(torques.coefficients[..., 0], axis=0) / width[1:, None]
        return np.vstack([0 * steps[:1], steps])[k]
    c, x = torques.coefficients[k], (s * width[k])[:, None]
    return sum(j * c[..., j] * x ** (j - 1) for j in range(1, c.shape[2]))


def _path(
    program: PlanProgram,
    samples: MeshSamples,
    times: np.ndarray,
    blocks: dict[str, np.ndarray],
    start: State,
) -> np.ndarray:
    """Excess (N,) of the path constraints, over the larger of their limits."""
    values = path_values(program, samples, times, blocks, start)
    least, most = program.each_path()
    sizes = np.where(np.isfinite([least, most]), np.abs([least, most]), 0).max(axis=0)
    over = np.maximum(values - most, least - values) / np.where(sizes > 0, sizes, 1.0)
    return over.reshape(program.mesh.intervals, -1).max(axis=1)


def path_values(
    program: PlanProgram,
    samples: MeshSamples,
    times: np.ndarray,
    blocks: dict[str, np.ndarray],
    start: State,
) -> np.ndarray:
    """Return the values (K, path) of the path constraints at times (K,) with blocks (K, ..)."""
    variables, node, count = program.variables, program.optimal.node, len(times)
    parts = [blocks[name] for name, _ in variables.states]
    if program.compiled:
        parts.append(full_state(program.model, start, times, blocks)[1][:, OMEGA])
    own = blocks[variables.input]
    parts.append(0 * own if variables.torque_is_state else own)
    constants = samples.constants * variables.scale(variables.constants)
    fractions = (times / samples.duration)[:, None]
    more = [np.tile(row, (count, 1)) for row in (constants, node.numbers)]
    e = np.column_stack([*parts, more[0], fractions, more[1]])
    y = np.array(program.terms.terms.values.map(count)(e.T))
    first = len(y) - 1 - node.rows
    return y[first:-1].T
