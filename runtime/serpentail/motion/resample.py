"""Interpolates motions between their samples."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from serpentail_scene.layout import OMEGA, POSITION, QUATERNION, TAIL_Q, TAIL_V, VELOCITY, Layout

from ..basics.attitude import Array, quaternion_rate, sign_continuous


def inside(times: Array, span: Array) -> Array:
    """The times, one-dimensional and inside the span up to rounding."""
    if times.ndim != 1:
        raise ValueError(f"t has shape {times.shape}: give one row of times")
    slack = 4 * np.finfo(float).eps * max(abs(span[0]), abs(span[-1]))
    outside = times[(times < span[0] - slack) | (times > span[-1] + slack)]
    if outside.size:
        raise ValueError(
            f"t = {outside[0]} s is outside the trajectory: give times from {span[0]} to "
            f"{span[-1]} s"
        )
    return np.clip(times, span[0], span[-1])


@dataclass(frozen=True)
class Interpolation:
    """Places of n times among samples: rows before and after; fraction and step between (n, 1)."""

    before: NDArray[np.intp]
    after: NDArray[np.intp]
    fraction: Array
    step: Array

    @classmethod
    def at(cls, times: Array, samples: Array) -> "Interpolation":
        """Locate times inside the span of the samples."""
        last = max(len(samples) - 2, 0)
        before = np.clip(np.searchsorted(samples, times, side="right") - 1, 0, last)
        after = np.minimum(before + 1, len(samples) - 1)
        step = samples[after] - samples[before]
        fraction = (times - samples[before]) / np.where(step > 0, step, 1)
        return cls(before, after, fraction[:, None], step[:, None])

    def linear(self, values: Array) -> Array:
        """Straight lines between the rows of values."""
        return (1 - self.fraction) * values[self.before] + self.fraction * values[self.after]

    def hermite(self, values: Array, rates: Array) -> Array:
        """Cubics that match the rows of values and their rates at both ends."""
        s, h = self.fraction, self.step
        start = (1 - s) ** 2 * ((1 + 2 * s) * values[self.before] + s * h * rates[self.before])
        return start + s**2 * ((3 - 2 * s) * values[self.after] + (s - 1) * h * rates[self.after])


def hermite_q(rows: Interpolation, q: Array, v: Array, layout: Layout) -> Array:
    """Configurations between the samples q with velocities v."""
    if layout.fixed:
        return rows.hermite(q, v)
    attitude = sign_continuous(q[:, QUATERNION])
    turning = np.stack(quaternion_rate(attitude.T, v[:, OMEGA].T), axis=-1)
    positions = np.hstack([q[:, POSITION], attitude, q[:, TAIL_Q]])
    rates = np.hstack([v[:, VELOCITY], turning, v[:, TAIL_V]])
    result = rows.hermite(positions, rates)
    result[:, QUATERNION] /= np.linalg.norm(result[:, QUATERNION], axis=1, keepdims=True)
    return result


def states_between(motion: Any, times: Array) -> tuple[Array, Array]:
    """Configurations and velocities of a trajectory at times inside its span."""
    q = hermite_q(Interpolation.at(times, motion.t), motion.q, motion.v, motion.layout)
    return q, (monotone if motion.contact else smooth)(motion.t, motion.v, times)


def smooth(t: Array, values: Array, times: Array) -> Array:
    """Cubic splines (of fourth order) through the rows of values, which nothing makes jump."""
    from scipy.interpolate import CubicSpline

    if len(t) == 1:
        return np.repeat(values, len(times), axis=0)
    return np.asarray(CubicSpline(t, values, axis=0)(times))


def monotone(t: Array, values: Array, times: Array) -> Array:
    """Shape-preserving cubics (PCHIP) through the rows of values."""
    from scipy.interpolate import PchipInterpolator

    if len(t) == 1:
        return np.repeat(values, len(times), axis=0)
    return np.asarray(PchipInterpolator(t, values, axis=0)(times))
