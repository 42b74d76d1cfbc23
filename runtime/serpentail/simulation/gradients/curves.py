"""Gradients by tables of time: from those at single times to those by coefficients and breaks."""

from dataclasses import dataclass

import numpy as np

from ..controllers.piecewise import Piecewise


@dataclass(frozen=True, eq=False)
class CurveGradient:
    """Gradient by a table, or its change: times (pieces + 1,) and coefficients, shaped like its."""

    times: np.ndarray
    coefficients: np.ndarray


@dataclass(frozen=True, eq=False)
class _Places:
    """Where times (n,) lie in a table: piece (n,), whether the table is at rest there, whether that
    is after its end, and the powers of the time in the piece (n, orders) with two derivatives.
    """

    piece: np.ndarray
    held: np.ndarray
    after: np.ndarray
    powers: np.ndarray
    first: np.ndarray
    second: np.ndarray


def _places(curve: Piecewise, at: tuple[np.ndarray, np.ndarray]) -> _Places:
    """Return where times are; at: times (n,), and the ends of the smooth parts they are in."""
    times, pieces = curve.times, len(curve.times) - 1
    t, early = np.minimum(*at), at[0] >= at[1]
    sides = [np.searchsorted(times, t, side) - 1 for side in ("right", "left")]
    piece = np.clip(np.where(early, sides[1], sides[0]), 0, pieces - 1)
    held = np.where(early, (t <= times[0]) | (t > times[-1]), (t < times[0]) | (t >= times[-1]))
    x = np.clip(t, times[0], times[-1]) - times[piece]
    orders = np.arange(curve.coefficients.shape[-1])
    powers, less = x[:, None] ** orders, np.maximum(orders - [[1], [2]], 0)
    first = orders * x[:, None] ** less[0]
    second = orders * (orders - 1) * x[:, None] ** less[1]
    return _Places(piece, held, held & (t >= times[-1]), powers, first, second)


def curve_gradient(
    curve: Piecewise, at: tuple[np.ndarray, np.ndarray], values: np.ndarray, rates: np.ndarray
) -> CurveGradient:
    """Return the gradient by a table.

    at: times (n,), and the ends of the smooth parts that they are in; values, rates (n, channels):
    gradients by values and rates of the table there.
    """
    p = _places(curve, at)
    rates = np.where(p.held[:, None], 0.0, rates)
    each = values[:, :, None] * p.powers[:, None, :] + rates[:, :, None] * p.first[:, None, :]
    coefficients = _sums(p.piece, each, len(curve.coefficients))

    # x grows if its piece begins earlier, and at the end if that comes later
    c = curve.coefficients[p.piece]
    slope = np.einsum("nc,nck,nk->n", values, c, p.first)
    slope += np.einsum("nc,nck,nk->n", rates, c, p.second)
    slope[p.held & ~p.after] = 0
    by_times = np.append(_sums(p.piece, -slope, len(curve.coefficients)), 0.0)
    by_times[-1] += slope[p.after].sum()
    return CurveGradient(by_times, coefficients)


def _sums(piece: np.ndarray, rows: np.ndarray, pieces: int) -> np.ndarray:
    """Return the sum (pieces, ...) of the rows (n, ...) of each piece."""
    flat = rows.reshape(len(rows), -1)
    places = flat.shape[1] * piece[:, None] + np.arange(flat.shape[1])
    sums = np.bincount(places.ravel(), flat.ravel(), pieces * flat.shape[1])
    return sums.reshape(pieces, *rows.shape[1:])


def curve_change(
    curve: Piecewise, at: tuple[np.ndarray, np.ndarray], change: CurveGradient
) -> tuple[np.ndarray, np.ndarray]:
    """Return the changes of values and rates (n, channels) of a table for one of its times and
    coefficients: the transpose of ``curve_gradient``.
    """
    p = _places(curve, at)
    c, moved = curve.coefficients[p.piece], change.coefficients[p.piece]
    later = np.where(p.after, change.times[-1], 0.0) - change.times[p.piece]
    later[p.held & ~p.after] = 0
    values = np.einsum("nck,nk->nc", moved, p.powers)
    values += np.einsum("nck,nk->nc", c, p.first) * later[:, None]
    rates = np.einsum("nck,nk->nc", moved, p.first)
    rates += np.einsum("nck,nk->nc", c, p.second) * later[:, None]
    rates[p.held] = 0
    return values, rates
