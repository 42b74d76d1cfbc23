"""Truth: a planned curve goes in; what its torques really do, interval by interval and from end to
end, comes out.
"""

import numpy as np

from ...attitude import angle_deg
from ...errors import SimulationError
from ...simulation.controllers import TorqueCurve
from ...simulation.piecewise import Piecewise
from ...simulation.simulate import end_state
from .curve import Curve

STEP = 1e-4  # s, longest RK4 step


def applied(model, torques: Piecewise, damping: float, q, v) -> tuple[np.ndarray, np.ndarray]:
    """Return q, v at the end of planned torques applied from the state q, v; nan where they blow
    up.

    RK4 in C, its torques being the plan's own polynomials, steps ending where they join.
    """
    duration, step = float(torques.times[-1]), min(STEP, np.diff(torques.times).min() / 4)
    try:
        return end_state(
            model, q, v, controller=TorqueCurve(torques, damping), duration=duration, step=step
        )
    except SimulationError:  # bent or whirled beyond what the model describes
        return np.full_like(q, np.nan), np.full_like(v, np.nan)


def planned_torques(curve: Curve) -> Piecewise:
    """Return the torques of a curve."""
    coefficients = np.swapaxes(curve.nodes["torque"], 1, 2) @ curve.rule.powers()
    widths = np.diff(curve.ends)[:, None, None]
    return Piecewise(curve.ends, coefficients / widths ** np.arange(coefficients.shape[2]))


def open_loop(model, curve: Curve, damping: float, start) -> tuple[np.ndarray, np.ndarray]:
    """Return q (nq,), v (nv,) at the end, the planned torques applied from the start."""
    return applied(model, planned_torques(curve), damping, *start)


def local_errors(model, curve: Curve, damping: float, q, v) -> np.ndarray:
    """Return an error (N,) of every interval: from its planned start to its planned end, q, v (N +
    1, ..) at the ends.

    The largest of the attitude's angle (rad), the tail's angles (rad) and rates (rad/s, weighed by
    the interval).
    """
    errors, torques = np.zeros(len(q) - 1), planned_torques(curve)
    for k, width in enumerate(np.diff(curve.ends)):
        piece = Piecewise(np.array([0.0, width]), torques.coefficients[k : k + 1])
        found_q, found_v = applied(model, piece, damping, q[k], v[k])
        turn = np.radians(angle_deg(found_q[3:7], q[k + 1, 3:7]))
        tail = np.abs(found_q[7:] - q[k + 1, 7:]).max(initial=0)
        rate = np.abs(found_v[3:] - v[k + 1, 3:]).max() * max(width, 0.02)
        errors[k] = max(turn, tail, rate) if np.isfinite(found_q).all() else np.pi
    return errors
