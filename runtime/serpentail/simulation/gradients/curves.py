"""Gradients by tables of time: from those at single times to those by coefficients and breaks."""

from dataclasses import dataclass

import numpy as np

from ..controllers.piecewise import Piecewise


@dataclass(frozen=True, eq=False)
class CurveGradient:
    """Gradient by a table: by its times (pieces + 1,) and coefficients, shaped like them."""

    times: np.ndarray
    coefficients: np.ndarray

    def along(self, late: Piecewise, early: Piecewise) -> float:
        """Return the change from one table to another."""
        by_times = self.times @ (late.times - early.times)
        return float(
            by_times + (self.coefficients * (late.coefficients - early.coefficients)).sum()
        )


def curve_gradient(
    curve: Piecewise, at: tuple[np.ndarray, np.ndarray], values: np.ndarray, rates: np.ndarray
) -> CurveGradient:
    """Return the gradient by a table.

    at: times (n,), and the ends of the smooth parts that they are in; values, rates (n, channels):
    gradients by values and rates of the table there.
    """
    times, pieces = curve.times, len(curve.times) - 1
    t, early = np.minimum(*at), at[0] >= at[1]
    sides = [np.searchsorted(times, t, side) - 1 for side in ("right", "left")]
    piece = np.clip(np.where(early, sides[1], sides[0]), 0, pieces - 1)
    held = np.where(early, (t <= times[0]) | (t > times[-1]), (t < times[0]) | (t >= times[-1]))
    after = held & (t >= times[-1])
    x = np.clip(t, times[0], times[-1]) - times[piece]

    # powers of x and their derivatives
    orders = np.arange(curve.coefficients.shape[-1])
    powers = x[:, None] ** orders
    first = orders * np.pad(powers, [(0, 0), (1, 0)])[:, :-1]
    second = orders * np.pad(first, [(0, 0), (1, 0)])[:, :-1]
    rates = np.where(held[:, None], 0.0, rates)
    coefficients = np.zeros(curve.coefficients.shape)
    each = values[:, :, None] * powers[:, None, :] + rates[:, :, None] * first[:, None, :]
    np.add.at(coefficients, piece, each)

    # x grows if its piece begins earlier, and at the end if that comes later
    c = curve.coefficients[piece]
    slope = np.einsum("nc,nck,nk->n", values, c, first) + np.einsum(
        "nc,nck,nk->n", rates, c, second
    )
    slope[held & ~after] = 0
    by_times = np.zeros(len(times))
    np.add.at(by_times, piece, -slope)
    by_times[-1] += slope[after].sum()
    return CurveGradient(by_times, coefficients)
