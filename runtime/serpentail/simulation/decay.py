"""How fast joint damping lets a tail decay: what makes a flight stiff."""

import numpy as np

from ..errors import StateError
from ..model.kernel import RunKernel
from ..model.layout import TAIL_V
from ..model.parameters import RunParameters
from .acting import Acting


class FastestDecay:
    """The largest eigenvalue (1/s) of K (H^-1)_tt at starts q0 (runs, nq), K being joint damping.

    For one thread.
    """

    def __init__(self, acting: Acting, runs: int, parameters: RunParameters):
        model, nt = acting.model, acting.model.layout.nt
        parts = [parts for each in acting.distinct for parts in each.parts]
        laws = [each.damping for each in parts if each.damping is not None]
        damping = np.max(laws, axis=0) if laws else np.zeros(nt)
        self.damped, self.scale = bool(damping.any()), np.sqrt(np.outer(damping, damping))
        if not self.damped:
            return
        # without torque and with unit torques: the differences are columns of H^-1
        kernel = model.kernel("forward_dynamics")
        self.runs, self.columns = runs, nt + 1
        torques = np.eye(self.columns, nt, -1, kernel.dtype)
        tau = np.tile(torques, (runs, 1, 1))
        sizes = model.nq, model.nv, model.nv
        self.q, v, self.v_dot = (
            np.zeros((runs, self.columns, size), kernel.dtype) for size in sizes
        )
        self.evaluate = RunKernel(kernel, parameters.vectors, (self.q, v, tau), (self.v_dot,))

    def __call__(self, q0: np.ndarray) -> float:
        """Return it; 0 without damping, or where no start has accelerations."""
        if not self.damped:
            return 0.0
        self.q[...] = q0[:, None]
        sound = [k for k in range(self.runs) if self._evaluated(k)]
        tail = self.v_dot[sound, :, TAIL_V]
        columns = (tail[:, 1:] - tail[:, :1]) * self.scale
        return float(np.linalg.eigvalsh(columns).max(initial=0.0))

    def _evaluated(self, k: int) -> bool:
        """Evaluate the rows of run k; tell whether it could be done."""
        try:
            self.evaluate(k, self.columns)
        except StateError:
            return False
        return True
