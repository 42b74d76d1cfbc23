"""The integrand of a plan's objective (Eq. 40), as an expression of a point."""

from typing import TYPE_CHECKING

import numpy as np

from ..problem import PlanningProblem
from .point import PathPoint, asked
from .variables import UNIT_OF_BOUND

if TYPE_CHECKING:
    import casadi as ca


def cost(
    problem: PlanningProblem, point: PathPoint, softening: "ca.SX", torque_unit: np.ndarray
) -> "ca.SX":
    """Return the integrand of Eq. 40 (CasADi), in ``objective_unit``.

    softening: of "energy", W, below which |power| is rounded off; of "time", s that a second with
    all torques at their bounds adds.
    """
    import casadi as ca

    unit, rates = torque_unit.mean(), problem.smoothing**2 * ca.sumsqr(point.tail_rate)
    effort = (ca.sumsqr(point.torque) + rates) / unit**2
    if callable(problem.objective):
        return asked("objective", problem.objective, point, single=True)
    if problem.objective == "energy":
        power = point.torque * point.tail_rate
        return ca.sum1(ca.sqrt(power**2 + softening**2) - softening) / (unit * 10)
    if problem.objective == "time":
        return 1 + softening * UNIT_OF_BOUND**2 / len(torque_unit) * effort
    return effort


def objective_unit(problem: PlanningProblem, torque_unit: np.ndarray) -> float:
    """SI units of the program's objective."""
    unit = float(torque_unit.mean())
    return {"effort": unit**2, "energy": 10 * unit}.get(str(problem.objective), 1.0)
