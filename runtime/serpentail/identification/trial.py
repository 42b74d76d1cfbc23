"""One recorded trial on its mesh, and iterates of its own unknowns: states and torques."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.model import Model
from . import radau_steps as radau
from .placement import Placements, world_points
from .start import interpolated
from .torques import Known, TorquePrior, knots_of, prior_rows
from .tracks import MarkerTracks

FINEST = 2**12  # parts of a span between two frames


@dataclass(frozen=True, eq=False)
class Trial:
    """Tracks with noise (F, M) m and torques, on a mesh.

    times (K+1,) s of the mesh; frames (F,): the mesh point of each frame; known (K, 3, 2m): known
    torques at the stages. Of unknown torques: knots (U,); shares (K, 2, U) of the knots in the
    torques at both ends of each interval; prior (U, U), the rows of the prior.
    """

    tracks: MarkerTracks
    noise: np.ndarray
    torques: Known | TorquePrior
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

    @property
    def coordinates(self) -> int:
        """Number of coordinates that were seen."""
        return 3 * int(self.tracks.seen.sum())


def trial_of(
    tracks: MarkerTracks, noise: np.ndarray, torques: Known | TorquePrior, longest: float
) -> Trial:
    """Return a trial on a mesh of its frames, in intervals of at most ``longest`` (s)."""
    parts = np.clip(np.ceil(np.diff(tracks.times) / longest - 1e-9), 1, FINEST).astype(int)
    return meshed(tracks, noise, torques, parts)


def meshed(
    tracks: MarkerTracks, noise: np.ndarray, torques: Known | TorquePrior, parts: np.ndarray
) -> Trial:
    """Return a trial with as many intervals between frames as ``parts`` (F-1,) says."""
    # the mesh, with each frame at one of its points
    pieces = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(tracks.times[:-1], tracks.times[1:], parts, strict=True)
    ]
    times = np.concatenate([*pieces, tracks.times[-1:]])
    frames = np.concatenate([[0], np.cumsum(parts)])
    count = len(times) - 1

    # unknown torques are linear between knots at frames: a hat function for each knot
    if isinstance(torques, TorquePrior):
        knots = frames[knots_of(tracks.times, torques)]
        hats = np.stack(
            [np.interp(times, times[knots], row) for row in np.eye(len(knots))], axis=-1
        )
        shares = np.stack([hats[:-1], hats[1:]], axis=1)
        prior = prior_rows(times[knots], torques)
        known = np.zeros((count, 3, 0))
    else:
        known = torques(times[:-1, None] + np.diff(times)[:, None] * radau.NODES)
        knots, shares, prior = np.zeros(0, int), np.zeros((count, 2, 0)), np.zeros((0, 0))
    return Trial(tracks, noise, torques, times, frames, known, knots, shares, prior)


@dataclass(frozen=True, eq=False)
class Iterate:
    """A trial's states (K+1, nx), torques at the knots (U, 2m), stages (K, 3, nx) of intervals."""

    trial: Trial
    states: np.ndarray
    torques: np.ndarray
    stages: np.ndarray

    @property
    def ends(self) -> np.ndarray:
        """States (K, nx) in which the intervals end."""
        return self.stages[:, -1]

    @property
    def intervals(self) -> radau.Intervals:
        """The intervals that begin at these states."""
        trial, torques = self.trial, self.trial.known
        if trial.unknown_torques:
            ends = np.einsum("keu,ut->ket", trial.shares, self.torques)
            nodes = radau.NODES[:, None]
            torques = (1 - nodes) * ends[:, None, 0] + nodes * ends[:, None, 1]
        return radau.Intervals(trial.spans, self.states[:-1], torques)

    def moved(self, states: np.ndarray, torques: np.ndarray) -> "Iterate":
        """Return other states and torques; stages move with the states."""
        shift = (states - self.states)[:-1, None]
        return Iterate(self.trial, states, torques, self.stages + shift)

    def integrated(self, model: Model) -> "Iterate | None":
        """Return this with its intervals integrated; None if that fails."""
        stages = radau.solved(model, self.intervals, self.stages)
        return None if stages is None else replace(self, stages=stages)

    def defects(self, model: Model) -> np.ndarray:
        """Return the differences between the ends of intervals and the next states, (K, 2nv)."""
        return radau.difference(model, self.ends, self.states[1:])

    def modelled(self, placed: Placements) -> np.ndarray:
        """Return the positions of the markers by the model at the frames, (F, M, 3) m."""
        return world_points(placed, self.states[self.trial.frames, : placed.model.nq])

    def residuals(self, placed: Placements) -> np.ndarray:
        """Return seen less modelled positions (F, M, 3), over the noise; 0 in gaps."""
        tracks, noise = self.trial.tracks, self.trial.noise
        off = (tracks.positions - self.modelled(placed)) / noise[..., None]
        return np.where(tracks.seen[..., None], off, 0.0)


def iterate_through(
    trial: Trial, times: np.ndarray, states: np.ndarray, torques: np.ndarray
) -> Iterate:
    """Return an iterate on a trial's mesh through states (F, nx) at some times."""
    mesh = interpolated(times, states, trial.times)
    return Iterate(trial, mesh, torques, np.repeat(mesh[:-1, None], 3, axis=1))
