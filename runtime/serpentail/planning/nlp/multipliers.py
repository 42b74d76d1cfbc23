"""Multipliers of a solved program, carried to another mesh, so that the solver starts warm.

Along the motion they are quadrature weights times functions of time, which are interpolated: the
costate for the defects, other functions for constraints at nodes and for bounds. At the last node
the goal adds parts that do not depend on a weight; these are copied.
"""

import numpy as np

from .transcription import Transcription

Multipliers = tuple[np.ndarray, np.ndarray]  # of the unknowns' bounds, and of the constraints


def carried(multipliers: Multipliers, old: Transcription, new: Transcription) -> Multipliers | None:
    """Return the multipliers of `new`; None for rules other than Radau's.

    Multipliers of the attitude at the end are kept; those of torque rates start at zero.
    """
    if old.rule.steps != len(old.rule.nodes):
        return None
    return _of_unknowns(multipliers[0], old, new), _of_rows(multipliers[1], old, new)


def _of_unknowns(lam: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Return the multipliers of bounds: of the duration, of the start, and of all nodes."""
    carried, before, after = np.zeros(new.indices.size), old.indices, new.indices
    own = np.arange(after.states[0, -1] + 1)  # the duration, what nodes share, and the start
    carried[own] = lam[own]
    carried[after.states[1:]] = _along(lam[before.states[1:]], old, new)
    carried[after.others] = _along(lam[before.others], old, new)
    return carried


def _of_rows(lam: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Return the multipliers of constraints: defects, constraints at nodes, and the rest."""
    node, nodes, steps = old.node, len(old.indices.others), old.rule.steps
    sizes = np.array([nodes * node.rates, nodes * (node.residuals + node.path)])
    defects, held, rest = np.split(lam, np.cumsum(sizes))

    # rows of defects have the width of their interval in them, the costate has not
    before = np.repeat(old.mesh.widths, steps)[:, None]
    after = np.repeat(new.mesh.widths, steps)[:, None]
    costate = defects.reshape(nodes, -1) * before / _weights(old)
    defects = _between(costate, old, new) * _weights(new) / after

    held = _along(held.reshape(nodes, -1), old, new)
    left = new.rows - defects.size - held.size
    start = 0 if new.node.start is None else new.node.start.rows
    if len(rest) != left:
        rest = np.append(np.zeros(left - start), rest[len(rest) - start :])
    return np.concatenate([defects.ravel(), held.ravel(), rest])


def _along(rows: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Return multipliers (N, c) of the nodes by linear interpolation.

    The last node's are copied.
    """
    before, after = _node_times(old), _node_times(new)
    values = rows / _weights(old)
    columns = [np.interp(after, before[:-1], column) for column in values[:-1].T]
    carried = np.reshape(columns, (-1, len(after))).T * _weights(new)
    carried[-1] = rows[-1]
    return carried


def _between(values: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Values (N, c) at the old nodes, at the new ones, by the polynomials of the old intervals."""
    times, mesh, rule = _node_times(new), old.mesh, old.rule
    k = np.clip(np.searchsorted(mesh.ends, times - 1e-12) - 1, 0, mesh.intervals - 1)
    basis = rule.basis((times - mesh.ends[k]) / mesh.widths[k])
    return np.einsum("nj,njc->nc", basis, values.reshape(mesh.intervals, rule.steps, -1)[k])


def _node_times(nlp: Transcription) -> np.ndarray:
    """Times (N,) of the nodes as fractions of the duration."""
    return nlp.fractions[nlp.indices.first :]


def _weights(nlp: Transcription) -> np.ndarray:
    """Weights (N, 1) of the quadrature over the nodes."""
    return np.outer(nlp.mesh.widths, nlp.rule.weights).reshape(-1, 1)
