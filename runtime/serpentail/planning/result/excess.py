"""How far a plan goes beyond its bounds, which the program knows at nodes alone, between them."""

import numpy as np

from ..nlp.node import Node
from ..nlp.program import NonlinearProgram
from ..nlp.transcription import Transcription
from .curve import Curve
from .truth import planned_torques

SAMPLES = 33  # of an interval, its ends among them
SLACK = 1e-3  # of a bound: a successful plan may exceed it by this part

Excess = dict[str, np.ndarray]


def excess(nlp: NonlinearProgram, curve: Curve, p: np.ndarray, w: np.ndarray) -> Excess:
    """Return by what part (N,) of a bound each interval exceeds it, by name; 0 or less inside it.

    Names: "torque", "torque_rate", "angle", "rate", "path", if they are bounded. For a path
    constraint it is a part of the larger limit. p: the program's parameters; w: its unknowns.
    """
    bounds, N = nlp.problem.bounds, nlp.mesh.intervals
    k, s = np.repeat(np.arange(N), SAMPLES), np.tile(np.linspace(0, 1, SAMPLES), N)
    blocks = curve.inside(k, s)
    found = {
        name: _beyond(blocks[block] / bound, N)
        for name, block, bound in (
            ("torque", "torque", bounds.torque),
            ("angle", "tail", bounds.angle),
            ("rate", "tail_rate", bounds.rate),
        )
        if bound is not None
    }
    if bounds.torque_rate is not None:
        found["torque_rate"] = _beyond(_slopes(nlp, curve, k, s) / bounds.torque_rate, N)
    if isinstance(nlp, Transcription) and nlp.problem.path:
        times = curve.ends[k] + s * np.diff(curve.ends)[k]
        found["path"] = _path(nlp, w, times, blocks, p)
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


def _slopes(nlp: NonlinearProgram, curve: Curve, k: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Slopes of torques (N SAMPLES, 2m), N m/s; of torques that are constant in intervals, their
    steps over the distance of nodes.
    """
    torques, width = planned_torques(curve), np.diff(curve.ends)
    if len(nlp.rule.nodes) == 1:
        steps = np.diff(torques.coefficients[..., 0], axis=0) / width[1:, None]
        return np.vstack([0 * steps[:1], steps])[k]
    c, x = torques.coefficients[k], (s * width[k])[:, None]
    return sum(j * c[..., j] * x ** (j - 1) for j in range(1, c.shape[2]))


def _path(
    nlp: Transcription,
    w: np.ndarray,
    times: np.ndarray,
    blocks: dict[str, np.ndarray],
    p: np.ndarray,
) -> np.ndarray:
    """Excess (N,) of the path constraints, over the larger of their limits."""
    variables, node, count = nlp.variables, nlp.node, len(times)
    names = [name for name, _ in (*variables.states, *variables.algebraic, ("torque", 0))]
    parts = [blocks[name] / variables.units[name] for name in names]
    shared = np.append(w[0], w[nlp.indices.common])
    zeta = np.column_stack([np.tile(shared, (count, 1)), *parts])
    own = np.column_stack([np.tile(p, (count, 1)), times / w[0]])
    values = _path_values(node, zeta, own)
    least, most = node.each_path(np.array([row[1:] for row in nlp.problem.path]).T)
    sizes = np.where(np.isfinite([least, most]), np.abs([least, most]), 0).max(axis=0)
    over = np.maximum(values - most, least - values) / np.where(sizes > 0, sizes, 1.0)
    return over.reshape(nlp.mesh.intervals, -1).max(axis=1)


def _path_values(node: Node, zeta: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Values (n, path) of the path constraints, which no call of the dynamics has a part in."""
    count, function = len(zeta), node.function
    results = [np.zeros((function.size1_in(k), count)) for k in range(2, function.n_in())]
    y = function.map(count)(zeta.T, p.T, *results)
    first = node.rates + node.residuals
    return np.array(y)[first : first + node.path].T
