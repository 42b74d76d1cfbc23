"""The linear least squares of a trial about an iterate.

The unknowns of a trial are the states at all mesh points and the torques at the knots. Linearised,
each state follows from the first one, the torques, the shared unknowns and the defects, which are
the differences between the ends of integrated intervals and the next states. So the states are
eliminated, and the columns for the first state, the torques and the shared unknowns are left.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from ..basics.errors import IdentificationError
from . import radau_steps as radau
from .placement import STEP, Placements, marker_points, offset_axes, world_points
from .trial import Iterate
from .unknowns import Unknowns

MOST_NUMBERS = 6e7  # of the linear least squares of a trial
DEPENDENT = 1e-5  # of a column's length that is left: below, columns depend on each other
NULL = 1e-9  # directions with smaller singular values (relative) are undetermined


def marker_jacobians(
    unknowns: Unknowns, placed: Placements, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return derivatives (F, M, 3, nv), (F, M, 3, P) of the markers by q's tangent and unknowns."""
    points, by_q = marker_points(placed, q)
    by_shared = np.zeros((*points.shape, len(unknowns.each)))
    for k, neighbours in unknowns.neighbours(placed).items():
        above, below = (world_points(each, q) for each in neighbours)
        by_shared[..., k] = (above - below) / (2 * STEP * unknowns.sizes[k])
    if offsets := unknowns.offsets():
        axes = offset_axes(placed, q)
        for marker, axis, k in offsets:
            by_shared[:, marker, :, k] = axes[:, marker, :, axis]
    return by_q, by_shared


@dataclass(frozen=True, eq=False)
class Linear:
    """A trial about an iterate: rows (R, C) over local columns, of the first state and the
    torques, and over those of the shared unknowns; right-hand side (R,); residuals (R,) that the
    cost is made of; derivatives and defects (K, 2nv) of the mesh; the number of local columns.
    """

    iterate: Iterate
    rows: np.ndarray
    right: np.ndarray
    residual: np.ndarray
    derivatives: radau.EndDerivatives
    defects: np.ndarray
    local: int

    @cached_property
    def triangle(self) -> np.ndarray:
        """R (C+1, C+1) of the decomposition of rows and right-hand side; zeros where few are.

        Two Cholesky decompositions are as accurate as Householder's (Yamamoto et al., 2015) and
        take a tenth of the time, unless columns almost depend on each other.
        """
        both = np.column_stack([self.rows, self.right])
        size = both.shape[1]
        scale = np.linalg.norm(both, axis=0)
        if len(both) > size and scale.all():
            Q = both / scale
            try:
                first = np.linalg.cholesky(Q.T @ Q).T
                if np.diag(first).min() > DEPENDENT:
                    Q = solve_triangular(first, Q.T, trans="T").T
                    return np.linalg.cholesky(Q.T @ Q).T @ first * scale
            except np.linalg.LinAlgError:  # dependent columns
                pass
        R = np.linalg.qr(both, mode="r")
        return np.vstack([R, np.zeros((max(size - len(R), 0), size))])

    def local_step(self, shared: np.ndarray) -> np.ndarray:
        """Return the step of the local columns that belongs to one of the shared unknowns."""
        R, local = self.triangle, self.local
        scale = np.linalg.norm(R[:, :local], axis=0)
        scale[scale == 0] = 1
        right = R[:local, -1] - R[:local, local:-1] @ shared
        square = R[:local, :local] / scale
        if np.abs(np.diag(square)).min() > NULL:
            return solve_triangular(square, right) / scale
        return np.linalg.lstsq(square, right, rcond=NULL)[0] / scale

    def change(self, local: np.ndarray, shared: np.ndarray) -> np.ndarray:
        """Return how a step changes the residuals, apart from their sign."""
        return self.rows @ np.concatenate([local, shared]) + (self.residual - self.right)

    def state_steps(self, local: np.ndarray, shared: np.ndarray) -> np.ndarray:
        """Return the steps (K+1, 2nv) of all states that belong to a step of the columns."""
        trial, by = self.iterate.trial, self.derivatives
        size = by.by_state.shape[1]
        driven = self.defects + by.by_parameters @ shared
        if trial.unknown_torques:
            torques = local[size:].reshape(len(trial.knots), -1)
            ends = np.einsum("keu,ut->ket", trial.shares, torques)
            driven = driven + np.einsum("keat,ket->ka", by.by_torque, ends)
        steps = np.zeros((len(driven) + 1, size))
        steps[0] = local[:size]
        for k, (A, b) in enumerate(zip(by.by_state, driven, strict=True)):
            steps[k + 1] = A @ steps[k] + b
        return steps


def linearised(unknowns: Unknowns, placed: Placements, iterate: Iterate) -> Linear:
    """Return the linear least squares about an iterate whose intervals are integrated."""
    model = placed.model
    trial, by_struct = iterate.trial, unknowns.struct_jacobian(model)
    by = radau.differentiated(
        model, iterate.intervals, iterate.stages, by_struct, trial.unknown_torques
    )
    off = iterate.defects(model)
    q = iterate.states[trial.frames, : model.nq]
    by_q, by_shared = marker_jacobians(unknowns, placed, q)
    seen, W = trial.tracks.seen, 1 / trial.noise
    state, knots = 2 * model.nv, trial.knots.size * model.layout.nt
    local = state + knots
    columns = local + len(unknowns.each)
    if trial.coordinates * columns > MOST_NUMBERS:
        raise IdentificationError(
            f"data: {int(seen.sum())} positions and {columns} unknowns are too many at once: give "
            "shorter trials, fewer frames, or a TorquePrior of a longer time"
        )

    # every state as a linear function G x + c of the columns, from mesh point to mesh point
    G, c = np.eye(state, columns), np.zeros(state)
    rows, shifts, frame = [], [], dict(zip(trial.frames.tolist(), range(len(q)), strict=True))
    for k in range(len(trial.times)):
        f = frame.get(k)
        if f is not None and seen[f].any():
            weight = W[f, seen[f], None, None]
            J = (by_q[f, seen[f]] * weight).reshape(-1, model.nv)
            block = J @ G[: model.nv]
            block[:, local:] += (by_shared[f, seen[f]] * weight).reshape(len(J), -1)
            rows.append(block)
            shifts.append(J @ c[: model.nv])
        if k < len(trial.spans):
            A = by.by_state[k]
            G, c = A @ G, A @ c + off[k]
            if knots:
                both = np.einsum("eu,eat->aut", trial.shares[k], by.by_torque[k])
                G[:, state:local] += both.reshape(state, knots)
            G[:, local:] += by.by_parameters[k]
    residual = iterate.residuals(placed)[seen].ravel()
    right = residual - np.concatenate(shifts)

    # the prior on the torques
    if knots:
        below = np.zeros((knots, columns))
        below[:, state:local] = np.kron(trial.prior, np.eye(model.layout.nt))
        rows.append(below)
        believed = -(trial.prior @ iterate.torques).ravel()
        right, residual = np.concatenate([right, believed]), np.concatenate([residual, believed])
    return Linear(iterate, np.vstack(rows), right, residual, by, off, local)
