"""Truth: a planned curve goes in; what its torques really do, interval by interval and from end to end, comes out."""

from functools import lru_cache

import numpy as np

from ..errors import SimulationError
from ..simulation import TorqueTable, end_state
from .attitude import angle_deg
from .curve import Curve
from .rules import Rule

STEP = 1e-4  # s, longest RK4 step


def interval(model, curve: Curve, damping: float, k: int, q, v) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v at the end of interval k, its planned torques applied from the state q, v; nan where they blow up.

    RK4 in C: the table has the torques at all times that RK4 asks for, so its straight lines add no error.
    """
    width = float(curve.ends[k + 1] - curve.ends[k])
    steps = max(4, int(np.ceil(width / STEP)))
    s, basis = _halves(curve.rule, steps)
    law = TorqueTable(s * width, basis @ curve.nodes["torque"][k], damping)
    if not np.isfinite(q).all():
        return q, v
    try:
        return end_state(model, q, v, controller=law, duration=width, step=width / steps)
    except SimulationError:  # bent or whirled beyond what the model describes
        return np.full_like(q, np.nan), np.full_like(v, np.nan)


@lru_cache(maxsize=64)
def _halves(rule: Rule, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Fractions (2 steps + 1,) of an interval at which RK4 asks for torques, and the nodes' polynomials there."""
    s = np.linspace(0.0, 1.0, 2 * steps + 1)
    return s, rule.basis(s)


def open_loop(model, curve: Curve, damping: float, start) -> tuple[np.ndarray, np.ndarray]:
    """Return q (N + 1, nq), v (N + 1, nv) at the ends of intervals, the planned torques applied from the start."""
    states = [start]
    for k in range(len(curve.ends) - 1):
        states.append(interval(model, curve, damping, k, *states[-1]))
    return tuple(np.array(rows) for rows in zip(*states, strict=True))


def local_errors(model, curve: Curve, damping: float, q, v) -> np.ndarray:
    """Return an error (N,) of every interval: from its planned start to its planned end, q, v (N + 1, ..) at the ends.

    The largest of the attitude's angle (rad), the tail's angles (rad) and rates (rad/s, weighed by the interval).
    """
    errors = np.zeros(len(q) - 1)
    for k, width in enumerate(np.diff(curve.ends)):
        found_q, found_v = interval(model, curve, damping, k, q[k], v[k])
        turn = np.radians(angle_deg(found_q[3:7], q[k + 1, 3:7]))
        tail = np.abs(found_q[7:] - q[k + 1, 7:]).max(initial=0)
        rate = np.abs(found_v[3:] - v[k + 1, 3:]).max() * max(width, 0.02)
        errors[k] = max(turn, tail, rate) if np.isfinite(found_q).all() else np.pi
    return errors
