"""What one call of `model.step` moves: arrays of runs, whose torques stay while it lasts."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Held:
    """Runs of one call; arrays are of the model's reals.

    q (k, nq), v (k, nv) and, on the ground, bristles (k, 2K) are stepped in place; tau (k, 2m) in
    N m.  legs (k, 4, 2): angles (rad) and rates (rad/s), where there are feet.  parameters (k,
    scalars).  Rows of tau and legs may all be the same one.  steps: how many, of h (s) each.
    """

    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    bristles: np.ndarray | None
    legs: np.ndarray | None
    parameters: np.ndarray
    h: float
    steps: int
    method: str
    statuses: np.ndarray

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.q)
