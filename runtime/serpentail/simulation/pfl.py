"""Tracking: a model and a reference motion of its tail go in; a torque law for simulations comes
out.
"""

from typing import TYPE_CHECKING

import numpy as np

from ..checks import number
from ..errors import SimulationError
from ..model.layout import TAIL_Q, TAIL_V, TORSO_NV, TORSO_V
from .piecewise import Piecewise, checked_nodes, spline
from .schedules import Reference

if TYPE_CHECKING:
    from ..model.model import Model
KP, KD = 4e4, 400.0  # 1/s^2, 1/s: Table 1


class Pfl:
    """Partial feedback linearisation, Eq. 46: tail accelerations become q_t_ddot_r + Kd e_dot + Kp
    e, e = q_t_r - q_t.

    reference: a Reference, a Plan, a Trajectory, or (times (K,) s, tail coordinates (K, 2m) rad);
    of the last three a
    cubic spline; after it the last value at rest.  kp (1/s^2), kd (1/s): gains, one number each.
    feedforward: use
    q_t_ddot_r, which the paper leaves out.
    Called with (t, q, v) it returns tau (2m,) in N m: a controller for ``st.simulate``.  Needs pfl
    of the model, or its
    inverse_dynamics and mass_matrix.  Raises SimulationError where an argument is wrong.
    """

    def __init__(
        self, model: "Model", reference, kp: float = KP, kd: float = KD, feedforward: bool = True
    ):
        self.model = model
        self.kp = number("Pfl: kp", kp, SimulationError, least=0)
        self.kd = number("Pfl: kd", kd, SimulationError, least=0)
        self.curve = _curve(reference, model.layout.nt)
        self.feedforward = bool(feedforward)

    def reference(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return tail coordinates, rates and accelerations (2m,) wanted at t (s)."""
        angles, rates, accelerations = self.curve.at(t)
        return angles, rates, accelerations if self.feedforward else 0 * accelerations

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return tau (2m,), N m: X^-1 (S H^-1 C + a), X = S H^-1 [0; I]."""
        angles, rates, accelerations = self.reference(t)
        wanted = accelerations + self.kd * (rates - v[TAIL_V]) + self.kp * (angles - q[TAIL_Q])
        return (
            self.model.pfl(q, v, wanted)
            if "pfl" in self.model.kernels
            else self._eliminated(q, v, wanted)
        )

    def _eliminated(self, q: np.ndarray, v: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """The same of H and C: the base's accelerations solve its rows of Eq. 1, inverse dynamics
        has the torques.
        """
        v_dot = np.concatenate([np.zeros(TORSO_NV), wanted])
        H, force = self.model.mass_matrix(q), self.model.inverse_dynamics(q, v, v_dot)
        base = np.linalg.solve(H[TORSO_V, TORSO_V], -force[TORSO_V])
        return force[TAIL_V] + H[TAIL_V, TORSO_V] @ base


def _curve(reference, size: int) -> Piecewise:
    """Return what the user gave as a function of time; splines end by a plan's accelerations or a
    motion's rates.
    """
    if isinstance(reference, Reference):
        if reference.curve.channels != size:
            raise SimulationError(
                f"Pfl: the reference has {reference.curve.channels} angles, the tail {size}"
            )
        return reference.curve
    motion = getattr(reference, "trajectory", reference)
    if hasattr(motion, "tail") and hasattr(motion, "t"):
        times, angles, ends = (
            motion.t,
            motion.tail,
            tuple((1, motion.v[k, TAIL_V]) for k in (0, -1)),
        )
        if (
            motion is not reference
        ):  # a plan: else its second derivative, fed forward, is least exact at the ends
            ends = tuple((2, row) for row in reference.curve.slopes(times[[0, -1]])["tail_rate"])
    else:
        try:
            (times, angles), ends = reference, "not-a-knot"
        except (TypeError, ValueError):
            what = "a Plan, a Trajectory, a Reference, or (times, tail coordinates)"
            raise SimulationError(
                f"Pfl: reference is a {type(reference).__name__}: give {what}"
            ) from None
    times, angles = checked_nodes("Pfl", "angles", (times, angles), size)
    if len(times) < 2:
        raise SimulationError("Pfl: one node only: give two or more")
    return spline(times, angles, ends)
