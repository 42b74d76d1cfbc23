"""``Pfl``: torques that make a tail follow a reference, by partial feedback linearisation."""

from __future__ import annotations

from copy import copy
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from serpentail_scene.layout import TORSO_V

from ...basics.checks import number, numbers, refusal
from ...basics.errors import SimulationError
from ...model.checked import checked_model
from ...model.model import Model
from ...model.state import Quantity
from .parts import Parts
from .piecewise import Piecewise, checked_nodes, spline
from .schedules import Reference

KP, KD = 4e4, 400.0  # 1/s^2, 1/s: Table 1
NEEDED = ("inverse_dynamics", "mass_matrix")  # functions of a model without "pfl"


class Pfl:
    """Partial feedback linearisation, Eqs. 44 to 46: a controller for ``simulate``.

    The tail's accelerations become q_t_ddot_r + kd * e_dot + kp * e with the error
    e = q_t_r - q_t. Called with (t, q, v), it returns the torques (2m,) (N m).

    Parameters
    ----------
    model : Model
        The model; a loaded one needs the function "pfl", or "inverse_dynamics" and "mass_matrix".
    reference : Reference, Plan, Trajectory or (array_like, array_like)
        What the tail follows. The last is a pair of times (K,) (s) and tail coordinates (K, 2m)
        (rad). All except a Reference are interpolated by a cubic spline. After its end the last
        value is held, at rest.
    kp : float, default 4e4
        Gain of the error (1/s^2), Table 1.
    kd : float, default 400
        Gain of the error's rate (1/s), Table 1.
    feedforward : bool, default True
        Whether to use q_t_ddot_r, which the paper leaves out.
    torque : float, str or sequence, optional
        Largest torque of the motors (N m, or a text such as "1 mN m"), one number or one for
        each tail coordinate. Default: no limit, also if the reference is a plan with bounds: give
        ``plan.problem.bounds.torque``.

    Raises
    ------
    SimulationError
        An argument is wrong.
    ModelError
        The scene left these functions out.

    Examples
    --------
    >>> motion = st.simulate(model, q0, v0, controller=st.Pfl(model, plan))  # doctest: +SKIP
    """

    def __init__(
        self,
        model: Model,
        reference: Any,
        kp: Quantity = KP,
        kd: Quantity = KD,
        feedforward: bool = True,
        torque: Any = None,
    ):
        self.model = checked_model(model, SimulationError)
        needed = NEEDED[:1] if model.fixed else NEEDED
        if not model.has("pfl"):
            model.need(*needed)
        self.kp = number("Pfl: kp", kp, SimulationError, unit="1/s2", least=0)
        self.kd = number("Pfl: kd", kd, SimulationError, unit="1/s", least=0)
        self.curve = _curve(reference, model.layout.nt)
        self.feedforward = bool(feedforward)
        self.torque = None if torque is None else _limit(torque, model.layout.nt)

    def parts(self, nt: int) -> Parts:
        """Return its parts; it was checked when it was made."""
        return Parts(pfl=self)

    def later(self, delay: float) -> Self:
        """Return the same law for a reference that begins later by ``delay`` (s)."""
        law = copy(self)
        law.curve = self.curve.later(delay)
        return law

    def reference(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Evaluate the reference.

        Parameters
        ----------
        t : float
            Time (s).

        Returns
        -------
        angles, rates, accelerations : ndarray, shape (2m,)
            Tail coordinates (rad), rates (rad/s) and accelerations (rad/s^2); the last are zero
            without feedforward.
        """
        angles, rates, accelerations = self.curve.at(t)
        return angles, rates, accelerations if self.feedforward else 0 * accelerations

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return tau (2m,), N m: X^-1 (S H^-1 C + a), X = S H^-1 [0; I], within the limit.

        On a fixed base it is H a + C.
        """
        angles, rates, accelerations = self.reference(t)
        layout = self.model.layout
        off = angles - q[layout.tail_q], rates - v[layout.tail_v]
        wanted = accelerations + self.kd * off[1] + self.kp * off[0]
        exact = self.model.pfl if "pfl" in self.model.kernels else self._eliminated
        tau = exact(q, v, wanted)
        return tau if self.torque is None else np.clip(tau, -self.torque, self.torque)

    def _eliminated(self, q: np.ndarray, v: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """Compute the same torques from H and C: the base's rows of Eq. 1 give its acceleration."""
        tail = self.model.layout.tail_v
        v_dot = np.concatenate([np.zeros(tail.start), wanted])
        force = self.model.inverse_dynamics(q, v, v_dot)
        if self.model.fixed:
            return force
        H = self.model.mass_matrix(q)
        base = np.linalg.solve(H[TORSO_V, TORSO_V], -force[TORSO_V])
        return force[tail] + H[tail, TORSO_V] @ base


def _limit(torque: Any, size: int) -> np.ndarray:
    """Return the largest torques (2m,)."""
    limit = numbers("Pfl: torque", torque, size, SimulationError, unit="N m")
    if not (limit > 0).all():
        raise refusal("Pfl: torque", torque, "torques above 0, in N m", SimulationError)
    return limit


def _curve(reference: object, size: int) -> Piecewise:
    """Return the reference that the user gave as a function of time."""
    if isinstance(reference, Reference):
        if reference.curve.channels != size:
            raise SimulationError(
                f"Pfl: the reference has {reference.curve.channels} angles, the tail {size}"
            )
        return reference.curve
    times, angles, ends = _nodes(reference)
    times, angles = checked_nodes("Pfl", "angles", (times, angles), size)
    if len(times) < 2:
        raise SimulationError("Pfl: one node only: give two or more")
    return spline(times, angles, ends)


def _nodes(reference: Any) -> tuple[ArrayLike, ArrayLike, object]:
    """Return times, angles and the end conditions of a spline through them."""
    motion = getattr(reference, "trajectory", reference)
    if hasattr(motion, "tail") and hasattr(motion, "t"):
        if motion is reference:
            return motion.t, motion.tail, tuple((1, motion.tail_rate[k]) for k in (0, -1))
        # a plan: its own accelerations at the ends, because a spline's are least exact there
        slopes = reference.curve.slopes(motion.t[[0, -1]])["tail_rate"]
        return motion.t, motion.tail, tuple((2, row) for row in slopes)
    try:
        times, angles = reference
    except (TypeError, ValueError):
        needs = "a Plan, a Trajectory, a Reference, or (times, tail coordinates)"
        raise SimulationError(
            f"Pfl: reference is a {type(reference).__name__}: give {needs}"
        ) from None
    return times, angles, "not-a-knot"
