"""``Solution``: what a solver found."""

from dataclasses import dataclass, field

import numpy as np

from ..basics.short_repr import brief
from .samples import MeshSamples


@dataclass(frozen=True, eq=False)
class Solution:
    """What a solver found: a motion, whether the solver calls it solved, and the cost.

    value: of the objective, in the program's units. slopes (c,): of the least objective by the
    limits of the constants, from their multipliers; empty if the solver has none.
    """

    samples: MeshSamples
    value: float
    success: bool
    status: str
    iterations: int
    cpu_s: float
    solver: str
    slopes: np.ndarray = field(default_factory=lambda: np.zeros(0))
    __repr__ = brief
