"""Fastest decay by a tail's damping, which can make a flight stiff."""

import numpy as np

from ..basics.errors import StateError
from ..model.kernel import RunKernel
from ..model.parameters import RunParameters, Values
from .acting import Acting


class FastestDecay:
    """The fastest decay (1/s) of tails at starts q0 (runs, nq).

    It is the largest eigenvalue of K (H^-1)_tt with the joint damping K; with springs, that of both
    together whose real part is least. Oscillations do not count, however fast: whoever wants their
    motion needs steps that resolve them. For one thread.
    """

    def __init__(self, acting: Acting, runs: int, parameters: RunParameters):
        model, nt = acting.model, acting.model.layout.nt
        parts = [parts for each in acting.distinct for parts in each.parts]
        laws = [each.damping for each in parts if each.damping is not None]
        acted = np.max(laws, axis=0) if laws else np.zeros(nt)
        # tracking compensates the passive tail's own torques
        tracked = bool(parts) and all(each.pfl is not None for each in parts)
        values = {} if tracked else parameters.values
        self.damping = acted + own(values, "tail_damping", (runs, nt))
        self.stiffness = own(values, "tail_stiffness", (runs, nt))
        self.sprung = bool(self.stiffness.any())
        self.damped = bool(self.damping.any()) and "forward_dynamics" in model.generated
        if not self.damped:
            return
        # without torque and with unit torques: the differences are columns of H^-1
        kernel, self.tail = model.kernel("forward_dynamics"), model.layout.tail_v
        self.runs, self.columns = runs, nt + 1
        torques = np.eye(self.columns, nt, -1, kernel.dtype)
        tau = np.tile(torques, (runs, 1, 1))
        sizes = model.nq, model.nv, model.nv
        self.q, v, self.v_dot = (
            np.zeros((runs, self.columns, size), kernel.dtype) for size in sizes
        )
        self.evaluate = RunKernel(kernel, parameters.vectors, (self.q, v, tau), (self.v_dot,))

    def __call__(self, q0: np.ndarray) -> float:
        """Return it; 0 without damping, or if no start has accelerations."""
        if not self.damped:
            return 0.0
        self.q[...] = q0[:, None]
        sound = [k for k in range(self.runs) if self._evaluated(k)]
        tail = self.v_dot[sound, :, self.tail].astype(float)
        mobility = tail[:, 1:] - tail[:, :1]
        if self.sprung:
            return fastest(mobility, self.stiffness[sound], self.damping[sound])
        root = np.sqrt(self.damping[sound])
        columns = mobility * root[:, :, None] * root[:, None, :]
        return float(np.linalg.eigvalsh(columns).max(initial=0.0))

    def _evaluated(self, k: int) -> bool:
        """Evaluate the rows of run k; tell whether that succeeded."""
        try:
            self.evaluate(k, self.columns)
        except StateError:
            return False
        return True


def own(values: Values, name: str, shape: tuple[int, int]) -> np.ndarray:
    """Return a parameter of the passive tail in each run (runs, 2m); zeros without one."""
    return np.broadcast_to(np.asarray(values.get(name, 0.0), float), shape)


def fastest(mobility: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> float:
    """Return the fastest decay (1/s) of q_ddot = -mobility (stiffness q + damping q_dot), mobility
    (runs, n, n).
    """
    n = mobility.shape[-1]
    rates = np.zeros((len(mobility), 2 * n, 2 * n))
    rates[:, :n, n:] = np.eye(n)
    rates[:, n:, :n] = -mobility * stiffness[:, None, :]
    rates[:, n:, n:] = -mobility * damping[:, None, :]
    return float(-np.linalg.eigvals(rates).real.min(initial=0.0))
