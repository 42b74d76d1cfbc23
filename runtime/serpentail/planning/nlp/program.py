"""What all nonlinear programs have in common, for any solver."""

from typing import Protocol

import numpy as np

from ..problem import PlanningProblem
from .coordinates import Attitude
from .indices import Indices
from .mesh import Mesh
from .node import Variables
from .rules import CollocationRule


class NonlinearProgram(Protocol):
    """A problem on a mesh, and what its unknowns w mean."""

    @property
    def problem(self) -> PlanningProblem:
        """What was asked."""

    @property
    def mesh(self) -> Mesh:
        """Its intervals."""

    @property
    def rule(self) -> CollocationRule:
        """Of collocation."""

    @property
    def attitude(self) -> Attitude:
        """Its coordinates."""

    @property
    def variables(self) -> Variables:
        """Of a node."""

    @property
    def indices(self) -> Indices:
        """Where they are in w."""

    @property
    def rows(self) -> int:
        """Number of multipliers of the constraints."""

    @property
    def fractions(self) -> np.ndarray:
        """Points (P,) as fractions of the duration."""

    def rates(self, w: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Rates (N, nx) of the states at the nodes, in units, times the duration; p: parameters."""
