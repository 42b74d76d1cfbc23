"""Softening of objectives that are seldom solved exactly from a distant guess."""

import numpy as np

from serpentail_scene.layout import TAIL_V

from ..motion.trajectory import Trajectory
from .problem import PlanningProblem
from .result.plan import Plan

# Softening of an objective, see ``program.objective.cost``, in the first rounds; the last value
# holds in all others.
# The exact ones are seldom solved from a distant guess. "energy": in mean powers of the guess.
SOFTENING = {"energy": (3.0, 0.3, 0.03), "time": (1.0, 0.3)}
USUAL_POWER = 0.01  # W, of a guess without torques


def softening_of(problem: PlanningProblem, guess: object) -> tuple[float, ...]:
    """Return the softening of the objective in the first rounds; the last one is kept."""
    steps = SOFTENING.get(str(problem.objective), (0.0,))
    if problem.objective == "energy":
        power = _mean_power(guess)
        steps = tuple(power * step for step in steps)
    known = isinstance(guess, Plan) and guess.problem.objective == problem.objective
    return steps[-1:] if known else steps


def _mean_power(guess: object) -> float:
    """Return the mean of sum |tau q_t_dot| (W) in a guess."""
    motion = getattr(guess, "trajectory", guess)
    if not isinstance(motion, Trajectory):
        return USUAL_POWER
    power = np.abs(motion.tau * motion.v[:, TAIL_V]).sum(axis=1)
    return float(np.trapezoid(power, motion.t) / np.ptp(motion.t)) or USUAL_POWER
