"""What a plan's torques really do when they are applied to the model, in small steps.

From end to end this is the plan's error; by intervals it tells where the mesh is too coarse.
"""

import numpy as np

from ...attitude import angle_deg
from ...errors import SimulationError
from ...model.layout import OMEGA, QUATERNION, TAIL_Q
from ...model.model import Model
from ...simulation.controllers import TorqueCurve
from ...simulation.piecewise import Piecewise
from ...simulation.simulate import end_state
from .curve import Curve

LONGEST_STEP = 1e-4  # s, of RK4
SHORT_INTERVAL = 0.02  # s: rates of shorter ones are weighed as if they were as long


def applied(
    model: Model, torques: Piecewise, damping: float, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v after planned torques were applied from the state q, v; nan where they blow up.

    RK4 in C, its torques being the plan's own polynomials, steps ending where they join.
    """
    duration = float(torques.times[-1])
    step = min(LONGEST_STEP, np.diff(torques.times).min() / 4)
    law = TorqueCurve(torques, damping)
    try:
        return end_state(model, q, v, controller=law, duration=duration, step=step)
    except SimulationError:  # bent or whirled beyond what the model describes
        return np.full_like(q, np.nan), np.full_like(v, np.nan)


def planned_torques(curve: Curve) -> Piecewise:
    """Return the torques of a curve."""
    coefficients = np.swapaxes(curve.nodes["torque"], 1, 2) @ curve.rule.powers()
    widths = np.diff(curve.ends)[:, None, None]
    return Piecewise(curve.ends, coefficients / widths ** np.arange(coefficients.shape[2]))


def open_loop(
    model: Model, curve: Curve, damping: float, start: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) at the end, the planned torques applied from the start."""
    return applied(model, planned_torques(curve), damping, *start)


def local_errors(
    model: Model, curve: Curve, damping: float, q: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """Return an error (N,) of every interval: from its planned start to its planned end.

    q, v (N + 1, ..): planned, at the ends.  An error is the largest of the attitude's angle (rad),
    the tail's angles (rad) and rates (rad/s, weighed by the interval).
    """
    errors, torques, rates = np.zeros(len(q) - 1), planned_torques(curve), slice(OMEGA.start, None)
    for k, width in enumerate(np.diff(curve.ends)):
        piece = Piecewise(np.array([0.0, width]), torques.coefficients[k : k + 1])
        true_q, true_v = applied(model, piece, damping, q[k], v[k])
        if not np.isfinite(true_q).all():
            errors[k] = np.pi
            continue
        angle = np.radians(angle_deg(true_q[QUATERNION], q[k + 1, QUATERNION]))
        tail = np.abs(true_q[TAIL_Q] - q[k + 1, TAIL_Q]).max(initial=0)
        rate = np.abs(true_v[rates] - v[k + 1, rates]).max() * max(width, SHORT_INTERVAL)
        errors[k] = max(angle, tail, rate)
    return errors
