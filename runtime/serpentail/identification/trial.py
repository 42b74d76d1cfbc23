"""One recorded trial: its mesh, its torques, and the linear least squares about an iterate.

The unknowns of a trial are the states at all mesh points and the torques at the knots. Linearised,
each state follows from the first one, the torques, the shared unknowns and the defects, which are
the differences between the ends of integrated intervals and the next states. So the states are
eliminated, and the columns for the first state, the torques and the shared unknowns are left.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..basics.errors import IdentificationError
from ..model.model import Model
from . import radau_steps as radau
from .placement import Placements
from .points import STEP, marker_points, offset_axes, world_points
from .torques import Known, TorquePrior, knots_of, prior_rows
from .tracks import MarkerTracks
from .unknowns import Unknowns

FINEST = 2**12  # parts of a span between two frames
MOST_NUMBERS = 6e7  # of the linear least squares of a trial


@dataclass(frozen=True, eq=False)
class Trial:
    """Tracks and noise (F, M) m; mesh times (K+1,) s; the mesh point of each frame (F,); known
    torques at the stages (K, 3, 2m), or knots (U,), shares (K, 2, U) of the knots in the torques at
    both ends of each interval, and rows (U, U) of the prior.
    """

    tracks: MarkerTracks
    noise: np.ndarray
    times: np.ndarray
    frames: np.ndarray
    known: np.ndarray
    knots: np.ndarray
    shares: np.ndarray
    prior: np.ndarray

    @property
    def spans(self) -> np.ndarray:
        """Lengths of the intervals (K,), s."""
        return np.diff(self.times)

    @property
    def unknown_torques(self) -> bool:
        """Whether the torques are estimated."""
        return len(self.knots) > 0


@dataclass(frozen=True, eq=False)
class Iterate:
    """States (K+1, nx), torques at the knots (U, 2m), and stages (K, 3, nx) of the intervals."""

    states: np.ndarray
    torques: np.ndarray
    stages: np.ndarray

    @property
    def ends(self) -> np.ndarray:
        """States (K, nx) in which the intervals end."""
        return self.stages[:, -1]

    def followed(self, states: np.ndarray) -> "Iterate":
        """Return these torques with other states; stages move with them."""
        shift = (states - self.states)[:-1, None]
        return Iterate(states, self.torques, self.stages + shift)

    def over(self, model: Model, trial: Trial) -> np.ndarray:
        """Return torques (K, 3, 2m) at the stages."""
        if not trial.unknown_torques:
            return trial.known
        ends = np.einsum("keu,ut->ket", trial.shares, self.torques)
        nodes = radau.NODES[:, None]
        return (1 - nodes) * ends[:, None, 0] + nodes * ends[:, None, 1]


def trial_of(
    tracks: MarkerTracks, noise: np.ndarray, torques: Known | TorquePrior, sizes: tuple[int, float]
) -> Trial:
    """Return a trial on a mesh of its frames, spans cut so that none is longer than some.

    sizes: tail coordinates, longest span (s).
    """
    nt, longest = sizes
    parts = np.clip(np.ceil(np.diff(tracks.times) / longest - 1e-9), 1, FINEST).astype(int)
    return meshed(tracks, noise, torques, (nt, parts))


def meshed(
    tracks: MarkerTracks,
    noise: np.ndarray,
    torques: Known | TorquePrior,
    sizes: tuple[int, np.ndarray],
) -> Trial:
    """Return a trial whose spans between frames are cut into parts; sizes: 2m, parts (F-1,)."""
    nt, parts = sizes
    pieces = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(tracks.times[:-1], tracks.times[1:], parts, strict=True)
    ]
    times = np.concatenate([*pieces, tracks.times[-1:]])
    frames = np.concatenate([[0], np.cumsum(parts)])
    count = len(times) - 1
    if isinstance(torques, TorquePrior):
        knots = frames[knots_of(tracks.times, torques)]
        hats = np.stack(
            [np.interp(times, times[knots], row) for row in np.eye(len(knots))], axis=-1
        )
        shares = np.stack([hats[:-1], hats[1:]], axis=1)
        prior = prior_rows(times[knots], torques)
        known = np.zeros((count, 3, nt))
    else:
        known = torques(times[:-1, None] + np.diff(times)[:, None] * radau.NODES)
        knots, shares, prior = np.zeros(0, int), np.zeros((count, 2, 0)), np.zeros((0, 0))
    return Trial(tracks, noise, times, frames, known, knots, shares, prior)


def solved(model: Model, trial: Trial, iterate: Iterate) -> Iterate | None:
    """Return the iterate with its intervals integrated; None if that fails."""
    found = radau.solved(
        model, trial.spans, iterate.states[:-1], iterate.over(model, trial), iterate.stages
    )
    return None if found is None else replace(iterate, stages=found)


def defects(model: Model, iterate: Iterate) -> np.ndarray:
    """Return the differences between the ends of the intervals and the next states, (K, 2nv)."""
    return radau.difference(model, iterate.ends, iterate.states[1:])


def residuals(model: Model, placed: Placements, trial: Trial, states: np.ndarray) -> np.ndarray:
    """Return seen less modelled positions (F, M, 3), over the noise; 0 where none was seen."""
    found = seen_points(model, placed, trial, states)
    gap = ~trial.tracks.seen[..., None]
    return np.where(gap, 0.0, (trial.tracks.positions - found) / trial.noise[..., None])


def seen_points(model: Model, placed: Placements, trial: Trial, states: np.ndarray) -> np.ndarray:
    """Return the positions of the markers by the model at the frames, (F, M, 3) m."""
    return world_points(model, placed, states[trial.frames, : model.nq])


def marker_jacobians(
    unknowns: Unknowns, model: Model, placed: Placements, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return derivatives (F, M, 3, nv), (F, M, 3, P) of the markers by q's tangent and unknowns."""
    points, by_q = marker_points(model, placed, q)
    by = np.zeros((*points.shape, len(unknowns.each)))
    for k, beside in unknowns.beside(model).items():
        above, below = (world_points(each, placed, q) for each in beside)
        by[..., k] = (above - below) / (2 * STEP * unknowns.sizes[k])
    if offsets := unknowns.offsets():
        axes = offset_axes(model, placed, q)
        for marker, axis, k in offsets:
            by[:, marker, :, k] = axes[:, marker, :, axis]
    return by_q, by


@dataclass(frozen=True, eq=False)
class Linear:
    """A trial about an iterate: rows (R, C) over columns of first state, torques and unknowns;
    right-hand side (R,); residuals (R,) that the cost is made of; steps and defects of the mesh.
    """

    rows: np.ndarray
    right: np.ndarray
    residual: np.ndarray
    steps: radau.Steps
    defects: np.ndarray

    def states(self, trial: Trial, step: np.ndarray, shared: np.ndarray) -> np.ndarray:
        """Return the steps (K+1, 2nv) of all states for a solution of the linear problem."""
        own = self.steps.by_state.shape[1]
        torques = step[own:].reshape(len(trial.knots), self.steps.by_torque.shape[-1])
        driven = self.defects + self.steps.by_parameters @ shared
        if trial.unknown_torques:
            ends = np.einsum("keu,ut->ket", trial.shares, torques)
            driven = driven + np.einsum("keat,ket->ka", self.steps.by_torque, ends)
        found = np.zeros((len(driven) + 1, own))
        found[0] = step[:own]
        for k, (A, b) in enumerate(zip(self.steps.by_state, driven, strict=True)):
            found[k + 1] = A @ found[k] + b
        return found


def linearised(
    unknowns: Unknowns, model: Model, placed: Placements, trial: Trial, iterate: Iterate
) -> Linear:
    """Return the linear least squares about an iterate whose intervals are integrated."""
    by_unknowns = unknowns.struct_jacobian(model)
    torques = iterate.over(model, trial)
    parts = iterate.stages, by_unknowns, trial.unknown_torques
    steps = radau.differentiated(model, trial.spans, iterate.states[:-1], torques, parts)
    off = defects(model, iterate)
    q = iterate.states[trial.frames, : model.nq]
    by_q, by_shared = marker_jacobians(unknowns, model, placed, q)
    seen = trial.tracks.seen
    own, knots = 2 * model.nv, trial.knots.size * model.layout.nt
    columns = own + knots + len(unknowns.each)
    if 3 * seen.sum() * columns > MOST_NUMBERS:
        raise IdentificationError(
            f"data: {int(seen.sum())} positions and {columns} unknowns are too many at once: give "
            "shorter trials, fewer frames, or a TorquePrior of a longer time"
        )
    # every state as a linear function of the columns, frame by frame
    G, c = np.zeros((own, columns)), np.zeros(own)
    G[:, :own] = np.eye(own)
    W = 1 / trial.noise
    rows, shifts, frame = [], [], dict(zip(trial.frames.tolist(), range(len(q)), strict=True))
    for k in range(len(trial.times)):
        f = frame.get(k)
        if f is not None and seen[f].any():
            here = seen[f]
            J = (by_q[f, here] * W[f, here, None, None]).reshape(-1, model.nv)
            block = J @ G[: model.nv]
            block[:, own + knots :] += (by_shared[f, here] * W[f, here, None, None]).reshape(
                len(J), -1
            )
            rows.append(block)
            shifts.append(J @ c[: model.nv])
        if k < len(trial.spans):
            A = steps.by_state[k]
            G, c = A @ G, A @ c + off[k]
            if knots:
                both = np.einsum("eu,eat->aut", trial.shares[k], steps.by_torque[k])
                G[:, own : own + knots] += both.reshape(own, knots)
            G[:, own + knots :] += steps.by_parameters[k]
    residual = residuals(model, placed, trial, iterate.states)[seen].ravel()
    right = residual - np.concatenate(shifts)
    return _with_prior(trial, iterate, (np.vstack(rows), right, residual), steps, off)


def _with_prior(
    trial: Trial,
    iterate: Iterate,
    parts: tuple[np.ndarray, np.ndarray, np.ndarray],
    steps: radau.Steps,
    off: np.ndarray,
) -> Linear:
    """Return the linear problem with the rows of the prior on the torques."""
    rows, right, residual = parts
    if not trial.unknown_torques:
        return Linear(rows, right, residual, steps, off)
    own, nt = steps.by_state.shape[1], iterate.torques.shape[1]
    below = np.zeros((iterate.torques.size, rows.shape[1]))
    below[:, own : own + iterate.torques.size] = np.kron(trial.prior, np.eye(nt))
    believed = -(trial.prior @ iterate.torques).ravel()
    return Linear(
        np.vstack([rows, below]),
        np.concatenate([right, believed]),
        np.concatenate([residual, believed]),
        steps,
        off,
    )
