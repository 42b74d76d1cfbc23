"""Multipliers: those of a solved program go in; those of the same problem on another mesh come out.

Along the motion they are weights of the quadrature times functions of time, which are carried from
mesh to mesh: the
costate for the defects, others for what holds at every node and for bounds.  What the goal fixes
adds to those of the
last node what no weight has a part in: these are taken as they are.
"""

import numpy as np

from .transcription import Transcription


def carried(multipliers: tuple[np.ndarray, np.ndarray], old: Transcription, new: Transcription):
    """Return multipliers of the unknowns and of the constraints of `new`; None for other rules than
    Radau's.

    Those of the attitude at the end stay; those of torque rates begin at zero.
    """
    if old.rule.steps != len(old.rule.nodes):
        return None
    return _of_unknowns(multipliers[0], old, new), _of_rows(multipliers[1], old, new)


def _of_unknowns(lam: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Those of bounds: of the duration, of the start, and of all nodes."""
    found, one, other = np.zeros(new.places.size), old.places, new.places
    found[0], found[other.states[0]] = lam[0], lam[one.states[0]]
    found[other.states[1:]] = _along(lam[one.states[1:]], old, new)
    found[other.others] = _along(lam[one.others], old, new)
    return found


def _of_rows(lam: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Those of defects, whose rows have the width of their interval in them, of what holds at
    nodes, and the rest.
    """
    node, count, K = old.node, len(old.places.others), old.rule.steps
    defects, held, rest = np.split(
        lam, np.cumsum([count * node.rates, count * (node.residuals + node.path)])
    )
    costate = defects.reshape(count, -1) * np.repeat(old.mesh.widths, K)[:, None] / _weights(old)
    defects = _between(costate, old, new) * _weights(new) / np.repeat(new.mesh.widths, K)[:, None]
    held = _along(held.reshape(count, -1), old, new)
    left = new.rows - defects.size - held.size
    return np.concatenate(
        [defects.ravel(), held.ravel(), rest if len(rest) == left else np.zeros(left)]
    )


def _along(rows: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Multipliers (N, c) of the nodes, as functions that are straight between them; those of the
    last one stay.
    """
    values, (times, other) = (
        rows / _weights(old),
        (p.fractions[p.places.first :] for p in (old, new)),
    )
    columns = [np.interp(other, times[:-1], column) for column in values[:-1].T]
    found = np.reshape(columns, (-1, len(other))).T * _weights(new)
    found[-1] = rows[-1]
    return found


def _between(values: np.ndarray, old: Transcription, new: Transcription) -> np.ndarray:
    """Values (N, c) at the old nodes, at the new ones, by the polynomials of the old intervals."""
    times, mesh, rule = new.fractions[new.places.first :], old.mesh, old.rule
    k = np.clip(np.searchsorted(mesh.ends, times - 1e-12) - 1, 0, mesh.intervals - 1)
    basis = rule.basis((times - mesh.ends[k]) / mesh.widths[k])
    return np.einsum("nj,njc->nc", basis, values.reshape(mesh.intervals, rule.steps, -1)[k])


def _weights(program: Transcription) -> np.ndarray:
    """Weights (N, 1) of the quadrature over the nodes."""
    return np.outer(program.mesh.widths, program.rule.weights).reshape(-1, 1)
