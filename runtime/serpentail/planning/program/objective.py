"""The integrand of a plan's objective (Eq. 40), as an expression of a point."""

from typing import TYPE_CHECKING

from ..problem import PlanningProblem
from .point import PathPoint, asked
from .variables import UNIT_OF_BOUND, PlanVariables

if TYPE_CHECKING:
    import casadi as ca


def cost(
    problem: PlanningProblem, point: PathPoint, softening: "ca.SX", variables: PlanVariables
) -> "ca.SX":
    """Return the integrand of Eq. 40 (CasADi), in ``objective_unit``.

    softening: of "energy", W, below which |power| is rounded off; of "time", s that a second with
    all torques or tensions at their bounds adds.
    """
    import casadi as ca

    own, unit = variables.units[variables.input], variables.units["torque"].mean()
    rates = problem.smoothing**2 * ca.sumsqr(point.tail_rate)
    effort = ca.sumsqr(getattr(point, variables.input)) / own.mean() ** 2 + rates / unit**2
    if callable(problem.objective):
        return asked("objective", problem.objective, point, single=True)
    if problem.objective == "energy":
        power = point.torque * point.tail_rate
        return ca.sum1(ca.sqrt(power**2 + softening**2) - softening) / (unit * 10)
    if problem.objective == "time":
        return 1 + softening * UNIT_OF_BOUND**2 / len(own) * effort
    return effort


def objective_unit(problem: PlanningProblem, variables: PlanVariables) -> float:
    """SI units of the program's objective."""
    drive, unit = (float(variables.units[n].mean()) for n in (variables.input, "torque"))
    return {"effort": drive**2, "energy": 10 * unit}.get(str(problem.objective), 1.0)
