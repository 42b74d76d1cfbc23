"""``MeshSamples``: a motion at the nodes of a mesh, where solvers begin and what they find."""

from dataclasses import dataclass

import numpy as np

from .problem import OptimalProblem


@dataclass(frozen=True, eq=False)
class MeshSamples:
    """A motion in the units of a program.

    states (I K + 1, nx): at the start and at all nodes; controls (I, K, nu): at the nodes;
    constants (c,), the last of which is the duration (s).
    """

    states: np.ndarray
    controls: np.ndarray
    constants: np.ndarray

    @property
    def duration(self) -> float:
        """Duration (s)."""
        return float(self.constants[-1])

    @property
    def is_motion(self) -> bool:
        """Whether all numbers are finite, and the motion takes time."""
        parts = (self.states, self.controls, self.constants)
        return all(np.isfinite(part).all() for part in parts) and self.duration > 0


def nodes_of(problem: OptimalProblem, samples: MeshSamples) -> np.ndarray:
    """Return a copy of the states (I, K, nx) at the nodes, where collocation begins in C."""
    return samples.states[1:].reshape(problem.mesh.intervals, len(problem.rule.nodes), -1).copy()


def packed(problem: OptimalProblem, samples: MeshSamples) -> np.ndarray:
    """Return the variables of all stages, in a row.

    The controls' coefficients are those whose polynomials come nearest to the samples', put inside
    their bounds.
    """
    cut, K = problem.cut, len(problem.rule.nodes)
    constants = samples.constants[: problem.free]
    least, most = problem.control_limits
    parts: list[np.ndarray] = []
    for k, (a, b) in enumerate(zip(cut.first[:-1], cut.first[1:], strict=True)):
        basis = cut.basis[a:b].reshape(-1, problem.coefficients)
        own = samples.controls[a:b].reshape(len(basis), -1)
        controls = np.clip(np.linalg.lstsq(basis, own, rcond=None)[0], least, most)
        has_x = k > 0 or problem.start is None
        parts += [controls.ravel(), samples.states[a * K] if has_x else constants[:0], constants]
    goal = 0 if problem.at_end is None else problem.at_end.rows
    parts += [np.zeros(goal), samples.states[-1], constants]
    return np.concatenate(parts)


def unpacked(problem: OptimalProblem, w: np.ndarray, states: np.ndarray) -> MeshSamples:
    """Return the samples of variables w; states (I, K, nx): at the nodes."""
    cut, nx, nu = problem.cut, problem.node.states, problem.node.controls
    own, free = problem.coefficients * nu, problem.free
    skips = np.full(cut.stages, own + nx + free)
    skips[0] -= nx if problem.start is not None else 0
    starts = np.cumsum(skips) - skips
    coefficients = w[starts[:, None] + np.arange(own)].reshape(-1, problem.coefficients, nu)
    stage = np.repeat(np.arange(cut.stages), np.diff(cut.first))
    controls = np.einsum("kic,kca->kia", cut.basis, coefficients[stage])
    first = problem.start if problem.start is not None else w[own : own + nx]
    constants = problem.constants.copy()
    constants[:free] = w[len(w) - free :]
    return MeshSamples(np.vstack([first, states.reshape(-1, nx)]), controls, constants)
