"""How prescribed joints of a motion move, which its info says."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..basics.attitude import Array

PRESCRIBED = "prescribed"  # in a run's info: their angles, piecewise polynomials of time


def given_at(info: Mapping[str, Any], t: Array) -> tuple[Array, ...]:
    """Return angles (rad), rates and accelerations at t (s), (K, 3, n); nothing without them."""
    if PRESCRIBED not in info:
        return ()
    from scipy.interpolate import PPoly

    times, powers = (np.array(info[PRESCRIBED][name]) for name in ("times", "coefficients"))
    curve = PPoly(np.moveaxis(powers, -1, 0)[::-1], times)
    inside, moving = np.clip(t, times[0], times[-1]), (t >= times[0]) & (t < times[-1])
    rows = [curve(inside, order) * (moving | (order == 0))[:, None] for order in range(3)]
    return (np.stack(rows, axis=1),)
