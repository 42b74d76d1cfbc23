"""One round of a search for a plan: a solved program, and how true its solution is."""

from dataclasses import dataclass

import numpy as np

from ..model.model import Model
from ..optimal.solution import Solution
from .flight import State
from .problem import PlanningProblem
from .program.build import PlanProgram
from .result.curve import Curve
from .result.excess import Excess


@dataclass(frozen=True, eq=False)
class Round:
    """One solution on one mesh: q, v planned at the ends of intervals, and true at the last end.

    model, problem: with the parameters and the start of the solution.
    errors: true errors there, as of ``end_errors``; excess: over bounds, by intervals.
    softening: of the objective.
    """

    model: Model
    problem: PlanningProblem
    program: PlanProgram
    solution: Solution
    curve: Curve
    planned: tuple[np.ndarray, np.ndarray]
    true: tuple[np.ndarray, np.ndarray]
    errors: dict[str, float]
    excess: Excess
    softening: float

    @property
    def start(self) -> State:
        """The start."""
        return self.problem.q0, self.problem.v0

    def __str__(self) -> str:
        return f"{self.program.mesh.intervals} intervals, {self.errors['attitude']:.2g} deg off"
