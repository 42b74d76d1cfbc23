"""How prescribed joints of a motion move and its tendons pull, which its info says."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..basics.attitude import Array

PRESCRIBED = "prescribed"  # in a run's info: their angles, piecewise polynomials of time
# in a run's info: one such of tensions for each phase, and when it begins; none where none act
TENSIONS = "tensions"
LOADS = "loads"  # forces from outside, as the C of a model reads them


def given_at(info: Mapping[str, Any], t: Array) -> tuple[Array, ...]:
    """Return angles (rad), rates and accelerations at t (s), (K, 3, n); nothing without them."""
    return (_at(info[PRESCRIBED], t),) if PRESCRIBED in info else ()


def tensions_at(info: Mapping[str, Any], t: Array) -> Array | None:
    """Return the tensions (K, tendons), N, at t (s); None if none act."""
    phases = info.get(TENSIONS, ())
    widths = [len(phase["coefficients"][0]) for phase in phases if "times" in phase]
    if not widths:
        return None
    found = np.zeros((len(t), widths[0]))
    for phase in phases:
        since = t >= (phase["begin"] if phase is not phases[0] else -np.inf)
        found[since] = _at(phase, t[since])[:, 0] if "times" in phase else 0.0
    return found


def _at(curve: Mapping[str, Any], t: Array) -> Array:
    """Return values, rates and accelerations (K, 3, n) of piecewise polynomials, held outside."""
    from scipy.interpolate import PPoly

    times, powers = (np.array(curve[name]) for name in ("times", "coefficients"))
    spline = PPoly(np.moveaxis(powers, -1, 0)[::-1], times)
    inside, moving = np.clip(t, times[0], times[-1]), (t >= times[0]) & (t < times[-1])
    rows = [spline(inside, order) * (moving | (order == 0))[:, None] for order in range(3)]
    return np.stack(rows, axis=1)
