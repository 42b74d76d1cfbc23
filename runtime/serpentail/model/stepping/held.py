"""The arrays of one call of `model.step`."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Held:
    """Runs of one call; arrays have the model's number type.

    q (k, nq), v (k, nv) and, on the ground, bristles (k, 2K) are advanced in place; tau (k, 2m) in
    N m is constant. legs (k, 4, 2): angles (rad) and rates (rad/s), with feet only. parameters (k,
    scalars). All rows of tau and legs may be the same. steps: their number; h: their length (s).
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
