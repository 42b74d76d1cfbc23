"""Truth: a planned curve goes in; what its torques really do, interval by interval and from end to end, comes out."""

import numpy as np

from ..errors import SimulationError
from ..simulation.controllers import TorqueCurve
from ..simulation.piecewise import Piecewise
from ..simulation.run import end_state
from .attitude import angle_deg
from .curve import Curve

STEP = 1e-4  # s, longest RK4 step


def interval(model, curve: Curve, damping: float, k: int, q, v) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v at the end of interval k, its planned torques applied from the state q, v; nan where they blow up.

    RK4 in C, its torques being the plan's own polynomial.
    """
    width = float(curve.ends[k + 1] - curve.ends[k])
    steps = max(4, int(np.ceil(width / STEP)))
    law = TorqueCurve(planned_torques(curve, k), damping)
    if not np.isfinite(q).all():
        return q, v
    try:
        return end_state(model, q, v, controller=law, duration=width, step=width / steps)
    except SimulationError:  # bent or whirled beyond what the model describes
        return np.full_like(q, np.nan), np.full_like(v, np.nan)


def planned_torques(curve: Curve, k: int) -> Piecewise:
    """Return the torques of interval k, its start being time 0."""
    width = float(curve.ends[k + 1] - curve.ends[k])
    coefficients = curve.nodes["torque"][k].T @ curve.rule.powers()
    return Piecewise(np.array([0.0, width]), (coefficients / width ** np.arange(coefficients.shape[1]))[None])


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
