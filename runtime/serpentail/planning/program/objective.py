"""The integrand of a plan's objective (Eq. 40), as an expression of a point."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..problem import PlanningProblem
from .point import PathPoint, asked
from .variables import UNIT_OF_BOUND, input_in

if TYPE_CHECKING:
    import casadi as ca


def cost(
    problem: PlanningProblem, point: PathPoint, softening: "ca.SX", units: Mapping[str, np.ndarray]
) -> "ca.SX":
    """Return the integrand of Eq. 40 (CasADi), in ``objective_unit``.

    softening: of "energy", W, below which |power| is rounded off; of "time", s that a second with
    all torques or tensions at their bounds adds. units: of torques, and of tensions if there are
    any.
    """
    import casadi as ca

    unit, rates = units["torque"].mean(), problem.smoothing**2 * ca.sumsqr(point.tail_rate)
    name = input_in(units)
    effort = ca.sumsqr(getattr(point, name)) / units[name].mean() ** 2 + rates / unit**2
    if callable(problem.objective):
        return asked("objective", problem.objective, point, single=True)
    if problem.objective == "energy":
        power = point.torque * point.tail_rate
        return ca.sum1(ca.sqrt(power**2 + softening**2) - softening) / (unit * 10)
    if problem.objective == "time":
        return 1 + softening * UNIT_OF_BOUND**2 / len(units[name]) * effort
    return effort


def objective_unit(problem: PlanningProblem, units: Mapping[str, np.ndarray]) -> float:
    """SI units of the program's objective."""
    drive, unit = (float(units[name].mean()) for name in (input_in(units), "torque"))
    return {"effort": drive**2, "energy": 10 * unit}.get(str(problem.objective), 1.0)
